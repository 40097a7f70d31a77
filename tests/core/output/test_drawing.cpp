// One frame's picture and mattes, where the geometry gives the answer. The node's tests
// (tests/host/test_outputs.cpp) try depths, layouts and parameters.
#include "output/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "check.hpp"
#include "images.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;
using images::Image;
using images::kInf;
using images::kNan;
using images::same_bits;

namespace {

/// In this tetrahedron red, green and blue are the weights of three corners.
Drawing drawing_of(Output output) {
    const Mesh mesh = tetrahedron();
    Drawing drawing;
    drawing.options.output = output;
    std::vector<Vec3> edited = mesh.rgb;
    if (output == Output::kWeight) {
        for (double& c : edited[1]) c += 1;
    } else if (output == Output::kOutside) {
        for (Vec3& v : edited) v = {2 * v[0], 2 * v[1], 2 * v[2]};
    } else {
        edited[1] = {0.6, 0.3, 0.2};
        drawing.original = mesh.rgb;
        drawing.edited = edited;
    }
    const auto map = std::make_shared<const Recolourer>(mesh.rgb, edited, mesh.faces);
    if (drawing.options.is_matte()) {
        drawing.reader = map;
    } else {
        drawing.edit = map;
    }
    return drawing;
}

Image random_image(int width, int height, int channels, double low = 0, double high = 1) {
    Image image(width, height, channels);
    Random random(5);
    for (float& value : image.data) value = static_cast<float>(random.uniform(low, high));
    return image;
}

Image drawn(const Image& in, const Drawing& drawing, bool premultiplied = false, int threads = 1) {
    Image out(in.width, in.height, in.channels);
    draw_picture(in.in(), out.out(), drawing, premultiplied, threads);
    return out;
}

double luma(const Vec3& weights, const float* rgb) {
    return weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2];
}

}  // namespace

TEST(a_matte_is_the_weight_of_a_corner) {
    const Image in = random_image(40, 20, 3, 0, 0.33);
    const Image out = drawn(in, drawing_of(Output::kWeight));
    for (std::size_t i = 0; i < in.data.size(); ++i) {
        CHECK_NEAR(out.data[i], in.data[i - i % 3], 1e-5);
    }
}

TEST(outside_grows_with_the_distance) {
    Drawing drawing = drawing_of(Output::kOutside);
    drawing.options.reach = 0.5;
    Image in(6, 1, 3);
    in.data = {0.2f, 0.2f,  0.2f,  -0.1f, 0.2f, 0.2f, -0.9f, 0.2f, 0.2f,
               kInf, -kInf, 0.25f, kNan,  1,    1,    0.1f,  0.1f, -0.3f};
    const Image out = drawn(in, drawing);
    const double expected[] = {0, 0.2, 1, 1, 0, 0.6};
    for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(out.data[3 * i + c], expected[i], 0.003);
    }
    CHECK_EQUAL(out.data[0], 0.0f);
}

TEST(a_matte_stands_in_the_colours_or_in_alpha) {
    const Image in = random_image(8, 3, 4, 0.1, 0.3);
    for (const bool premultiplied : {false, true}) {
        Drawing drawing = drawing_of(Output::kWeight);
        const Image grey = drawn(in, drawing, premultiplied);
        drawing.options.in_alpha = true;
        const Image alpha = drawn(in, drawing, premultiplied);
        for (std::size_t i = 0; i < in.data.size(); i += 4) {
            const float a = premultiplied ? in.data[i + 3] : 1;
            const float matte = grey.data[i] / a;
            CHECK_EQUAL(grey.data[i + 3], in.data[i + 3]);
            CHECK_NEAR(alpha.data[i + 3], matte * in.data[i + 3], 1e-6);
            for (std::size_t c = 0; c < 3; ++c) {
                CHECK_EQUAL(grey.data[i + c], grey.data[i]);
                const float own = in.data[i + c];
                CHECK_NEAR(alpha.data[i + c], premultiplied ? matte * own : own, 1e-6);
            }
        }
    }
}

