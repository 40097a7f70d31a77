// The filter of what picks do: the same bits whatever tiles, threads and instructions; where it
// does nothing; pixels that have no colour. tests/parity/test_clean_up.py has a reference.
#include "output/clean_up.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include "check.hpp"
#include "convert/colour_spaces.hpp"
#include "images.hpp"
#include "output/clean_up_kernels.hpp"
#include "output/drawing.hpp"
#include "shapes.hpp"
#include "simd/instruction_set.hpp"

using namespace palette4d;
using namespace shapes;
using images::Image;
using images::kInf;
using images::kNan;
using images::same_bits;

namespace {

/// Reds become green. With `moves`, so does the palette.
Drawing picked_drawing(bool moves = false, double strength = 1) {
    const Mesh mesh = tetrahedron();
    Edits edits;
    Pick pick;
    pick.id = "p1";
    pick.rgb = {0.75, 0.25, 0.25};
    pick.to = {0.25, 0.5, 0.75};
    pick.matte = std::make_shared<const Matte>(hue_matte(pick.rgb));
    edits.picks.push_back(pick);
    std::vector<Vec3> edited = mesh.rgb;
    if (moves) edited[3] = {0.1, 0.2, 0.8};
    Drawing drawing;
    drawing.options.strength = strength;
    drawing.edit =
        std::make_shared<const Recolourer>(mesh.rgb, edited, mesh.faces, picks_at(edits, 0));
    drawing.original = mesh.rgb;
    drawing.edited = edited;
    return drawing;
}

/// Areas of red and of other colours, with noise.
Image picture(int width, int height, int channels = 3) {
    Image image(width, height, channels);
    Random random(11);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            float* const pixel = &image.data[static_cast<std::size_t>(y * width + x) * channels];
            const bool red = (x / 17 + y / 13) % 2 == 0;
            const double colour[3] = {red ? 0.7 : 0.3, 0.3, red ? 0.25 : 0.5};
            for (int c = 0; c < 3; ++c) {
                pixel[c] = static_cast<float>(colour[c] + random.uniform(-0.04, 0.04));
            }
            if (channels == 4) pixel[3] = static_cast<float>(random.uniform(0.2, 1));
        }
    }
    return image;
}

Image cleaned_picture(const Image& in, const Drawing& drawing, bool premultiplied = false,
                      int threads = 1) {
    Image out(in.width, in.height, in.channels);
    draw_picture(in.in(), out.out(), drawing, premultiplied, threads);
    return out;
}

/// The change of an area of a picture whose rows count upwards from (`left`, `bottom`).
std::vector<float> change(const Image& image, const Drawing& drawing, int left, int bottom,
                          const Area& area, int width, int height, int threads = 1) {
    const Area whole = {left, bottom, left + image.width, bottom + image.height};
    CleanUp clean_up(drawing.edit, nullptr, 1, {image.channels, image.channels == 4},
                     {whole, whole, area, whole, width, height});
    const auto at = [&](int x, int y) {
        return &image.data[static_cast<std::size_t>((y - bottom) * image.width + x - left) *
                           image.channels];
    };
    clean_up.prepare([&](int y, int x1, int, float*) { return at(x1, y); }, threads,
                     [](int count, const std::function<void(int)>& work) {
                         for (int i = count - 1; i >= 0; --i) work(i);
                     });
    std::vector<float> all;
    std::vector<float> row(static_cast<std::size_t>(area.x2 - area.x1) * 3);
    for (int y = area.y1; y < area.y2; ++y) {
        if (!clean_up.change(at(area.x1, y), area.x1, y, area.x2 - area.x1, 0, row.data())) {
            std::fill(row.begin(), row.end(), 0.0f);
        }
        all.insert(all.end(), row.begin(), row.end());
    }
    return all;
}

}  // namespace

TEST(a_tile_has_the_bits_of_the_whole_picture) {
    const Drawing drawing = picked_drawing();
    for (const auto& [channels, left, bottom] :
         {std::tuple{3, 0, 0}, std::tuple{4, -1000003, 77}}) {
        const Image image = picture(157, 90, channels);
        for (const auto& [width, height] : {std::pair{4, 4}, std::pair{1, 1}, std::pair{3, 2},
                                            std::pair{8, 5}, std::pair{32, 32}}) {
            const Area whole = {left, bottom, left + 157, bottom + 90};
            const auto all = change(image, drawing, left, bottom, whole, width, height);
            CHECK(same_bits(all, change(image, drawing, left, bottom, whole, width, height, 7)));
            Random random(3);
            for (int i = 0; i < check::rounds(12); ++i) {
                const int x = random.below(156), y = random.below(89);
                const Area tile = {left + x, bottom + y, left + x + 1 + random.below(157 - x - 1),
                                   bottom + y + 1 + random.below(90 - y - 1)};
                const auto part = change(image, drawing, left, bottom, tile, width, height);
                std::vector<float> expected;
                for (int row = tile.y1; row < tile.y2; ++row) {
                    const auto from =
                        all.begin() + ((row - bottom) * 157 + tile.x1 - left) * std::ptrdiff_t{3};
                    expected.insert(expected.end(), from, from + 3 * (tile.x2 - tile.x1));
                }
                CHECK(same_bits(part, expected));
            }
        }
    }
}

