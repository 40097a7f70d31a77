#include "lattice/lattice.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <set>
#include <stdexcept>
#include <thread>

#include "check.hpp"
#include "images.hpp"
#include "picks.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace images;
using namespace shapes;

namespace {

/// Colours around a few, as in a picture: some in the middle, some far outside, gradients between.
Image picture(int width, int height, int channels, std::uint64_t seed, double low = -0.05,
              double high = 1.05) {
    Image image(width, height, channels);
    Random random(seed);
    const Vec3 ends[4] = {random.colour(low, high), random.colour(low, high),
                          random.colour(low, high), random.colour(low, high)};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            float* pixel = &image.data[(static_cast<std::size_t>(y) * width + x) * channels];
            const double u = (x + 0.5) / width, v = (y + 0.5) / height;
            for (std::size_t c = 0; c < 3; ++c) {
                const double smooth = (1 - u) * ((1 - v) * ends[0][c] + v * ends[1][c]) +
                                      u * ((1 - v) * ends[2][c] + v * ends[3][c]);
                pixel[c] = static_cast<float>(smooth + random.uniform(-0.03, 0.03));
            }
            if (channels == 4) pixel[3] = static_cast<float>(random.uniform(0.05, 1));
        }
    }
    return image;
}

struct Edited {
    Mesh mesh;
    std::vector<Vec3> colours;
    std::shared_ptr<const Recolourer> recolourer() const {
        return std::make_shared<Recolourer>(mesh.rgb, colours, mesh.faces);
    }
};

/// A third of a palette's colours moved.
Edited edited(Mesh mesh, std::uint64_t seed) {
    Random random(seed);
    std::vector<Vec3> colours = mesh.rgb;
    for (std::size_t i = 0; i < colours.size(); i += 3) {
        const Vec3 step = random.colour(-0.3, 0.3);
        for (std::size_t c = 0; c < 3; ++c) colours[i][c] += step[c];
    }
    return {std::move(mesh), std::move(colours)};
}

std::vector<Edited> palettes() {
    Random random(5);
    std::vector<Edited> all{edited(tetrahedron(), 1), edited(cube(), 2), edited(concave_cube(), 3),
                            edited(flat_square(), 4), edited(flat_triangle(), 5)};
    for (int i = 0; i < 4; ++i) all.push_back(edited(random_convex(random, 6 + 5 * i), 6 + i));
    return all;
}

/// The largest |a - b| / max(|b|, 0.1) of the colours.
double difference(const Image& a, const Image& b) {
    double worst = 0;
    for (std::size_t i = 0; i < a.data.size(); ++i) {
        const double exact = b.data[i];
        const double found = std::abs(a.data[i] - exact) / std::max(std::abs(exact), 0.1);
        worst = found <= worst ? worst : found;
    }
    return worst;
}

}  // namespace

TEST(pictures_are_within_the_tolerance_of_the_exact_ones) {
    long long interpolated = 0, exact = 0;
    int seed = 20;
    for (const Edited& palette : palettes()) {
        const auto recolourer = palette.recolourer();
        const Lattice lattice(recolourer);
        CHECK_EQUAL(lattice.largest_error(), 0.0);
        for (const int channels : {3, 4}) {
            for (const double strength : {1.0, 0.3}) {
                const Image image = picture(301, 83, channels, ++seed);
                Image expected(301, 83, channels), found(301, 83, channels);
                recolourer->apply(image.in(), expected.out(), {strength});
                const RecolourCounts counts = lattice.apply(image.in(), found.out(), {strength});
                CHECK_EQUAL(counts.interpolated + counts.exact(), 301LL * 83);
                interpolated += counts.interpolated;
                exact += counts.exact();
                CHECK(difference(found, expected) <= Lattice::kTolerance);
            }
        }
        CHECK(lattice.largest_error() > 0 && lattice.largest_error() <= Lattice::kTolerance);
        const Lattice::Size size = lattice.size();
        CHECK(size.cells > 0 && size.cut <= 9 * size.cells);
        CHECK(size.parts == 8 * size.cut && size.exact <= size.parts);
    }
    // Both ways were taken, the fast one by most.
    CHECK(exact > 0);
    CHECK(interpolated > 2 * exact);
}

