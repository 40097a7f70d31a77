// By hand, bits and refusals; tests/analysis/test_losses.py compares distances to any palette.
#include "fit/palette_loss.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "model/vec3.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

FrameLoss loss_of(const std::vector<Vec3>& colours, const std::vector<Vec3>& palette) {
    const ColourTree tree(colours, std::vector<double>(colours.size(), 1));
    return palette_loss(tree, palette, {}, {50, 1, 0}, nullptr);
}

}  // namespace

TEST(distances_to_a_cube_by_hand) {
    const std::vector<Vec3> cube = shapes::cube().rgb;
    CHECK_EQUAL(loss_of({{0.5, 0.5, 0.5}}, cube).R, 0.0);
    CHECK_EQUAL(loss_of({{1, 0.5, 0.5}}, cube).R, 0.0);
    CHECK_NEAR(loss_of({{1.25, 0.5, 0.5}}, cube).R, 0.25, 1e-15);
    CHECK_NEAR(loss_of({{1.25, -0.25, 0.5}}, cube).R, 0.25 * std::sqrt(2.0), 1e-15);
    CHECK_NEAR(loss_of({{2, 2, 2}}, cube).R, std::sqrt(3.0), 1e-15);
}

TEST(reconstruction_is_the_mean_over_all_pixels) {
    const ColourTree tree({{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}, {0.5, 0.5, -0.25}}, {5, 1, 2});
    const FrameLoss loss = palette_loss(tree, shapes::cube().rgb, {}, {50, 8, 0}, nullptr);
    CHECK_NEAR(loss.R, (0.5 + 2 * 0.25) / 8, 1e-15);
    CHECK_NEAR(loss.outside, 3.0 / 8, 1e-15);
    CHECK_NEAR(loss.max_distance, 0.5, 1e-15);
}

TEST(what_is_outside_by_rounding_only_is_not_outside) {
    const FrameLoss loss =
        loss_of({{1 + 1e-5, 0.5, 0.5}, {1 + 1e-7, 0.5, 0.5}, {0.5, 0.5, 0.5}}, shapes::cube().rgb);
    CHECK_EQUAL(loss.outside, 1.0 / 3);
    CHECK_NEAR(loss.max_distance, 1e-5, 1e-12);
}

TEST(flat_lines_and_points_have_distances_too) {
    CHECK_NEAR(loss_of({{0.2, 0.6, 0.5}}, {{0.2, 0.2, 0.2}}).R, 0.5, 1e-15);
    CHECK_NEAR(loss_of({{0.2, 0.6, 0.5}}, {{0.2, 0.2, 0.2}, {0.2, 0.2, 0.2}}).R, 0.5, 1e-15);
    CHECK_NEAR(loss_of({{1, 0, 0}}, {{0, 0, 0}, {1, 1, 1}}).R, std::sqrt(2.0 / 3), 1e-15);
    CHECK_NEAR(loss_of({{2, 2, 2}}, {{0, 0, 0}, {0.5, 0.5, 0.5}, {1, 1, 1}}).R, std::sqrt(3.0),
               1e-15);
    const std::vector<Vec3> square = shapes::flat_square().rgb;
    CHECK_NEAR(loss_of({{0.5, 0.5, 0.8}}, square).R, 0.3, 1e-15);
    CHECK_NEAR(loss_of({{1.3, 0.5, 0.9}}, square).R, 0.5, 1e-15);
    CHECK_EQUAL(loss_of({{0.25, 0.5, 0.5}}, square).R, 0.0);
}

