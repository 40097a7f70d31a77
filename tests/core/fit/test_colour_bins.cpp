// Cells, samples and memory. tests/media/test_clip_fills.py compares the bins of every kind of file
// with NumPy's.
#include "fit/colour_bins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

constexpr std::size_t kAll = std::size_t{1} << 40;
const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInf = std::numeric_limits<float>::infinity();

template <class Sample>
Rows<Sample> row_of(const std::vector<Sample>& samples, int channels = 3) {
    return {samples.data(), static_cast<int>(samples.size()) / channels, 1, channels, 0};
}

/// Colours and counts, in a fixed order.
std::map<Vec3, double> colours_of(const ColourBins& bins) {
    std::map<Vec3, double> colours;
    for (std::size_t i = 0; i < bins.rgb.size(); ++i) colours[bins.rgb[i]] += bins.counts[i];
    return colours;
}

double sum(const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0); }

Vec3 weighted_sum(const ColourBins& bins) {
    Vec3 total{0, 0, 0};
    for (std::size_t i = 0; i < bins.rgb.size(); ++i)
        for (int c = 0; c < 3; ++c) total[c] += bins.counts[i] * bins.rgb[i][c];
    return total;
}

bool rising(const std::vector<std::uint64_t>& keys) {
    for (std::size_t i = 1; i < keys.size(); ++i)
        if (keys[i - 1] >= keys[i]) return false;
    return true;
}

}  // namespace

TEST(a_frame_is_forgotten_when_it_is_taken) {
    ColourBinner binner;
    for (int round = 0; round < 3; ++round) {
        binner.add(row_of<std::uint8_t>({1, 2, 3, 1, 2, 3}), false);
        const ColourBins bins = binner.take(kAll);
        CHECK_EQUAL(bins.counts.size(), std::size_t{1});
        CHECK_EQUAL(bins.counts[0], 2.0);
        CHECK_EQUAL(binner.pixels(), 0.0);
        binner.add(row_of<float>({0.1f, 0.2f, 0.3f}), false);
        binner.clear();
    }
    CHECK(binner.take(kAll).rgb.empty());
    CHECK(ColourBinner().take(1).rgb.empty());
}

TEST(a_cell_keeps_the_mean_of_its_pixels) {
    // Cells are centred on multiples of 1/255.
    const float unit = 1.0f / 255;
    ColourBinner binner;
    binner.add(row_of<float>({10.25f * unit, 0, 0, 9.75f * unit, 0, 0, 10.75f * unit, 0, 0}),
               false);
    const ColourBins bins = binner.take(kAll);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(bins.counts[0], 2.0);
    CHECK_NEAR(bins.rgb[0][0], 10 / 255.0, 1e-8);
    CHECK_EQUAL(bins.counts[1], 1.0);
    CHECK_NEAR(bins.rgb[1][0], 10.75 / 255.0, 1e-8);
}

TEST(cells_of_floats_are_those_of_a_plain_map) {
    shapes::Random random(3);
    std::vector<float> samples;
    std::map<std::array<long, 3>, std::array<double, 4>> expected;
    const auto number = [](double x) {
        const double size = std::abs(x) * 255;
        const double n = size < 255.5 ? size : 255 * (1 + std::log(size / 255));
        return std::lround(std::floor((x < 0 ? -n : n) + 0.5));
    };
    for (int i = 0; i < 30000; ++i) {
        const double reach = i % 3 == 0 ? 1 : i % 3 == 1 ? 2 : 3000;
        const Vec3 colour = random.colour(-0.3 * reach, reach);
        std::array<long, 3> key{};
        for (int c = 0; c < 3; ++c) {
            samples.push_back(static_cast<float>(std::round(colour[c] * 20) / 20));
            key[c] = number(samples.back());
        }
        auto& cell = expected[key];
        for (int c = 0; c < 3; ++c) cell[c] += samples[samples.size() - 3 + c];
        cell[3] += 1;
    }
    ColourBinner binner;
    binner.add(row_of(samples), false);
    CHECK_EQUAL(binner.pixels(), 30000.0);
    const ColourBins bins = binner.take(kAll);
    CHECK_EQUAL(bins.rgb.size(), expected.size());
    CHECK(rising(bins.keys));
    for (std::size_t i = 0; i < bins.rgb.size(); ++i) {
        const auto at =
            expected.find({number(bins.rgb[i][0]), number(bins.rgb[i][1]), number(bins.rgb[i][2])});
        CHECK(at != expected.end());
        if (at == expected.end()) continue;
        CHECK_EQUAL(bins.counts[i], at->second[3]);
        for (int c = 0; c < 3; ++c)
            CHECK_NEAR(bins.rgb[i][c], at->second[c] / at->second[3],
                       1e-12 * (1 + std::abs(bins.rgb[i][c])));
    }
}