TEST(kept_lightness_is_the_sources) {
    const Image in = random_image(30, 10, 3);
    Drawing drawing = drawing_of(Output::kRecoloured);
    const Image edit = drawn(in, drawing);
    drawing.options.lightness = {0.2126, 0.7152, 0.0722};
    drawing.options.keep = 1;
    const Image kept = drawn(in, drawing);
    double most = 0;
    for (std::size_t i = 0; i < in.data.size(); i += 3) {
        const double own = luma(drawing.options.lightness, &in.data[i]);
        CHECK_NEAR(luma(drawing.options.lightness, &kept.data[i]), own, 1e-6);
        most = std::max(most, std::abs(luma(drawing.options.lightness, &edit.data[i]) - own));
    }
    CHECK(most > 0.01);
}

TEST(mix_fades_to_the_source) {
    const Image in = random_image(30, 10, 4);
    for (const Output output : {Output::kRecoloured, Output::kWeight}) {
        Drawing drawing = drawing_of(output);
        const Image whole = drawn(in, drawing);
        CHECK(!same_bits(whole.data, in.data));
        drawing.options.mix = 0.25;
        const Image quarter = drawn(in, drawing);
        for (std::size_t i = 0; i < in.data.size(); ++i) {
            CHECK_NEAR(quarter.data[i], in.data[i] + 0.25 * (whole.data[i] - in.data[i]), 1e-6);
        }
        drawing.options.mix = 0;
        CHECK(same_bits(drawn(in, drawing).data, in.data));
    }
    Drawing still = drawing_of(Output::kRecoloured);
    still.options.strength = 0;
    still.options.keep = 1;
    CHECK(same_bits(drawn(in, still).data, in.data));
}

TEST(the_strip_is_at_the_bottom_original_above_edited) {
    const Image in = random_image(8, 32, 3);
    const Drawing drawing = drawing_of(Output::kPalette);
    const Image plain = drawn(in, drawing_of(Output::kRecoloured));
    const Image out = drawn(in, drawing);
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 8; ++x) {
            const auto at = static_cast<std::size_t>(3 * (8 * y + x));
            for (std::size_t c = 0; c < 3; ++c) {
                const auto column = static_cast<std::size_t>(x / 2);
                const Vec3& colour = y < 30 ? drawing.original[column] : drawing.edited[column];
                const float expected = y < 28 ? plain.data[at + c] : static_cast<float>(colour[c]);
                CHECK_EQUAL(out.data[at + c], expected);
            }
        }
    }
}

TEST(threads_and_gaps_between_rows_change_nothing) {
    const Image in = random_image(37, 41, 4, -0.2, 1.3);
    for (const Output output :
         {Output::kRecoloured, Output::kWeight, Output::kPalette, Output::kOutside}) {
        Drawing drawing = drawing_of(output);
        drawing.options.keep = 0.5;
        drawing.options.lightness = {0.3, 0.6, 0.1};
        drawing.options.mix = 0.8;
        const Image one = drawn(in, drawing, true);
        CHECK(same_bits(drawn(in, drawing, true, 3).data, one.data));
        // The left part of a wider picture: rows with gaps.
        const int width = 20;
        Image part(width, in.height, 4), wide(in.width, in.height, 4);
        const ConstImageView cut{in.data.data(), width, in.height, 4, in.row()};
        draw_picture(cut, part.out(), drawing, true, 2);
        draw_picture(cut, {wide.data.data(), width, in.height, 4, wide.row()}, drawing, true, 1);
        for (int y = 0; y < in.height; ++y) {
            const float* row = &part.data[static_cast<std::size_t>(4 * width * y)];
            CHECK(std::equal(row, row + 4 * width,
                             &wide.data[static_cast<std::size_t>(4 * in.width * y)],
                             [](float a, float b) { return a == b; }));
        }
    }
}