namespace {

/// A palette from which two faces look down that nearly lie in one plane; that of one of them is
/// one of the planes that the lattice's nodes lie in.
Mesh nearly_flat_below() {
    constexpr double kLow = 0.9 / 63.8;  // five cells above the domain's end, 4.1 below 0
    Mesh mesh{{{0.0, 0.067, 0.0},
               {0.1916, 0.0082, 0.0},
               {0.3465, 0.7537, 0.0},
               {0.9292, 0.8469, 0.021},
               {0.5802, 0.7382, 0.98},
               {0.8503, 1.0, 0.98},
               {0.9752, 0.842, 0.9638},
               {1.0, 1.0, 0.98}},
              {{0, 1, 4},
               {4, 1, 6},
               {6, 1, 3},
               {0, 4, 2},
               {2, 1, 0},
               {2, 3, 1},
               {5, 2, 4},
               {3, 2, 5},
               {6, 3, 7},
               {3, 5, 7},
               {7, 4, 6},
               {7, 5, 4}}};
    for (Vec3& colour : mesh.rgb) colour[2] += kLow;
    return mesh;
}

}  // namespace

TEST(colours_beside_a_face_in_a_plane_of_nodes_are_within_the_tolerance) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        Edited palette{nearly_flat_below(), nearly_flat_below().rgb};
        Random random(seed);
        for (Vec3& colour : palette.colours) {
            if (random.uniform() < 0.6) continue;
            const Vec3 step = random.colour(-0.3, 0.3);
            for (std::size_t c = 0; c < 3; ++c) colour[c] += step[c];
        }
        const auto recolourer = palette.recolourer();
        if (!recolourer->moves()) continue;
        Image image(400, 100, 3);
        for (std::size_t i = 0; i < image.data.size(); i += 3) {
            const Vec3 place = random.colour();
            image.data[i] = static_cast<float>(0.2 + 0.5 * place[0]);
            image.data[i + 1] = static_cast<float>(0.2 + 0.5 * place[1]);
            image.data[i + 2] = static_cast<float>(0.01 + 0.02 * place[2]);
        }
        Image expected(400, 100, 3), found(400, 100, 3);
        recolourer->apply(image.in(), expected.out(), {});
        Lattice(recolourer).apply(image.in(), found.out(), {});
        CHECK(difference(found, expected) <= Lattice::kTolerance);
    }
}

TEST(beside_a_dent_colours_are_within_the_tolerance) {
    // Faces that see each other, and beyond them colours that jump from one to the other.
    Random random(3);
    for (int seed = 0; seed < check::rounds(10); ++seed) {
        Mesh mesh = random_convex(random, 8 + seed % 8);
        Vec3 centre{};
        for (const Vec3& colour : mesh.rgb) {
            for (std::size_t c = 0; c < 3; ++c) {
                centre[c] += colour[c] / static_cast<double>(mesh.rgb.size());
            }
        }
        Vec3& dent = mesh.rgb[static_cast<std::size_t>(seed) % mesh.rgb.size()];
        for (std::size_t c = 0; c < 3; ++c) dent[c] += 0.5 * (centre[c] - dent[c]);
        Image image(400, 100, 3);
        for (std::size_t i = 0; i < image.data.size(); i += 3) {
            const bool near = i % 2 == 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double colour =
                    near ? dent[c] + random.uniform(-0.08, 0.08) : random.uniform(-0.05, 1.05);
                image.data[i + c] = static_cast<float>(colour);
            }
        }
        const auto recolourer = edited(mesh, seed).recolourer();
        Image expected(400, 100, 3), found(400, 100, 3);
        recolourer->apply(image.in(), expected.out(), {});
        const Lattice lattice(recolourer);
        lattice.apply(image.in(), found.out(), {});
        CHECK(difference(found, expected) <= Lattice::kTolerance);
    }
}

TEST(parts_are_halved_where_there_is_room_for_all_of_the_inside) {
    for (const double width : {0.5, 1.0}) {
        Edited palette = edited(cube(), 2);
        for (std::vector<Vec3>* colours : {&palette.mesh.rgb, &palette.colours}) {
            for (Vec3& colour : *colours) {
                for (double& channel : colour) channel = 0.25 + width * channel;
            }
        }
        // Beside an edge, over the length of some cells.
        Image image(600, 200, 3);
        Random random(3);
        const double cell = std::max(1.0, 0.25 + width) / 63.8;
        std::set<std::array<int, 3>> cells;
        for (std::size_t i = 0; i < image.data.size(); i += 3) {
            const Vec3 place = random.colour();
            const Vec3 colour = {0.3 + 0.1 * place[0], 0.25 + 0.01 * place[1],
                                 0.25 + 0.01 * place[2]};
            std::array<int, 3> in_cell;
            for (std::size_t c = 0; c < 3; ++c) {
                image.data[i + c] = static_cast<float>(colour[c]);
                in_cell[c] = static_cast<int>(colour[c] / cell + 4.1);
            }
            cells.insert(in_cell);
        }
        const auto recolourer = palette.recolourer();
        const Lattice lattice(recolourer);
        Image expected(600, 200, 3), found(600, 200, 3);
        recolourer->apply(image.in(), expected.out(), {});
        lattice.apply(image.in(), found.out(), {});
        CHECK(difference(found, expected) <= Lattice::kTolerance);
        // A cube of half the width has some 32^3 cells, of the whole some 50^3: too many.
        const auto asked_for = static_cast<long long>(cells.size());
        CHECK(asked_for < 40 && lattice.size().cut > 0);
        CHECK((lattice.size().cut > asked_for) == (width < 1));
    }
}

