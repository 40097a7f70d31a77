#include "convert/colour_conversion.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "check.hpp"
#include "model/sidecar_error.hpp"
#include "recolour/recolour.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Vec3 three(double x) { return {x, x, x}; }

MatrixStep mixing() {
    return {{0.7, 0.2, 0.1, 0.05, 0.9, 0.05, -0.02, 0.12, 0.9}, {0.01, 0, -0.02}};
}
/// ACEScct (S-2016-001).
LogStep acescct() {
    return {2,          three(1 / 17.52), three(9.72 / 17.52),     three(1),
            three(0.0), three(0.0078125), three(10.5402377416545), false};
}
GammaStep srgb() { return {three(2.4), three(0.055), false, false}; }
GammaStep mirrored() { return {{2.2, 2.4, 1.8}, three(0), true, true}; }
CurveStep sampled() { return {{{{-1, 0, 0.5, 2}, {-2, 0.1, 0.3, 5}}}, false}; }

ColourConversion chain() { return ColourConversion({mixing(), acescct()}); }
const ColourConversion kChain = chain();

template <class Step>
void there_and_back(Step step) {
    for (const bool inverse : {false, true}) {
        if constexpr (!std::is_same_v<Step, MatrixStep>) step.inverse = inverse;
        const ColourConversion conversion({step});
        for (double x = -60; x < 60; x = x < -1e-5 ? x / 1.3 : x < 1e-5 ? x + 1e-6 : x * 1.3) {
            const Vec3 from{x, 0.3 * x, 0.18};
            const Vec3 to = conversion.to_palette(from), back = conversion.to_clip(to);
            for (std::size_t c = 0; c < 3; ++c) {
                CHECK(std::isfinite(to[c]));
                // An exponential may end: what it cannot hold stays finite.
                if (std::abs(to[c]) < 1e6) {
                    CHECK_NEAR(back[c], from[c], 1e-9 * std::max(1.0, std::abs(from[c])));
                }
            }
        }
    }
}

struct Image {
    int width, channels;
    std::vector<float> data;
    ConstImageView in() const { return {data.data(), width, 1, channels, bytes()}; }
    ImageView out() { return {data.data(), width, 1, channels, bytes()}; }
    std::ptrdiff_t bytes() const {
        return static_cast<std::ptrdiff_t>(data.size() * sizeof(float));
    }
};

Recolourer moved_cube() {
    std::vector<Vec3> edited = cube().rgb;
    edited[7] = {1.2, 0.7, 0.9};
    return {cube().rgb, edited, cube().faces};
}

SidecarError problem_of(ConversionStep step) {
    try {
        const ColourConversion made({mixing(), std::move(step)});
    } catch (const SidecarError& problem) {
        return problem;
    }
    CHECK(false);
    return {"", "", "", ""};
}

}  // namespace

TEST(every_step_goes_there_and_back) {
    there_and_back(mixing());
    there_and_back(acescct());
    there_and_back(srgb());
    there_and_back(mirrored());
    there_and_back(sampled());
}

TEST(steps_are_what_their_standards_say) {
    const ColourConversion log({acescct()});
    CHECK_NEAR(log.to_palette(three(0.18))[0], 0.4135884, 1e-7);
    CHECK_NEAR(log.to_palette(three(0))[0], 0.0729055341958355, 1e-9);
    CHECK_NEAR(log.to_palette(three(65504))[0], 1.4679964, 1e-7);
    const ColourConversion display({srgb()});
    CHECK_NEAR(display.to_palette(three(0.5))[1], 0.21404114, 1e-8);
    CHECK_NEAR(display.to_palette(three(-0.02))[1], -0.02 / 12.9232102, 1e-9);
    const ColourConversion mirror({mirrored()});
    CHECK_NEAR(mirror.to_palette(three(-0.25))[0], -std::pow(0.25, 1 / 2.2), 1e-12);
}

TEST(curves_rise_and_do_not_jump) {
    const ColourConversion all({acescct(), sampled(), srgb()});
    double before = -1e300;
    for (double x = -20; x < 60; x += 1e-3) {
        const double now = all.to_palette(three(x))[1];
        CHECK(now > before);
        before = now;
    }
    // Where a straight line meets a curve there is one value.
    for (const double turn : {0.0078125, 0.0}) {
        const double below = all.to_palette(three(turn - 1e-9))[0];
        CHECK_NEAR(all.to_palette(three(turn + 1e-9))[0], below, 1e-6);
    }
}

