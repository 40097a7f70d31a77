#include "fit/colour_sample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palette4d {
namespace {

constexpr int kBlockBits = 9;      // of a key: a block is 8x8x8 cells
constexpr int kPerOctave = 64;     // steps that distinguish group widths
constexpr double kSurface = 0.05;  // depth, in extents, at which groups are twice as wide
constexpr std::size_t kAxes = 48;  // directions that find the surface
constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ull;  // its fraction, times 2^64

/// The highest bit in which two keys differ; keys are never equal.
int highest_difference(std::uint64_t a, std::uint64_t b) { return 63 - __builtin_clzll(a ^ b); }

/// The cost of a group that spans bits up to `bit` of its key: the logarithm of its width. One more
/// bit doubles one of the three sides.
int width_cost(int bit) { return (bit + 1) * kPerOctave / 3; }

/// Directions spread evenly over half a sphere (a Fibonacci spiral).
std::array<std::array<float, 3>, kAxes> make_axes() {
    std::array<std::array<float, 3>, kAxes> axes{};
    const double turn = 2.399963229728653;  // the golden angle
    for (std::size_t i = 0; i < kAxes; ++i) {
        const double z = (static_cast<double>(i) + 0.5) / kAxes;
        const double ring = std::sqrt(1 - z * z), angle = turn * static_cast<double>(i);
        axes[i] = {static_cast<float>(ring * std::cos(angle)),
                   static_cast<float>(ring * std::sin(angle)), static_cast<float>(z)};
    }
    return axes;
}

/// For each place, how much less a group costs there than at depth 0, in `width_cost`'s units.
std::vector<int> surface_costs(const std::vector<Vec3>& places) {
    const std::size_t n = places.size();
    Vec3 low = places[0], high = places[0];
    for (const Vec3& p : places)
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], p[c]);
            high[c] = std::max(high[c], p[c]);
        }
    double extent = 0;
    for (int c = 0; c < 3; ++c) extent = std::max(extent, high[c] - low[c]);
    if (!(extent > 0) || !std::isfinite(extent)) return std::vector<int>(n, 0);
    std::vector<float> x(n), y(n), z(n), along(n), depth(n, std::numeric_limits<float>::max());
    for (std::size_t i = 0; i < n; ++i) {
        x[i] = static_cast<float>((places[i][0] - low[0]) / extent);
        y[i] = static_cast<float>((places[i][1] - low[1]) / extent);
        z[i] = static_cast<float>((places[i][2] - low[2]) / extent);
    }
    static const auto axes = make_axes();
    for (const auto& axis : axes) {
        float first = std::numeric_limits<float>::max(), last = -first;
        for (std::size_t i = 0; i < n; ++i) {
            along[i] = axis[0] * x[i] + axis[1] * y[i] + axis[2] * z[i];
            first = along[i] < first ? along[i] : first;
            last = along[i] > last ? along[i] : last;
        }
        for (std::size_t i = 0; i < n; ++i) {
            const float before = along[i] - first, after = last - along[i];
            const float nearer = before < after ? before : after;
            depth[i] = nearer < depth[i] ? nearer : depth[i];
        }
    }
    std::vector<int> costs(n);
    for (std::size_t i = 0; i < n; ++i) {
        // Cells outside the unit cube grow with their distance from it.
        double scale = 1;
        for (const double v : places[i]) scale = std::max(scale, std::abs(v));
        const double wider = std::log2(scale) - std::log2(1 + depth[i] / kSurface);
        costs[i] = static_cast<int>(std::lround(kPerOctave * wider));
    }
    return costs;
}