TEST(threads_change_nothing) {
    for (const bool moves : {false, true}) {
        for (const int channels : {3, 4}) {
            const Image in = picture(200, 150, channels);
            const Image one = cleaned_picture(in, picked_drawing(moves), channels == 4, 1);
            for (const int threads : {0, 2, 5}) {
                CHECK(same_bits(
                    one.data,
                    cleaned_picture(in, picked_drawing(moves), channels == 4, threads).data));
            }
        }
    }
}

TEST(all_instruction_sets_filter_alike) {
    constexpr int kPlane = 100 + 2 * kCleanUpReach;
    Random random(5);
    alignas(64) float colour[3][64], moved[kCleanUpMoved][64], counts[64];
    for (int i = 0; i < 64; ++i) {
        for (int c = 0; c < 3; ++c) {
            colour[c][i] = i % 7 == 0 ? kNan : static_cast<float>(random.uniform(-1, 3));
            moved[c][i] = static_cast<float>(random.uniform(-1, 1));
        }
        moved[3][i] = static_cast<float>(random.uniform(0, 2));
    }
    std::vector<std::vector<double>> results;
    for (const InstructionSet set : instruction_sets()) {
        const auto& kernels = kernels_of<CleanUpKernels>(set);
        float own[3][64], kept[kCleanUpMoved][64];
        std::copy_n(&colour[0][0], 192, &own[0][0]);
        std::copy_n(&moved[0][0], 64 * kCleanUpMoved, &kept[0][0]);
        kernels.check(own, nullptr, counts);
        kernels.limit(own, own);
        CHECK(kernels.keep(counts, kept));
        std::vector<double> found;
        std::vector<double> sums(kPlane * kCleanUpSums), terms(kPlane * (kCleanUpTerms + 1));
        for (const int width : {4, 3}) {
            const int cells = 64 / width;
            for (int at = 0; at + cells <= 100; at += cells) {
                kernels.add(own, kept, counts, cells, cells, width,
                            sums.data() + kCleanUpReach + at, kPlane);
            }
            const double* rows[kCleanUpRows];
            std::fill(std::begin(rows), std::end(rows), sums.data());
            kernels.fit(rows, kPlane, 0, 100, terms.data());
            std::fill_n(terms.begin() + kCleanUpTerms * kPlane + kCleanUpReach, 100, 1.0);
            std::fill(std::begin(rows), std::end(rows), terms.data());
            std::vector<float> smooth(100 * kCleanUpTerms);
            kernels.smooth(rows, kPlane, 0, 100, smooth.data(), 100);
            const float parts[4] = {0.125f, 0.375f, 0.625f, 0.875f};
            float result[3][64] = {};
            kernels.apply({smooth.data(), smooth.data() + 5, 100, 0.3f, parts, cells, width}, own,
                          kept, counts, 0.75f, 0.25f, result);
            found.insert(found.end(), sums.begin(), sums.end());
            found.insert(found.end(), smooth.begin(), smooth.end());
            found.insert(found.end(), &result[0][0], &result[0][0] + 192);
        }
        results.push_back(found);
        CHECK(results.front() == found);
        CHECK(std::all_of(found.begin(), found.end(), [](double x) { return std::isfinite(x); }));
    }
}

TEST(nothing_is_cleaned_up_without_picks) {
    const Image in = picture(60, 40, 4);
    Drawing drawing = picked_drawing(true);
    const Mesh mesh = tetrahedron();
    drawing.edit = std::make_shared<const Recolourer>(mesh.rgb, drawing.edited, mesh.faces);
    const Area whole = {0, 0, 60, 40};
    CHECK(!make_clean_up(drawing, {4, false}, {whole, whole, whole, whole, 4, 4}));
    Drawing off = drawing;
    off.options.clean_up = 0;
    CHECK(same_bits(cleaned_picture(in, drawing).data, cleaned_picture(in, off).data));
    drawing = picked_drawing(true);
    CHECK(make_clean_up(drawing, {4, false}, {whole, whole, whole, whole, 4, 4}) != nullptr);
    for (const Output output : {Output::kWeight, Output::kOutside}) {
        drawing.options.output = output;
        CHECK(!make_clean_up(drawing, {4, false}, {whole, whole, whole, whole, 4, 4}));
    }
}

