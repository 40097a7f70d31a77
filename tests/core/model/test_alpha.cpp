#include "model/alpha.hpp"

#include <cmath>
#include <limits>

#include "check.hpp"

using namespace palette4d;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kTiny = std::numeric_limits<float>::denorm_min();

}  // namespace

TEST(a_colour_is_divided_by_any_alpha_but_none) {
    for (const float alpha : {1.0f, 0.3f, 2.0f, -0.5f, kLeastAlpha / 2, 1e-30f, kTiny}) {
        CHECK(divides(alpha) && divides(static_cast<double>(alpha)));
        CHECK_EQUAL(straight(0.25f * alpha, alpha), 0.25f * alpha / alpha);
        CHECK_EQUAL(straight<double>(0.7f, alpha), static_cast<double>(0.7f) / alpha);
        // The kernels in float and those in double see the same colour.
        CHECK_EQUAL(straight(0.7f, alpha), static_cast<float>(straight<double>(0.7f, alpha)));
    }
}

TEST(without_an_alpha_that_divides_there_is_no_colour) {
    for (const float alpha : {0.0f, -0.0f, kInf, -kInf, kNan}) {
        CHECK(!divides(alpha) && !divides(static_cast<double>(alpha)));
        for (const float channel : {0.0f, 0.7f, -0.7f, kInf, kNan}) {
            CHECK(std::isnan(straight(channel, alpha)));
            CHECK(std::isnan(straight<double>(channel, alpha)));
        }
    }
}