/// For each boundary between blocks: the cost of the smallest larger cell that holds both
/// neighbours. `bits` are the highest differing bits of the keys there, `costs` the costs of the
/// blocks.
std::vector<int> boundary_costs(const std::vector<int>& bits, const std::vector<int>& costs) {
    struct Run {
        int cost;              // the largest of its blocks
        std::size_t boundary;  // the one before it
    };
    std::vector<Run> runs{{costs[0], 0}};
    std::vector<int> out(bits.size());
    for (std::size_t i = 0; i < bits.size(); ++i) runs.push_back({costs[i + 1], i});
    for (int level = kBlockBits; runs.size() > 1; ++level) {
        std::size_t kept = 0;
        for (std::size_t first = 0; first < runs.size();) {
            std::size_t end = first + 1;
            int cost = runs[first].cost;
            while (end < runs.size() && bits[runs[end].boundary] == level)
                cost = std::max(cost, runs[end++].cost);
            for (std::size_t i = first + 1; i < end; ++i)
                out[runs[i].boundary] = cost + width_cost(level);
            runs[kept++] = {cost, runs[first].boundary};
            first = end;
        }
        runs.resize(kept);
    }
    return out;
}

/// Costs of all boundaries between neighbouring cells. They are monotone: merging all below a limit
/// leaves whole larger cells.
std::vector<int> all_costs(const ColourCells& cells, const std::vector<Vec3>& places) {
    const std::vector<std::size_t> blocks = colour_blocks(cells);
    if (places.size() + 1 != blocks.size())
        throw std::invalid_argument("sampling needs a place for each block of cells");
    const std::vector<int> of_block = surface_costs(places);
    std::vector<int> bits;
    for (std::size_t b = 1; b + 1 < blocks.size(); ++b)
        bits.push_back(highest_difference(cells.keys[blocks[b] - 1], cells.keys[blocks[b]]));
    const std::vector<int> between = boundary_costs(bits, of_block);
    std::vector<int> out;
    out.reserve(cells.keys.size());
    for (std::size_t b = 0; b + 1 < blocks.size(); ++b) {
        if (b > 0) out.push_back(between[b - 1]);
        for (std::size_t i = blocks[b] + 1; i < blocks[b + 1]; ++i)
            out.push_back(of_block[b] +
                          width_cost(highest_difference(cells.keys[i - 1], cells.keys[i])));
    }
    return out;
}

/// The lowest cost that is not merged, so that at most `most` groups are left.
int limit_for(const std::vector<int>& costs, std::size_t most) {
    const int lowest = *std::min_element(costs.begin(), costs.end());
    std::vector<std::size_t> histogram;
    for (const int cost : costs) {
        const auto at = static_cast<std::size_t>(cost - lowest);
        if (at >= histogram.size()) histogram.resize(at + 1);
        ++histogram[at];
    }
    std::size_t groups = costs.size() + 1;
    int limit = lowest;
    for (std::size_t at = 0; groups > most; ++at, ++limit) groups -= histogram[at];
    return limit;
}

}  // namespace

std::vector<std::size_t> colour_blocks(const ColourCells& cells) {
    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < cells.keys.size(); ++i)
        if (i == 0 || cells.keys[i] >> kBlockBits != cells.keys[i - 1] >> kBlockBits)
            starts.push_back(i);
    starts.push_back(cells.keys.size());
    return starts;
}

ColourSample sample_colours(const ColourCells& cells, const std::vector<Vec3>& places,
                            std::size_t most) {
    const std::size_t n = cells.keys.size();
    if (cells.counts.size() != n || most < 1)
        throw std::invalid_argument("sampling needs a count a cell and room for at least one");
    ColourSample out;
    if (n <= most) {
        out.chosen.resize(n);
        for (std::size_t i = 0; i < n; ++i) out.chosen[i] = i;
        out.counts = cells.counts;
        return out;
    }
    const std::vector<int> costs = all_costs(cells, places);
    const int limit = limit_for(costs, most);
    std::uint64_t draw = kGoldenRatio / 2;
    for (std::size_t first = 0, end; first < n; first = end, draw += kGoldenRatio) {
        double total = cells.counts[first];
        for (end = first + 1; end < n && costs[end - 1] < limit; ++end) total += cells.counts[end];
        double before = std::ldexp(static_cast<double>(draw >> 11), -53) * total;
        std::size_t chosen = first;
        while (chosen + 1 < end && before >= cells.counts[chosen]) before -= cells.counts[chosen++];
        out.chosen.push_back(chosen);
        out.counts.push_back(total);
    }
    return out;
}

}  // namespace palette4d