namespace {

void check_that_bits_depend_on_pixels_only(const Edited& palette) {
    const auto recolourer = palette.recolourer();
    for (const int channels : {3, 4}) {
        const Image image = picture(517, 23, channels, 7);
        Image expected(517, 23, channels);
        RecolourOptions options{0.8, channels == 4, 1};
        Lattice(recolourer).apply(image.in(), expected.out(), options);
        for (const InstructionSet set : instruction_sets()) {
            Image found(517, 23, channels);
            options.instructions = set;
            Lattice(recolourer).apply(image.in(), found.out(), options);
            CHECK(same_bits(found.data, expected.data));
        }
        options.instructions = InstructionSet::kBest;
        for (const int threads : {2, 8, 0}) {
            const Lattice lattice(recolourer);
            options.threads = threads;
            for (int again = 0; again < 2; ++again) {
                Image found(517, 23, channels);
                lattice.apply(image.in(), found.out(), options);
                CHECK(same_bits(found.data, expected.data));
            }
        }
        // Tiles from the last to the first, after a picture of something else.
        const Lattice lattice(recolourer);
        const Image other = picture(200, 50, channels, 8);
        Image nobody(200, 50, channels), found(517, 23, channels);
        lattice.apply(other.in(), nobody.out(), options);
        constexpr int kTile = 37;
        for (int x = 517 / kTile * kTile; x >= 0; x -= kTile) {
            const int width = std::min(kTile, 517 - x);
            ConstImageView in = image.in();
            ImageView out = found.out();
            in.data += x * channels;
            out.data += x * channels;
            in.width = out.width = width;
            lattice.apply(in, out, options);
        }
        CHECK(same_bits(found.data, expected.data));
    }
}

}  // namespace

TEST(instruction_sets_threads_tiles_and_what_was_asked_before_do_not_show) {
    Random random(40);
    check_that_bits_depend_on_pixels_only(edited(concave_cube(), 3));
    check_that_bits_depend_on_pixels_only(edited(random_convex(random, 8), 4));
}

TEST(threads_of_a_host_share_one_lattice) {
    Random random(41);
    for (const Edited& palette : {edited(concave_cube(), 9), edited(random_convex(random, 8), 9)}) {
        const auto recolourer = palette.recolourer();
        // The same colours for all threads, so that they are at the same cells at the same time.
        const Image image = picture(400, 24, 4, 11);
        Image expected(400, 24, 4);
        Lattice(recolourer).apply(image.in(), expected.out(), {1.0, true});
        for (int again = 0; again < check::rounds(50); ++again) {
            const Lattice lattice(recolourer);
            std::vector<Image> found(4, Image(400, 24, 4));
            std::vector<std::thread> threads;
            for (Image& mine : found) {
                threads.emplace_back([&] { lattice.apply(image.in(), mine.out(), {1.0, true}); });
            }
            for (std::thread& thread : threads) thread.join();
            for (const Image& mine : found) CHECK(same_bits(mine.data, expected.data));
        }
    }
}

TEST(what_lies_outside_or_is_no_number_has_the_exact_bits) {
    const auto recolourer = edited(cube(), 12).recolourer();
    const Lattice lattice(recolourer);
    Image image = picture(96, 20, 4, 13, 3, 5);  // far outside
    const float odd[] = {kNan, kInf, -kInf, 3e38f, -3e38f, 1e30f};
    for (std::size_t i = 0; i < 60; ++i) image.data[i * 7] = odd[i % 6];
    for (std::size_t i = 0; i < 20; ++i) image.data[400 + 4 * i + 3] = odd[i % 6];
    for (std::size_t i = 0; i < 20; ++i) image.data[800 + 4 * i + 3] = i % 2 ? 0.0f : -0.0f;
    for (const bool premultiplied : {false, true}) {
        // Premultiplied by what keeps colours outside, and by nothing at all.
        Image expected(96, 20, 4), found(96, 20, 4);
        recolourer->apply(image.in(), expected.out(), {1.0, premultiplied});
        const RecolourCounts counts = lattice.apply(image.in(), found.out(), {1.0, premultiplied});
        CHECK_EQUAL(counts.interpolated, 0LL);
        CHECK(same_bits(found.data, expected.data));
        Image place = image;
        lattice.apply(place.in(), place.out(), {1.0, premultiplied});
        CHECK(same_bits(place.data, expected.data));
    }
}