TEST(every_instruction_set_gives_the_same_bits) {
    shapes::Random random(5);
    for (int i = 0; i < 40; ++i) {
        std::vector<Vec3> palette = shapes::random_convex(random, 4 + random.below(12)).rgb;
        if (i % 4 == 1) palette = shapes::cube().rgb;  // overlapping facets
        if (i % 4 == 2)
            for (Vec3& v : palette) v[2] = 0.5;
        if (i % 4 == 3) palette.push_back(palette[0]);  // edges without length
        std::vector<Vec3> colours;
        std::vector<double> counts;
        for (int n = 1 + random.below(1500); n > 0; --n) {
            colours.push_back(random.colour(-0.2, 1.2));
            counts.push_back(1 + random.below(7));
        }
        const ColourTree tree(colours, counts);
        const auto result = [&](InstructionSet set, std::vector<Vec3>& gradient) {
            return palette_loss(tree, palette, {}, {50, 50, 0, 0.1, 0.1}, &gradient, set);
        };
        std::vector<Vec3> expected;
        const FrameLoss baseline = result(InstructionSet::kBaseline, expected);
        for (const InstructionSet set : instruction_sets()) {
            std::vector<Vec3> gradient;
            const FrameLoss loss = result(set, gradient);
            CHECK_EQUAL(loss.R, baseline.R);
            CHECK_EQUAL(loss.E, baseline.E);
            CHECK_EQUAL(loss.outside, baseline.outside);
            CHECK_EQUAL(loss.max_distance, baseline.max_distance);
            CHECK(gradient == expected);
        }
    }
}

TEST(what_is_far_outside_weighs_more) {
    // A quarter of the pixels 0.2 outside, where q is 8, an eighth 0.1, where it is 1.
    const ColourTree tree({{0.5, 0.5, 0.5}, {1.2, 0.5, 0.5}, {0.5, -0.1, 0.5}}, {5, 2, 1});
    const std::vector<Vec3> cube = shapes::cube().rgb;
    const FrameLoss loss = palette_loss(tree, cube, {}, {50, 1, 0, 0, 0.1}, nullptr);
    CHECK_NEAR(loss.E, 0.25 * 0.2 * 4 + 0.125 * 0.1 * 8 / 9, 1e-12);
    CHECK_NEAR(loss.R, 0.25 * 0.2 + 0.125 * 0.1, 1e-12);
    CHECK_EQUAL(palette_loss(tree, cube, {}, {50, 1}, nullptr).E, 0.0);
}

TEST(compactness_by_hand) {
    const ColourTree tree({{0, 0, 0}, {1, 0, 0}}, {1, 3});
    // v_N is (0, 0, 0) for the first colour, half of each for the second.
    const FrameLoss loss =
        palette_loss(tree, {{-0.5, 0, 0}, {0.5, 0.25, 0}}, {}, {50, 1, 0}, nullptr);
    const double second = std::hypot(0.5 - 0.75, 0.25);
    CHECK_NEAR(loss.C, (0.5 + second) / 2, 1e-15);
}

TEST(only_dents_are_concave) {
    const ColourTree tree({{0.5, 0.5, 0.2}}, {1});
    for (const shapes::Mesh& mesh : {shapes::tetrahedron(), shapes::cube()})
        CHECK_EQUAL(palette_loss(tree, mesh.rgb, mesh.faces, {50, 1, 1}, nullptr).D, 0.0);
    const shapes::Mesh dented = shapes::concave_cube();
    // Each of the dent's four edges folds in by the tetrahedron over three corners of the top, of
    // area 1/2, with its point 0.7 below: six times its volume is 0.7. The cube's edges stay
    // convex.
    CHECK_NEAR(palette_loss(tree, dented.rgb, dented.faces, {50, 1, 0}, nullptr).D, 4 * 0.7, 1e-12);
}

TEST(the_gradient_is_that_of_differences) {
    shapes::Random random(2);
    std::vector<Vec3> colours;
    // Four times as far apart as the palette, so that its colours count as near each other.
    for (int i = 0; i < 200; ++i) {
        colours.push_back(random.colour());
        for (double& x : colours.back()) x = 0.5 + 4 * (x - 0.5);
    }
    // k covers all pixels, so that v_N does not jump.
    const ColourTree tree(colours, std::vector<double>(colours.size(), 1));
    const LossWeights weights{50, 200, 0.7, 0.9, 0.5};
    shapes::Mesh mesh = shapes::concave_cube();
    for (Vec3& v : mesh.rgb)
        for (double& x : v) x = 0.5 + 0.6 * (x - 0.5) + random.uniform(-0.03, 0.03);
    std::vector<Vec3> gradient;
    const FrameLoss with = palette_loss(tree, mesh.rgb, mesh.faces, weights, &gradient);
    const FrameLoss without = palette_loss(tree, mesh.rgb, mesh.faces, weights, nullptr);
    CHECK_EQUAL(with.R, without.R);
    CHECK_EQUAL(with.C, without.C);
    CHECK_EQUAL(with.D, without.D);
    CHECK_EQUAL(with.S, without.S);
    CHECK_EQUAL(with.E, without.E);
    CHECK(with.R > 0 && with.D > 0 && with.S > 0 && with.E > 0);
    const auto value = [&](const std::vector<Vec3>& palette) {
        const FrameLoss loss = palette_loss(tree, palette, mesh.faces, weights, nullptr);
        return weights.lambda * (loss.R + loss.E) + loss.C + weights.convexity * loss.D + loss.S;
    };
    CHECK_EQUAL(gradient.size(), mesh.rgb.size());
    for (std::size_t i = 0; i < gradient.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            std::vector<Vec3> up = mesh.rgb, down = mesh.rgb;
            up[i][c] += 1e-6;
            down[i][c] -= 1e-6;
            CHECK_NEAR(gradient[i][c], (value(up) - value(down)) / 2e-6, 1e-4);
        }
}