TEST(whatever_an_edit_asks_for_stays_a_number) {
    for (const double x : {1e6, -1e6, 1e30}) {
        for (const double back : chain().to_clip(three(x))) CHECK(std::isfinite(back));
    }
}

/// apply() between kChain and the way back.
RecolourCounts converted(const Recolourer& map, const ConstImageView& in, const ImageView& out,
                         RecolourOptions options) {
    options.conversion = &kChain;
    return map.apply(in, out, options);
}

TEST(without_an_edit_every_bit_passes) {
    Image image{4, 3, {50, -0.3f, 1e-42f, -0.0f, kNan, 1, kInf, 0, 0, 0.18f, 0.2f, 65504}};
    const Image before = image;
    const Recolourer same(cube().rgb, cube().rgb, cube().faces);
    converted(same, image.in(), image.out(), {});
    CHECK(std::memcmp(image.data.data(), before.data.data(), 48) == 0);
}

TEST(alpha_is_divided_by_and_odd_pixels_pass) {
    const Recolourer recolourer = moved_cube();
    RecolourOptions options;
    options.premultiplied = true;
    Image straight{1, 4, {0.4f, 0.3f, 0.2f, 1}}, half{1, 4, {0.2f, 0.15f, 0.1f, 0.5f}};
    converted(recolourer, straight.in(), straight.out(), options);
    converted(recolourer, half.in(), half.out(), options);
    CHECK(straight.data[0] != 0.4f);
    for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(half.data[c], straight.data[c] / 2, 1e-7);
    CHECK_EQUAL(half.data[3], 0.5f);

    Image odd{4, 4, {0.1f, 0.2f, 0.3f, 0, kNan, 0, 0, 1, 0, kInf, 0, 1, 0.1f, 0.2f, 0.3f, kInf}};
    const Image before = odd;
    converted(recolourer, odd.in(), odd.out(), options);
    CHECK(std::memcmp(odd.data.data(), before.data.data(), 64) == 0);
}

TEST(what_does_not_move_keeps_its_bits_between_conversions) {
    // Nearest to a face whose colours stay where they are, in numbers that are not exact.
    std::vector<Vec3> edited = cube().rgb;
    std::vector<float> colours;
    for (std::size_t i = 0; i < edited.size(); ++i) {
        if (edited[i][0] == 1) edited[i][2] *= 0.7;
    }
    Random random(7);
    for (int i = 0; i < 3000; ++i) {
        Vec3 colour = random.colour(0.1, 0.9);
        if (i % 2) colour[0] = -0.04;
        for (const double x : chain().to_clip(colour)) colours.push_back(static_cast<float>(x));
        colours.push_back(i % 2 ? 0.7f : 1.0f);
    }
    const Recolourer recolourer(cube().rgb, edited, cube().faces);
    Image image{3000, 4, colours};
    converted(recolourer, image.in(), image.out(), {});
    int moved = 0;
    for (std::size_t i = 0; i < 3000; ++i) {
        const bool same = std::memcmp(&image.data[4 * i], &colours[4 * i], 16) == 0;
        if (i % 2) CHECK(same);
        moved += !same;
    }
    CHECK(moved > 1400);
}

TEST(what_has_no_way_back_is_refused) {
    MatrixStep flat = mixing();
    for (std::size_t i = 0; i < 3; ++i) flat.matrix[6 + i] = flat.matrix[i] + flat.matrix[3 + i];
    CHECK_EQUAL(problem_of(flat).pointer(), std::string("/1/matrix"));
    LogStep log = acescct();
    log.start = three(-1);
    CHECK_EQUAL(problem_of(log).pointer(), std::string("/1/start/0"));
    log = acescct();
    log.below[2] = 0;
    CHECK_EQUAL(problem_of(log).pointer(), std::string("/1/below/2"));
    GammaStep gamma = srgb();
    gamma.gamma = three(1);
    CHECK_EQUAL(problem_of(gamma).pointer(), std::string("/1/gamma/0"));
    CurveStep curve = sampled();
    curve.curves[0].y[2] = 0.1;
    CHECK_EQUAL(problem_of(curve).pointer(), std::string("/1/curves/0/y/2"));
    curve.curves.push_back(sampled().curves[0]);
    CHECK_EQUAL(problem_of(curve).pointer(), std::string("/1/curves"));
    curve.curves = {{{1}, {1}}};
    CHECK_EQUAL(problem_of(curve).pointer(), std::string("/1/curves/0/x"));
}