TEST(a_palette_beyond_the_unit_cube_widens_the_lattice) {
    Mesh mesh = cube();
    for (Vec3& colour : mesh.rgb) {
        for (double& x : colour) x = 4 * x - 1;
    }
    const auto recolourer = edited(mesh, 14).recolourer();
    const Lattice lattice(recolourer);
    const Image image = picture(200, 60, 3, 15, -1, 3);
    Image expected(200, 60, 3), found(200, 60, 3);
    recolourer->apply(image.in(), expected.out(), {});
    const RecolourCounts counts = lattice.apply(image.in(), found.out(), {});
    CHECK(counts.interpolated > 0);
    CHECK(difference(found, expected) <= Lattice::kTolerance);
}

TEST(without_an_edit_every_bit_passes) {
    const auto same = std::make_shared<Recolourer>(cube().rgb, cube().rgb, cube().faces);
    const Lattice lattice(same);
    Image image = picture(50, 9, 4, 16);
    image.data[0] = kNan;
    image.data[4] = -0.0f;
    Image found(50, 9, 4);
    lattice.apply(image.in(), found.out(), {1.0, true});
    CHECK(same_bits(found.data, image.data));
    CHECK_EQUAL(lattice.size().colours, 0LL);
    Image off(50, 9, 4);
    Lattice(edited(cube(), 17).recolourer()).apply(image.in(), off.out(), {0.0});
    CHECK(same_bits(off.data, image.data));
}

TEST(channels_that_do_not_move_keep_their_bits) {
    std::vector<Vec3> colours = cube().rgb;
    for (Vec3& colour : colours) colour[0] *= 0.5;
    const auto recolourer = std::make_shared<Recolourer>(cube().rgb, colours, cube().faces);
    const Lattice lattice(recolourer);
    Image image = picture(300, 40, 3, 18);
    image.data[4] = -0.0f;
    Image found(300, 40, 3);
    lattice.apply(image.in(), found.out(), {});
    int moved = 0;
    for (std::size_t i = 0; i < image.data.size(); i += 3) {
        CHECK(std::memcmp(&found.data[i + 1], &image.data[i + 1], 2 * sizeof(float)) == 0);
        moved += found.data[i] != image.data[i];
    }
    CHECK(moved > 10000);
}

TEST(a_strength_beyond_0_to_1_and_double_precision_are_exact) {
    const auto recolourer = edited(cube(), 19).recolourer();
    const Lattice lattice(recolourer);
    const Image image = picture(70, 30, 3, 20);
    for (const double strength : {1.5, -0.5}) {
        Image expected(70, 30, 3), found(70, 30, 3);
        recolourer->apply(image.in(), expected.out(), {strength});
        CHECK_EQUAL(lattice.apply(image.in(), found.out(), {strength}).interpolated, 0LL);
        CHECK(same_bits(found.data, expected.data));
    }
    Image expected(70, 30, 3), found(70, 30, 3);
    const RecolourOptions options{1, false, 1, Precision::kDouble};
    recolourer->apply(image.in(), expected.out(), options);
    lattice.apply(image.in(), found.out(), options);
    CHECK(same_bits(found.data, expected.data));
}

TEST(rows_may_be_padded_upside_down_or_the_same_memory) {
    const auto recolourer = edited(cube(), 21).recolourer();
    const Lattice lattice(recolourer);
    for (const int channels : {3, 4}) {
        for (const int width : {1, 63, 64, 65, 131}) {
            const Image image = picture(width, 7, channels, 22);
            Image expected(width, 7, channels);
            lattice.apply(image.in(), expected.out(), {});
            const std::size_t row = static_cast<std::size_t>(width * channels), padded = row + 3;
            std::vector<float> in(padded * 7, 7.0f), out(padded * 7, 9.0f);
            for (std::size_t y = 0; y < 7; ++y) {
                std::copy_n(&image.data[y * row], row, &in[(6 - y) * padded]);
            }
            const auto stride = -static_cast<std::ptrdiff_t>(padded * sizeof(float));
            lattice.apply({&in[6 * padded], width, 7, channels, stride},
                          {&out[6 * padded], width, 7, channels, stride}, {1, false, 3});
            for (std::size_t y = 0; y < 7; ++y) {
                const float* found = &out[(6 - y) * padded];
                CHECK(std::memcmp(found, &expected.data[y * row], row * sizeof(float)) == 0);
                for (std::size_t x = row; x < padded; ++x) CHECK_EQUAL(found[x], 9.0f);
            }
            Image place = image;
            lattice.apply(place.in(), place.out(), {1, false, 2});
            CHECK(same_bits(place.data, expected.data));
        }
    }
}

