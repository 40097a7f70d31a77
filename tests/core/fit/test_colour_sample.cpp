#include "fit/colour_sample.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

std::uint64_t interleaved(unsigned a, unsigned b, unsigned c) {
    std::uint64_t key = 0;
    for (int bit = 0; bit < 16; ++bit)
        key |=
            (std::uint64_t{a >> bit & 1} << 2 | std::uint64_t{b >> bit & 1} << 1 | (c >> bit & 1))
            << 3 * bit;
    return key;
}

Vec3 colour_of(std::uint64_t key) {
    Vec3 colour{0, 0, 0};
    for (int bit = 0; bit < 16; ++bit)
        for (int c = 0; c < 3; ++c)
            colour[c] += static_cast<double>(key >> (3 * bit + 2 - c) & 1) * (1 << bit) / 255;
    return colour;
}

/// Cells of random colours in a ball around grey, with counts from 1 to `counts`.
ColourCells ball(int n, int counts, std::uint64_t seed) {
    shapes::Random random(seed);
    std::vector<std::uint64_t> keys;
    while (keys.size() < static_cast<std::size_t>(n)) {
        const Vec3 p = random.colour(-1, 1);
        if (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 1) continue;
        unsigned cell[3];
        for (int c = 0; c < 3; ++c) cell[c] = static_cast<unsigned>(128 + 120 * p[c]);
        keys.push_back(interleaved(cell[0], cell[1], cell[2]));
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    ColourCells cells{keys, {}};
    for (std::size_t i = 0; i < keys.size(); ++i)
        cells.counts.push_back(std::floor(1 + counts * random.uniform()));
    return cells;
}

std::vector<Vec3> places_of(const ColourCells& cells) {
    std::vector<Vec3> places;
    for (const std::size_t first : colour_blocks(cells))
        if (first < cells.keys.size()) places.push_back(colour_of(cells.keys[first] | 0b111000000));
    return places;
}

double total(const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0); }

}  // namespace

TEST(few_cells_are_all_kept) {
    const ColourCells cells = ball(500, 9, 1);
    const ColourSample sample = sample_colours(cells, places_of(cells), cells.keys.size());
    CHECK_EQUAL(sample.chosen.size(), cells.keys.size());
    for (std::size_t i = 0; i < sample.chosen.size(); ++i) CHECK_EQUAL(sample.chosen[i], i);
    CHECK(sample.counts == cells.counts);
    CHECK(sample_colours({}, {}, 1).chosen.empty());
}

TEST(a_sample_is_bounded_nearly_fills_its_bound_and_keeps_all_pixels) {
    const ColourCells cells = ball(20000, 30, 2);
    for (const std::size_t most :
         {std::size_t{1}, std::size_t{2}, std::size_t{64}, std::size_t{1000}, std::size_t{15000}}) {
        const ColourSample sample = sample_colours(cells, places_of(cells), most);
        CHECK(sample.chosen.size() <= most);
        CHECK(static_cast<double>(sample.chosen.size()) > 0.85 * static_cast<double>(most) - 1);
        CHECK_EQUAL(sample.counts.size(), sample.chosen.size());
        CHECK_EQUAL(total(sample.counts), total(cells.counts));
        for (std::size_t i = 1; i < sample.chosen.size(); ++i)
            CHECK(sample.chosen[i - 1] < sample.chosen[i]);
    }
}

TEST(every_group_is_a_run_of_cells_around_its_own) {
    const ColourCells cells = ball(20000, 30, 3);
    const ColourSample sample = sample_colours(cells, places_of(cells), 2000);
    std::size_t at = 0;
    for (std::size_t i = 0; i < sample.chosen.size(); ++i) {
        const std::size_t first = at;
        double pixels = 0;
        while (pixels < sample.counts[i]) pixels += cells.counts[at++];
        CHECK_EQUAL(pixels, sample.counts[i]);
        CHECK(first <= sample.chosen[i] && sample.chosen[i] < at);
    }
    CHECK_EQUAL(at, cells.keys.size());
}

TEST(groups_are_finest_where_the_colours_end) {
    const ColourCells cells = ball(60000, 1, 4);
    const ColourSample sample = sample_colours(cells, places_of(cells), 6000);
    double surface = 0, surface_groups = 0, middle = 0, middle_groups = 0, elsewhere = 0;
    const auto radius = [&](std::size_t i) {
        const Vec3 p = colour_of(cells.keys[i]);
        double r2 = 0;
        for (double x : p) r2 += (x - 128 / 255.0) * (x - 128 / 255.0);
        return std::sqrt(r2) * 255 / 120;
    };
    for (std::size_t i = 0; i < cells.keys.size(); ++i)
        (radius(i) > 0.97 ? surface : radius(i) < 0.5 ? middle : elsewhere) += 1;
    for (const std::size_t i : sample.chosen)
        (radius(i) > 0.97 ? surface_groups : radius(i) < 0.5 ? middle_groups : elsewhere) += 1;
    CHECK(surface > 1000 && middle > 1000);
    CHECK(surface_groups / surface > 4 * middle_groups / middle);
}

TEST(a_group_is_drawn_in_proportion_to_its_pixels) {
    // 3000 pairs of cells apart in a plane, of which the upper has a quarter of the pixels.
    ColourCells cells;
    for (unsigned i = 0; i < 3000; ++i) {
        const unsigned a = 4 * (i % 60), b = 4 * (i / 60);
        cells.keys.push_back(interleaved(a, b, 0));
        cells.keys.push_back(interleaved(a, b, 1));
    }
    std::sort(cells.keys.begin(), cells.keys.end());
    for (int i = 0; i < 3000; ++i) {
        cells.counts.push_back(3);
        cells.counts.push_back(1);
    }
    const ColourSample sample = sample_colours(cells, places_of(cells), 3000);
    CHECK_EQUAL(sample.chosen.size(), std::size_t{3000});
    double upper = 0;
    for (const std::size_t i : sample.chosen) upper += static_cast<double>(i % 2);
    CHECK_NEAR(upper / 3000, 0.25, 0.01);
}

TEST(sampling_needs_counts_places_and_room) {
    const ColourCells cells = ball(100, 9, 5);
    CHECK_THROWS(std::invalid_argument, sample_colours(cells, places_of(cells), 0));
    CHECK_THROWS(std::invalid_argument, sample_colours(cells, {}, 10));
    CHECK_THROWS(std::invalid_argument, sample_colours({cells.keys, {1}}, places_of(cells), 10));
}

TEST(colours_on_a_point_a_line_and_far_away) {
    // No extent within a block; then one in a single direction; then beyond all 8-bit cells.
    const ColourCells point{{interleaved(8, 8, 8), interleaved(8, 8, 9)}, {5, 1}};
    CHECK_EQUAL(sample_colours(point, places_of(point), 1).counts[0], 6.0);
    ColourCells line;
    for (unsigned i = 0; i < 40000; i += 7) line.keys.push_back(interleaved(i, i, i));
    line.counts.assign(line.keys.size(), 2);
    const ColourSample sample = sample_colours(line, places_of(line), 100);
    CHECK(sample.chosen.size() <= 100 && sample.chosen.size() > 30);
    CHECK_EQUAL(total(sample.counts), total(line.counts));
}
