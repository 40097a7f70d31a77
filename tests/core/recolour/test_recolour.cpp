#include "recolour/recolour.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "check.hpp"
#include "images.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace images;
using namespace shapes;

namespace {

Image noise(int width, int height, int channels, std::uint64_t seed) {
    Image image(width, height, channels);
    Random random(seed);
    for (float& x : image.data) x = static_cast<float>(random.uniform(-0.3, 1.4));
    const float odd[] = {kNan, kInf, -kInf, -0.0f, 0.0f, 1e-42f, 3e38f};
    for (int i = 0; i < 7 && i * 5 < static_cast<int>(image.data.size()); ++i) {
        image.data[static_cast<std::size_t>(i) * 5] = odd[i];
    }
    return image;
}

std::vector<Vec3> moved_cube() {
    std::vector<Vec3> edited = cube().rgb;
    edited[7] = {1.2, 0.7, 0.9};
    edited[1] = {0.8, 0.1, -0.1};
    return edited;
}

Recolourer cube_recolourer() { return {cube().rgb, moved_cube(), cube().faces}; }

}  // namespace

TEST(without_an_edit_every_bit_passes) {
    const Recolourer same(cube().rgb, cube().rgb, cube().faces);
    CHECK(!same.moves());
    for (const int channels : {3, 4}) {
        const Image image = noise(17, 5, channels, 1);
        Image result(17, 5, channels);
        same.apply(image.in(), result.out(), {1.0, channels == 4, 2});
        CHECK(same_bits(result.data, image.data));
        CHECK(cube_recolourer().moves());
        Image off(17, 5, channels);
        cube_recolourer().apply(image.in(), off.out(), {0.0, false, 1});
        CHECK(same_bits(off.data, image.data));
    }
}

TEST(the_image_loop_is_the_one_colour_function) {
    const Recolourer recolourer = cube_recolourer();
    const Image image = noise(31, 9, 3, 3);
    Image result(31, 9, 3);
    recolourer.apply(image.in(), result.out(), {0.7, false, 1, Precision::kDouble});
    int changed = 0;
    for (std::size_t i = 0; i < image.data.size(); i += 3) {
        const Vec3 p{image.data[i], image.data[i + 1], image.data[i + 2]};
        const Vec3 q = recolourer.displaced(p, 0.7);
        for (std::size_t c = 0; c < 3; ++c) {
            const float expected = static_cast<float>(q[c]);
            CHECK(std::memcmp(&result.data[i + c], &expected, 4) == 0 || std::isnan(p[c]));
        }
        changed += std::memcmp(&result.data[i], &image.data[i], 12) != 0;
    }
    CHECK(changed > 150);
}

TEST(a_colour_with_a_nan_or_infinity_passes) {
    const Recolourer recolourer = cube_recolourer();
    Image image(4, 1, 3);
    image.data = {kNan, 0.5f, 0.5f, 0.5f, kInf, 0.5f, 0.5f, 0.5f, -kInf, 0.5f, 0.5f, 0.5f};
    const std::uint32_t payload = 0x7fc12345;
    std::memcpy(&image.data[0], &payload, 4);
    Image result(4, 1, 3);
    recolourer.apply(image.in(), result.out(), {});
    CHECK(std::memcmp(result.data.data(), image.data.data(), 9 * sizeof(float)) == 0);
    CHECK(result.data[9] != image.data[9]);
    const Vec3 same = recolourer.displaced({1, std::numeric_limits<double>::infinity(), 2}, 1);
    CHECK_EQUAL(same[0], 1.0);
    CHECK_EQUAL(same[2], 2.0);
}

TEST(what_does_not_move_keeps_its_bits) {
    // Only the red of one vertex moves: green and blue never change, nor does red where it has no
    // weight, and a negative zero stays one.
    std::vector<Vec3> edited = tetrahedron().rgb;
    edited[1][0] = 0.5;
    const Recolourer recolourer(tetrahedron().rgb, edited, tetrahedron().faces);
    Image image(3, 1, 3);
    image.data = {-0.0f, -0.0f, -0.0f, -0.0f, 0.25f, 0.5f, 0.5f, -0.0f, 1e-42f};
    Image result(3, 1, 3);
    recolourer.apply(image.in(), result.out(), {});
    CHECK(std::memcmp(result.data.data(), image.data.data(), 6 * sizeof(float)) == 0);
    CHECK(std::memcmp(&result.data[7], &image.data[7], 2 * sizeof(float)) == 0);
    CHECK_NEAR(result.data[6], 0.25, 1e-7);
}

TEST(rows_may_be_padded_upside_down_or_the_same_memory) {
    const Recolourer recolourer = cube_recolourer();
    for (const int channels : {3, 4}) {
        const Image image = noise(13, 7, channels, 5);
        Image expected(13, 7, channels);
        recolourer.apply(image.in(), expected.out(), {1, false, 1});

        const std::size_t row = static_cast<std::size_t>(13 * channels), padded = row + 3;
        std::vector<float> in(padded * 7, 7.0f), out(padded * 7, 9.0f);
        for (std::size_t y = 0; y < 7; ++y) {
            std::copy_n(&image.data[y * row], row, &in[(6 - y) * padded]);
        }
        const auto stride = -static_cast<std::ptrdiff_t>(padded * sizeof(float));
        recolourer.apply({&in[6 * padded], 13, 7, channels, stride},
                         {&out[6 * padded], 13, 7, channels, stride}, {1, false, 3});
        for (std::size_t y = 0; y < 7; ++y) {
            const float* found = &out[(6 - y) * padded];
            CHECK(std::memcmp(found, &expected.data[y * row], row * sizeof(float)) == 0);
            for (std::size_t x = row; x < padded; ++x) CHECK_EQUAL(found[x], 9.0f);
        }
        Image place = image;
        recolourer.apply(place.in(), place.out(), {1, false, 2});
        CHECK(same_bits(place.data, expected.data));
    }
}

TEST(the_number_of_threads_does_not_show) {
    const Recolourer recolourer = cube_recolourer();
    const Image image = noise(64, 37, 4, 6);
    Image expected(64, 37, 4);
    recolourer.apply(image.in(), expected.out(), {0.8, true, 1});
    for (const int threads : {0, 2, 3, 8, 100}) {
        Image result(64, 37, 4);
        recolourer.apply(image.in(), result.out(), {0.8, true, threads});
        CHECK(same_bits(result.data, expected.data));
    }
}