TEST(what_is_not_finite_or_does_not_show_is_ignored) {
    ColourBinner binner;
    binner.add(row_of<float>({kNan, 0, 0, 0.5f, 0.5f, 0.5f, 0, kInf, 0, 0, 0, -kInf}), false);
    CHECK_EQUAL(binner.pixels(), 1.0);
    CHECK_EQUAL(binner.ignored(), 3.0);
    CHECK_EQUAL(binner.transparent(), 0.0);
    binner.clear();
    binner.add(
        row_of<float>({0.5f, 0, 0, 0, 0.25f, 0, 0, 1 / 255.0f, 0, 0, 0, kNan, 0, 0, 0, 0.003f}, 4),
        false);
    CHECK_EQUAL(binner.pixels(), 1.0);
    CHECK_EQUAL(binner.ignored(), 3.0);
    CHECK_EQUAL(binner.transparent(), 3.0);
    CHECK_NEAR(binner.take(1).rgb[0][0], 0.25, 1e-12);
    binner.add(row_of<std::uint8_t>({9, 9, 9, 0, 7, 8, 9, 1, 7, 8, 9, 255}, 4), false);
    CHECK_EQUAL(binner.transparent(), 1.0);
    const ColourBins bins = binner.take(kAll);
    CHECK_EQUAL(bins.counts.size(), std::size_t{1});
    CHECK_EQUAL(bins.counts[0], 2.0);
    binner.add(row_of<float>({kNan, kNan, kNan}), false);
    CHECK(binner.take(1).rgb.empty());
}

TEST(a_sample_keeps_every_pixel_and_only_colours_of_the_frame) {
    shapes::Random random(4);
    std::vector<std::uint8_t> samples;
    for (int i = 0; i < 90000; ++i) samples.push_back(static_cast<std::uint8_t>(random.below(200)));
    ColourBinner binner;
    binner.add(row_of(samples), false);
    const auto all = colours_of(binner.take(kAll));
    for (const std::size_t most : {std::size_t{1}, std::size_t{500}, std::size_t{8000}}) {
        binner.add(row_of(samples), false);
        const ColourBins bins = binner.take(most);
        CHECK(bins.rgb.size() <= most &&
              static_cast<double>(bins.rgb.size()) > 0.8 * static_cast<double>(most));
        CHECK_EQUAL(sum(bins.counts), 30000.0);
        for (const Vec3& rgb : bins.rgb) CHECK(all.count(rgb) == 1);
        const ColourBins fewer = thin(bins, most / 4 + 1);
        CHECK(fewer.rgb.size() <= most / 4 + 1);
        CHECK_EQUAL(sum(fewer.counts), 30000.0);
        CHECK(rising(fewer.keys));
    }
}

TEST(a_mean_over_a_sample_is_that_of_the_frame) {
    // What the draws are for: unlike the means of cells, they do not shift what is convex.
    shapes::Random random(5);
    std::vector<std::uint8_t> samples;
    double expected = 0;
    const auto outside = [](double r, double g, double b) {
        return std::max(0.0, r + g - 2 * b - 0.7);
    };
    for (int i = 0; i < 100000; ++i) {
        for (int c = 0; c < 3; ++c)
            samples.push_back(static_cast<std::uint8_t>(
                255 * (random.uniform() + random.uniform() + random.uniform()) / 3));
        const std::uint8_t* p = &samples[samples.size() - 3];
        expected += outside(p[0] / 255.0, p[1] / 255.0, p[2] / 255.0);
    }
    ColourBinner binner;
    binner.add(row_of(samples), false);
    const ColourBins bins = binner.take(4096);
    double found = 0;
    for (std::size_t i = 0; i < bins.rgb.size(); ++i)
        found += bins.counts[i] * outside(bins.rgb[i][0], bins.rgb[i][1], bins.rgb[i][2]);
    CHECK(bins.rgb.size() > 3000);
    CHECK_NEAR(found / expected, 1, 0.01);
}

