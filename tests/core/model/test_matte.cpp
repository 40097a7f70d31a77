#include "model/matte.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "check.hpp"
#include "colours.hpp"
#include "shapes.hpp"

using namespace colours;
using namespace palette4d;
using shapes::Random;

namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();

}  // namespace

TEST(shades_of_a_colour_lie_on_a_line) {
    const Vec3 colour{0.8, 0.4, 0.2};
    const auto direction = [](const Vec3& point) { return std::atan2(point[1], point[0]); };
    const Vec3 own = pick_point(colour);
    for (const double shade : {0.9, 0.5, 0.1, 0.01}) {
        const Vec3 point = pick_point(shade * colour);
        CHECK_NEAR(direction(point), direction(own), 1e-12);
        CHECK_NEAR(point[2], shade * 0.8, 1e-12);
        CHECK(std::hypot(point[0], point[1]) < std::hypot(own[0], own[1]));
    }
    const Vec3 grey = pick_point({0.3, 0.3, 0.3});
    CHECK(std::hypot(grey[0], grey[1]) < 1e-15);
    // Pure colours are within the grid.
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 point =
            pick_point({double(corner & 1), double(corner >> 1 & 1), double(corner >> 2)});
        CHECK(std::max(std::abs(point[0]), std::abs(point[1])) < MatteGrid::kMost);
    }
}

TEST(a_display_curve_is_linear_between_its_values_and_ends_level) {
    const DisplayCurve curve{-1, 3, {0, 0.5, 0.25}};
    CHECK_NEAR(curve(-1), 0, 0);
    CHECK_NEAR(curve(0), 0.25, 1e-15);
    CHECK_NEAR(curve(1), 0.5, 1e-15);
    CHECK_NEAR(curve(2), 0.375, 1e-15);
    CHECK_NEAR(curve(3), 0.25, 1e-15);
    for (const double below : {-1.001, -1e300, -kEndless, kNoNumber})
        CHECK_EQUAL(curve(below), 0.0);
    for (const double above : {3.001, 1e300, kEndless}) CHECK_EQUAL(curve(above), 0.25);
    CHECK(same_bits(displayed({1, 2, 3}, nullptr), {1, 2, 3}));
    CHECK(apart(displayed({1, 2, 3}, &curve), {0.5, 0.375, 0.25}) < 1e-15);
}

TEST(a_hold_spares_what_is_nearer_to_the_pick) {
    const Vec3 pick{0.1, 0.2, 0.5}, hold{0.3, 0.2, 0.5};
    CHECK_EQUAL(spared(hold, hold, pick), 0.0);
    CHECK_EQUAL(spared(pick, hold, pick), 1.0);
    CHECK_NEAR(spared({0.2, 0.2, 0.5}, hold, pick), 1, 1e-12);
    const double beside = spared({0.25, 0.2, 0.5}, hold, pick);
    CHECK(beside > 0 && beside < 0.2);
    CHECK(spared(pick, pick, pick) >= 0);  // 0 by 0 is no NaN
}

TEST(an_amount_is_never_0_at_its_own_pick) {
    // Below black and above white too: a change is divided by it.
    Random random(3);
    for (int i = 0; i < 5000; ++i) {
        const double size = i % 2 ? 2 : 0.06;
        const double level = random.uniform(-3, 4);
        const Vec3 noise = random.colour(-size, size);
        const Vec3 colour = noise + Vec3{level, level, level};
        const double own = PickedColour(colour).amount(colour);
        CHECK(own > 0.5 && own < 2);
    }
}

TEST(a_grid_is_read_between_its_nodes) {
    // An affine function is read exactly, and the grid's ends go on level.
    std::vector<float> grid(MatteGrid::kSize);
    for (int u = 0; u < MatteGrid::kSaturations; ++u) {
        for (int v = 0; v < MatteGrid::kSaturations; ++v) {
            for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
                grid[MatteGrid::index(u, v, l)] = static_cast<float>(u + 100 * v + 10000 * l);
            }
        }
    }
    Random random(4);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 at{random.uniform(0, 95), random.uniform(0, 95), random.uniform(0, 15)};
        const Vec3 point{at[0] / MatteGrid::kPerSaturation - MatteGrid::kMost,
                         at[1] / MatteGrid::kPerSaturation - MatteGrid::kMost,
                         at[2] / MatteGrid::kPerLightness};
        CHECK_NEAR(MatteGrid::at(grid.data(), point), at[0] + 100 * at[1] + 10000 * at[2], 1e-8);
    }
    CHECK_NEAR(MatteGrid::at(grid.data(), {-9, kEndless, 0.5}), 9500 + 75000, 1e-8);
    CHECK_NEAR(MatteGrid::at(grid.data(), {kEndless, -kEndless, 7}), 95 + 150000, 1e-8);
    for (const double odd : {kNoNumber, kEndless, -kEndless, 1e300, -1e300}) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Vec3 point{0.1, 0.2, 0.3};
            point[axis] = odd;
            const MatteGrid::Place p = MatteGrid::place(point);
            CHECK(p.u >= 0 && p.u < MatteGrid::kSaturations - 1);
            CHECK(p.v >= 0 && p.v < MatteGrid::kSaturations - 1);
            CHECK(p.l >= 0 && p.l < MatteGrid::kLightnesses - 1);
            for (const double part : {p.part_u, p.part_v, p.part_l}) CHECK(part >= 0 && part <= 1);
        }
    }
}

TEST(memberships_become_log_odds) {
    const Matte matte = matte_of({0, 0.5f, 1, -1, 2, std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::infinity(), 0.9f});
    const std::vector<std::uint8_t> ends = {0, 63, 126, 0, 126, 0, 126};
    for (std::size_t i = 0; i < ends.size(); ++i) CHECK_EQUAL(int(matte.odds[i]), int(ends[i]));
    CHECK_NEAR(Matte::log_odds(matte.odds[7]), std::log(9), Matte::kOdds / Matte::kMiddle);
    CHECK_EQUAL(Matte::log_odds(0), -Matte::kOdds);
    CHECK_EQUAL(Matte::log_odds(126), Matte::kOdds);
}
