#include "palette4d/colour_bins.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInf = std::numeric_limits<float>::infinity();

ColourBins bins_of(const std::vector<float>& pixels, int channels, double step, std::size_t most) {
    const int width = static_cast<int>(pixels.size()) / channels;
    return bin_colours(pixels.data(), width, 1, channels,
                       static_cast<std::ptrdiff_t>(pixels.size() * sizeof(float)), step, most);
}

double sum(const std::vector<double>& counts) {
    double total = 0;
    for (double n : counts) total += n;
    return total;
}

Vec3 weighted_sum(const ColourBins& bins) {
    Vec3 total{0, 0, 0};
    for (std::size_t i = 0; i < bins.rgb.size(); ++i)
        for (int c = 0; c < 3; ++c) total[c] += bins.counts[i] * bins.rgb[i][c];
    return total;
}

}  // namespace

TEST(a_bin_holds_the_mean_and_the_count_of_its_pixels) {
    // Bins of width 1/2 are centred on 0, 1/2, 1: 0.125 and 0.1875 round to 0, 0.375 to 1/2.
    const ColourBins bins = bins_of({0.125f, 0, 0, 0.375f, 0, 0, 0.1875f, 0, 0}, 3, 0.5, 10);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(bins.counts[0], 2.0);
    CHECK_EQUAL(bins.counts[1], 1.0);
    CHECK_EQUAL(bins.rgb[0][0], 0.15625);
    CHECK_EQUAL(bins.rgb[1][0], 0.375);
    CHECK_EQUAL(bins.step, 0.5);
    CHECK_EQUAL(bins.ignored, std::size_t{0});
}

TEST(the_bins_are_those_of_a_plain_map) {
    shapes::Random random(1);
    std::vector<float> pixels;
    std::map<std::array<long, 3>, std::array<double, 4>> expected;
    const double step = 1.0 / 16;
    for (int i = 0; i < 5000; ++i) {
        const Vec3 colour = random.colour(-0.5, 1.5);
        std::array<long, 3> key{};
        for (int c = 0; c < 3; ++c) {
            pixels.push_back(static_cast<float>(colour[c]));
            key[c] = static_cast<long>(std::floor(pixels.back() / step + 0.5));
        }
        auto& bin = expected[key];
        for (int c = 0; c < 3; ++c) bin[c] += pixels[pixels.size() - 3 + c];
        bin[3] += 1;
    }
    const ColourBins bins = bins_of(pixels, 3, step, 100000);
    CHECK_EQUAL(bins.rgb.size(), expected.size());
    CHECK_EQUAL(bins.step, step);
    for (std::size_t i = 0; i < bins.rgb.size(); ++i) {
        std::array<long, 3> key{};
        for (int c = 0; c < 3; ++c)
            key[c] = static_cast<long>(std::floor(bins.rgb[i][c] / step + 0.5));
        const auto at = expected.find(key);
        CHECK(at != expected.end());
        if (at == expected.end()) continue;
        CHECK_EQUAL(bins.counts[i], at->second[3]);
        for (int c = 0; c < 3; ++c)
            CHECK_NEAR(bins.rgb[i][c], at->second[c] / at->second[3], 1e-12);
    }
}

TEST(widening_keeps_every_pixel_and_doubles_the_width) {
    shapes::Random random(2);
    std::vector<float> pixels;
    Vec3 total{0, 0, 0};
    for (int i = 0; i < 4000; ++i)
        for (int c = 0; c < 3; ++c) {
            pixels.push_back(static_cast<float>(random.uniform()));
            total[c] += pixels.back();
        }
    for (const std::size_t most : {std::size_t{1}, std::size_t{20}, std::size_t{500}}) {
        const double step = 1.0 / 256;
        const ColourBins bins = bins_of(pixels, 3, step, most);
        CHECK(!bins.rgb.empty() && bins.rgb.size() <= most);
        CHECK_EQUAL(sum(bins.counts), 4000.0);
        const double doublings = std::log2(bins.step / step);
        CHECK(doublings >= 1 && doublings == std::floor(doublings));
        const Vec3 found = weighted_sum(bins);
        for (int c = 0; c < 3; ++c) CHECK_NEAR(found[c], total[c], 1e-8);
    }
}

TEST(pixels_that_are_not_finite_or_not_there_are_ignored) {
    const ColourBins rgb =
        bins_of({kNan, 0, 0, 0.5f, 0.5f, 0.5f, 0, kInf, 0, 0, 0, -kInf}, 3, 1, 9);
    CHECK_EQUAL(rgb.ignored, std::size_t{3});
    CHECK_EQUAL(sum(rgb.counts), 1.0);
    // Alpha 0 is no colour; any other alpha, even one that is not a number, is not looked at.
    const ColourBins rgba = bins_of({0.5f, 0, 0, 0, 0.25f, 0, 0, 0.01f, 0, 0, 0, kNan}, 4, 0.1, 9);
    CHECK_EQUAL(rgba.ignored, std::size_t{1});
    CHECK_EQUAL(sum(rgba.counts), 2.0);
    const ColourBins none = bins_of({kNan, kNan, kNan}, 3, 0.1, 9);
    CHECK(none.rgb.empty() && none.counts.empty());
    CHECK_EQUAL(none.ignored, std::size_t{1});
}