TEST(near_colours_repel_by_hand) {
    const ColourTree tree({{0, 0.5, 0.5}, {1, 0.5, 0.5}}, {1, 1});
    const std::vector<Vec3> palette = {{0, 0, 0}, {0.1, 0, 0}, {0.5, 0, 0}, {0.5, 0, 0}};
    std::vector<Vec3> gradient;
    const LossWeights off{0, 1}, on{0, 1, 0, 0.2};
    CHECK_EQUAL(palette_loss(tree, palette, {}, off, nullptr).S, 0.0);
    std::vector<Vec3> plain;
    palette_loss(tree, palette, {}, off, &plain);
    const FrameLoss loss = palette_loss(tree, palette, {}, on, &gradient);
    // One pair 0.1 apart, one pair that is one colour: (0.2 - d)^2 / 0.4 each.
    CHECK_NEAR(loss.S, 0.01 / 0.4 + 0.04 / 0.4, 1e-15);
    CHECK_NEAR(gradient[0][0] - plain[0][0], 0.5, 1e-12);
    CHECK_NEAR(gradient[1][0] - plain[1][0], -0.5, 1e-12);
    CHECK_EQUAL(gradient[2][0], plain[2][0]);  // no way to part is better than another
    CHECK_EQUAL(gradient[3][0], plain[3][0]);
}

TEST(colours_of_a_nearly_plain_frame_may_be_near_each_other) {
    const std::vector<Vec3> palette = {{0.1, 0, 0}, {0.15, 0, 0}, {0.5, 0, 0}};
    const LossWeights weights{0, 1, 0, 0.2};
    const auto repulsion = [&](double extent) {
        const ColourTree tree({{0.1, 0, 0}, {0.1, extent, 0}}, {1, 1});
        return palette_loss(tree, palette, {}, weights, nullptr).S;
    };
    CHECK_NEAR(repulsion(1), 0.15 * 0.15 / 0.4, 1e-15);
    CHECK_NEAR(repulsion(0.4), 0.05 * 0.05 / 0.2, 1e-15);  // a quarter of the extent: 0.1
    CHECK_EQUAL(repulsion(0.16), 0.0);
    CHECK_EQUAL(repulsion(0), 0.0);
}

TEST(colours_that_are_not_finite_are_refused) {
    const ColourTree tree({{0.5, 0.5, 0.5}}, {1});
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        std::vector<Vec3> palette = shapes::cube().rgb;
        palette[3][1] = bad;
        CHECK_THROWS(std::invalid_argument,
                     palette_loss(tree, palette, {}, LossWeights{}, nullptr));
    }
    CHECK_THROWS(std::invalid_argument,
                 palette_loss(tree, shapes::cube().rgb, {}, {50, 0, 0}, nullptr));
}

TEST(no_palette_has_no_losses) {
    const ColourTree tree({{0.5, 0.5, 0.5}}, {1});
    std::vector<Vec3> gradient{{1, 2, 3}};
    const FrameLoss loss = palette_loss(tree, {}, {}, LossWeights{}, &gradient);
    CHECK_EQUAL(loss.R, 0.0);
    CHECK_EQUAL(loss.C, 0.0);
    CHECK_EQUAL(loss.D, 0.0);
    CHECK(gradient.empty());
}