TEST(what_is_wrong_is_said) {
    CHECK_THROWS(std::invalid_argument, Lattice(nullptr));
    const Lattice lattice(edited(cube(), 23).recolourer());
    Image image(4, 4, 3), small(4, 3, 3);
    CHECK_THROWS(std::invalid_argument, lattice.apply(image.in(), small.out(), {}));
    CHECK_THROWS(std::invalid_argument,
                 lattice.apply(image.in(), image.out(), {static_cast<double>(kNan)}));
    Image empty(0, 0, 3);
    CHECK_EQUAL(lattice.apply(empty.in(), empty.out(), {}).exact(), 0LL);
}

TEST(picks_and_holds_are_evaluated_at_each_colour) {
    Random random(60);
    Edits edits;
    edits.picks = {picks::pick("a", {0.6, 0.3, 0.25}, {0.3, 0.65, 0.4}),
                   picks::pick("b", {0.6, 0.6, 0.58}, {0.1, 0.9, 0.2}),
                   picks::pick("c", {0.2, 0.7, 0.5}, {0.3, 0.1, 0.6}),
                   picks::hold("h", {0.4, 0.5, 0.4}), picks::hold("i", {0.6, 0.3, 0.5})};
    edits.picks[2].from = 2;
    edits.picks[2].fade = 4;
    const FramePicks found_picks = picks_at(edits, 0);
    for (const Edited& palette : {edited(random_convex(random, 9), 3), edited(concave_cube(), 4)}) {
        const auto recolourer = std::make_shared<Recolourer>(palette.mesh.rgb, palette.colours,
                                                             palette.mesh.faces, found_picks);
        for (const bool premultiplied : {false, true}) {
            const Lattice lattice(recolourer);
            Image image = picture(400, 120, 4, 77);
            for (std::size_t i = 0; premultiplied && i < image.data.size(); ++i) {
                if (i % 4 < 3) image.data[i] *= image.data[i / 4 * 4 + 3];
            }
            Image expected(400, 120, 4), found(400, 120, 4);
            RecolourOptions way{1.0, premultiplied, 2};
            const RecolourCounts counts = lattice.apply(image.in(), found.out(), way);
            CHECK(counts.interpolated > 20000);
            way.precision = Precision::kDouble;
            recolourer->apply(image.in(), expected.out(), way);
            if (premultiplied) {  // the bound is that of straight colours
                for (Image* one : {&expected, &found}) {
                    for (std::size_t i = 0; i < one->data.size(); ++i) {
                        if (i % 4 < 3) one->data[i] /= image.data[i / 4 * 4 + 3];
                    }
                }
            }
            CHECK(difference(found, expected) <= Lattice::kTolerance);
            CHECK(lattice.largest_error() <= Lattice::kTolerance);
            Image place = image;
            lattice.apply(place.in(), place.out(), {1.0, premultiplied, 3});
            Image again(400, 120, 4);
            Lattice(recolourer).apply(image.in(), again.out(), {1.0, premultiplied, 1});
            CHECK(same_bits(place.data, again.data));
            for (const InstructionSet set : instruction_sets()) {
                Image other(400, 120, 4);
                RecolourOptions with{1.0, premultiplied, 1};
                with.instructions = set;
                lattice.apply(image.in(), other.out(), with);
                CHECK(same_bits(other.data, again.data));
            }
        }
    }
}

TEST(picks_alone_need_no_lattice) {
    Edits edits;
    edits.picks = {picks::pick("a", {0.5, 0.5, 0.4}, {0.6, 0.3, 0.7})};
    const auto recolourer =
        std::make_shared<Recolourer>(cube().rgb, cube().rgb, cube().faces, picks_at(edits, 0));
    const Lattice lattice(recolourer);
    const Image image = picture(96, 20, 4, 14);
    Image expected(96, 20, 4), found(96, 20, 4);
    CHECK(lattice.moves());
    recolourer->apply(image.in(), expected.out(), {0.5, true});
    CHECK_EQUAL(lattice.apply(image.in(), found.out(), {0.5, true}).interpolated, 0LL);
    CHECK(same_bits(found.data, expected.data) && !same_bits(found.data, image.data));
    CHECK_EQUAL(lattice.size().cells, 0LL);
}