TEST(colours_far_outside_the_bins_share_the_outermost_ones) {
    const float far = std::numeric_limits<float>::max();
    const ColourBins bins = bins_of({far, 0, 0, far, 0, 0, -far, 0, 0}, 3, 1.0 / 255, 10);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(bins.counts[0], 2.0);
    CHECK_EQUAL(bins.rgb[0][0], static_cast<double>(far));
    const ColourBins one = bins_of({far, 0, 0, -far, 0, 0}, 3, 1.0 / 255, 1);
    CHECK_EQUAL(one.rgb.size(), std::size_t{1});
    CHECK_EQUAL(one.rgb[0][0], 0.0);
}

TEST(rows_may_be_padded_or_upside_down_and_images_empty) {
    // Two rows of one pixel, three floats of padding between them that must not be read as colour.
    const std::vector<float> padded{0.25f, 0, 0, 99, 99, 99, 0.75f, 0, 0};
    const auto row = static_cast<std::ptrdiff_t>(6 * sizeof(float));
    const ColourBins down = bin_colours(padded.data(), 1, 2, 3, row, 0.25, 10);
    const ColourBins up = bin_colours(padded.data() + 6, 1, 2, 3, -row, 0.25, 10);
    CHECK_EQUAL(down.rgb.size(), std::size_t{2});
    CHECK_EQUAL(up.rgb.size(), std::size_t{2});
    CHECK_EQUAL(down.rgb[0][0], 0.25);
    CHECK_EQUAL(down.rgb[1][0], 0.75);
    CHECK_EQUAL(up.rgb[0][0], 0.75);
    CHECK_EQUAL(up.rgb[1][0], 0.25);
    CHECK(bin_colours(nullptr, 0, 0, 3, 0, 0.25, 10).rgb.empty());
}

TEST(bins_refuse_bad_arguments) {
    const std::vector<float> pixels(12, 0.5f);
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 2, 0.1, 10));
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 3, 0, 10));
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 3, -1, 10));
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 3, kNan, 10));
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 3, kInf, 10));
    CHECK_THROWS(std::invalid_argument, bins_of(pixels, 3, 0.1, 0));
}

TEST(coarsening_weighs_colours_by_their_counts) {
    const ColourBins bins =
        coarsen_colours({{0.125, 0, 1}, {0.25, 0.5, 1}, {2, 2, 2}}, {1, 3, 5}, 4.0 / 3, 10);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(bins.counts[0], 4.0);
    CHECK_NEAR(bins.rgb[0][0], 0.21875, 1e-15);
    CHECK_NEAR(bins.rgb[0][1], 0.375, 1e-15);
    CHECK_NEAR(bins.rgb[0][2], 1, 1e-15);
    CHECK_EQUAL(bins.counts[1], 5.0);
    const ColourBins one = coarsen_colours({{0, 0, 0}, {1, 1, 1}}, {1, 3}, 0.01, 1);
    CHECK_EQUAL(one.rgb.size(), std::size_t{1});
    CHECK_EQUAL(one.counts[0], 4.0);
    CHECK_NEAR(one.rgb[0][0], 0.75, 1e-15);
    CHECK(coarsen_colours({}, {}, 0.1, 1).rgb.empty());
}

TEST(coarsening_refuses_bad_arguments) {
    const std::vector<Vec3> two{{0, 0, 0}, {1, 1, 1}};
    CHECK_THROWS(std::invalid_argument, coarsen_colours(two, {1}, 0.1, 5));
    CHECK_THROWS(std::invalid_argument, coarsen_colours(two, {1, 1}, 0, 5));
    CHECK_THROWS(std::invalid_argument, coarsen_colours(two, {1, 1}, 0.1, 0));
    for (const double bad : {0.0, -1.0, static_cast<double>(kNan), static_cast<double>(kInf)})
        CHECK_THROWS(std::invalid_argument, coarsen_colours(two, {1, bad}, 0.1, 5));
    for (const double bad : {static_cast<double>(kNan), static_cast<double>(-kInf)})
        for (std::size_t c = 0; c < 3; ++c) {
            std::vector<Vec3> colours = two;
            colours[1][c] = bad;
            CHECK_THROWS(std::invalid_argument, coarsen_colours(colours, {1, 1}, 0.1, 5));
        }
}

TEST(coarsening_refuses_sums_that_overflow) {
    const double most = std::numeric_limits<double>::max();
    CHECK_THROWS(std::invalid_argument, coarsen_colours({{most, 0, 0}}, {2}, 1, 1));
    CHECK_THROWS(std::invalid_argument,
                 coarsen_colours({{most, 0, 0}, {-most, 0, 0}}, {1, 1}, 1, 1));
    const ColourBins bins =
        coarsen_colours({{most / 4, 0, 0}, {-most / 4, 0, 0}, {0, 0, 0}}, {1, 1, 1}, 1, 1);
    CHECK_EQUAL(bins.counts.size(), std::size_t{1});
    CHECK_EQUAL(bins.counts[0], 3.0);
    CHECK_EQUAL(bins.rgb[0][0], 0.0);
}

TEST(a_vanishing_width_only_widens) {
    const double least = std::numeric_limits<double>::denorm_min();
    const ColourBins bins = coarsen_colours({{0, 0, 0}, {1, 1, 1}}, {1, 1}, least, 1);
    CHECK_EQUAL(bins.counts.size(), std::size_t{1});
    CHECK_EQUAL(bins.counts[0], 2.0);
    CHECK_EQUAL(bins.rgb[0][0], 0.5);
}

int main() { return check::run_all(); }