TEST(colours_that_are_none_take_no_part) {
    const Drawing drawing = picked_drawing();
    Image in = picture(80, 60, 4);
    const auto at = [](Image& image, int x, int y) {
        return &image.data[static_cast<std::size_t>(y * image.width + x) * 4];
    };
    // Transparent, and not finite: as if they were not there.
    Image other = in;
    for (int i = 0; i < 600; ++i) {
        const int x = i * 7 % 80, y = i * 11 % 60;
        float *const a = at(in, x, y), *const b = at(other, x, y);
        a[3] = 0;
        b[i % 3] = i % 2 ? kNan : kInf;
    }
    const Image first = cleaned_picture(in, drawing, true),
                second = cleaned_picture(other, drawing, true);
    int moved = 0;
    for (int i = 0; i < 80 * 60; ++i) {
        const auto from = static_cast<std::ptrdiff_t>(i) * 4;
        const bool passes = in.data[static_cast<std::size_t>(from + 3)] == 0;
        const auto bits = [&](const Image& image) {
            return std::vector<float>(image.data.begin() + from, image.data.begin() + from + 4);
        };
        moved += same_bits(bits(first), bits(in)) ? 0 : 1;
        CHECK(passes ? same_bits(bits(first), bits(in)) && same_bits(bits(second), bits(other))
                     : same_bits(bits(first), bits(second)));
    }
    CHECK(moved > 80 * 60 / 3);  // half of the picture is red
}

TEST(strength_scales_what_is_cleaned_up) {
    const Image in = picture(90, 70);
    const Image full = cleaned_picture(in, picked_drawing(true)),
                half = cleaned_picture(in, picked_drawing(true, 0.5));
    for (std::size_t i = 0; i < in.data.size(); ++i) {
        CHECK_NEAR(half.data[i] - in.data[i], 0.5 * (full.data[i] - in.data[i]), 1e-6);
    }
    CHECK(same_bits(cleaned_picture(in, picked_drawing(true, 0)).data, in.data));
}

TEST(a_conversion_leads_to_the_palette_and_back) {
    const std::shared_ptr<const ColourConversion> conversion = from_linear("Rec.709");
    for (const bool moves : {false, true}) {
        for (const bool premultiplied : {false, true}) {
            // The same picture in the palette's code values, drawn without a conversion.
            const Image in = picture(90, 70, 4);
            Image there = in;
            for (std::size_t i = 0; i < in.data.size(); i += 4) {
                const Vec3 to = conversion->to_palette(straight_colour(&in.data[i], premultiplied));
                for (std::size_t c = 0; c < 3; ++c) there.data[i + c] = static_cast<float>(to[c]);
            }
            const Image expected = cleaned_picture(there, picked_drawing(moves));
            Drawing drawing = picked_drawing(moves);
            drawing.conversion = conversion;
            const Image found = cleaned_picture(in, drawing, premultiplied);
            for (std::size_t i = 0; i < in.data.size(); i += 4) {
                const Vec3 back = conversion->to_clip(
                    {expected.data[i], expected.data[i + 1], expected.data[i + 2]});
                const double alpha = premultiplied ? in.data[i + 3] : 1.0;
                for (std::size_t c = 0; c < 3; ++c) {
                    CHECK_NEAR(found.data[i + c], alpha * back[c], 1e-6);
                }
                CHECK(found.data[i + 3] == in.data[i + 3]);
            }
        }
    }
}

TEST(cells_shrink_with_the_picture) {
    CHECK_EQUAL(clean_up_cell(1), 4);
    CHECK_EQUAL(clean_up_cell(0.5), 2);
    CHECK_EQUAL(clean_up_cell(0.25), 1);
    CHECK_EQUAL(clean_up_cell(0.01), 1);
    CHECK_EQUAL(clean_up_cell(1e9), 32);
    CHECK_EQUAL(clean_up_cell(kNan), 4);
    CHECK_EQUAL(clean_up_cell(1, 360), 4);
    CHECK_EQUAL(clean_up_cell(1, 288), 2);
    CHECK_EQUAL(clean_up_cell(0.5, 288), 1);
    CHECK_EQUAL(clean_up_support(4), 24);
}