TEST(memory_is_bounded_by_widening_cells) {
    // 1.5 million cells; merged by eights they keep all pixels and their sum.
    shapes::Random random(6);
    const int width = 1000, height = 3000;
    std::vector<float> samples;
    Vec3 total{0, 0, 0};
    for (int i = 0; i < width * height; ++i)
        for (int c = 0; c < 3; ++c) {
            samples.push_back(static_cast<float>(random.uniform(-0.05, i % 9 ? 0.5 : 1.2)));
            total[c] += samples.back();
        }
    ColourBinner binner;
    binner.add(Rows<float>{samples.data(), width, height, 3, 3 * 4 * width}, false);
    const ColourBins bins = binner.take(kAll);
    CHECK(bins.rgb.size() < 700000);
    CHECK(bins.rgb.size() > 50000);
    CHECK(rising(bins.keys));
    CHECK_EQUAL(sum(bins.counts), static_cast<double>(width) * height);
    const Vec3 found = weighted_sum(bins);
    for (int c = 0; c < 3; ++c) CHECK_NEAR(found[c] / total[c], 1, 1e-9);
}

TEST(colours_with_counts) {
    ColourBinner binner;
    binner.add_colours({{0.1, 0, 1}, {0.1001, 0, 1}, {2, 2, 2}}, {1, 3, 5});
    CHECK_EQUAL(binner.pixels(), 9.0);
    const ColourBins bins = binner.take(kAll);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(bins.counts[0], 4.0);
    CHECK_NEAR(bins.rgb[0][0], 0.100075, 1e-12);
    CHECK_EQUAL(bins.counts[1], 5.0);
    binner.add_colours(std::vector<Vec3>{}, {});
    CHECK(binner.take(1).rgb.empty());
    const double most = std::numeric_limits<double>::max();
    for (const double bad : {0.0, -1.0, static_cast<double>(kNan), static_cast<double>(kInf)})
        CHECK_THROWS(std::invalid_argument, binner.add_colours({{0, 0, 0}, {1, 1, 1}}, {1, bad}));
    for (const double bad : {static_cast<double>(kNan), static_cast<double>(-kInf), most})
        CHECK_THROWS(std::invalid_argument, binner.add_colours({{0, bad, 0}}, {1}));
    CHECK_THROWS(std::invalid_argument, binner.add_colours({{0, 0, 0}}, {}));
}

TEST(the_largest_floats_have_a_cell) {
    const float far = std::numeric_limits<float>::max();
    ColourBinner binner;
    binner.add(row_of<float>({far, 0, 0, far, 0, 0, -far, far, 0.5f}), false);
    const ColourBins bins = binner.take(kAll);
    CHECK_EQUAL(bins.rgb.size(), std::size_t{2});
    CHECK_EQUAL(sum(bins.counts), 3.0);
    binner.add(row_of<float>({far, 0, 0, far, 0, 0, -far, far, 0.5f}), false);
    CHECK_EQUAL(binner.take(1).counts[0], 3.0);
}

TEST(a_binner_refuses_what_does_not_fit) {
    ColourBinner binner;
    const std::vector<std::uint8_t> eight(12, 1);
    const std::vector<float> floats(12, 0.5f);
    CHECK_THROWS(std::invalid_argument, binner.add(row_of(eight, 2), false));
    CHECK_THROWS(std::invalid_argument, binner.add(row_of(floats, 6), false));
    binner.add(row_of(eight), false);
    CHECK_THROWS(std::invalid_argument, binner.add(row_of(floats), false));
    const Rows<std::uint8_t> planes[3] = {row_of(eight, 1), row_of(eight, 1), row_of(eight, 1)};
    CHECK_THROWS(std::invalid_argument, binner.add_luma_chroma(planes, {0.3, 0.1, 8, true}));
    binner.clear();
    CHECK_THROWS(std::invalid_argument, binner.add_luma_chroma(planes, {0.3, 0.1, 9, true}));
    CHECK_THROWS(std::invalid_argument, binner.add_luma_chroma(planes, {0.3, 0.8, 8, true}));
    const Rows<std::uint8_t> uneven[3] = {row_of(eight, 1), row_of(eight, 2), row_of(eight, 1)};
    CHECK_THROWS(std::invalid_argument, binner.add_luma_chroma(uneven, {0.3, 0.1, 8, true}));
    CHECK_THROWS(std::invalid_argument,
                 (binner.add_luma_chroma(planes, {0.3, 0.1, 8, true}), binner.take(0)));
}
