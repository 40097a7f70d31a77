#include "fit/matte_learning.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "fit/object_region.hpp"
#include "threads/share_rows.hpp"

namespace palette4d {
namespace {

constexpr int kRounds = 3;
/// A colour counts at most as this share of the object or of the background: that it is there
/// counts, not its area. Larger: big walls outweigh what is clicked on; smaller: greys get a tint.
constexpr double kMost = 1.0 / 300;
/// Density below which a colour has not been seen. Larger: the hue decides more, less tint but
/// rims; smaller: the reverse.
constexpr double kUnseen = 4e-6;
/// How the band counts beside the background, by the share of its pixels to this power.
constexpr double kEdge = 0.25;
/// Standard deviation of the densities' kernel, in nodes.
constexpr double kKernel = 1.4;

/// Counts pixels by node.
class Histograms {
public:
    explicit Histograms(const View& view) : view_(view), counts_(MatteGrid::kSize, 0.0f) {}

    /// Adds shares of a mask's pixels, `weight` in all; none counts more than kMost where `capped`.
    void add(Grid& to, double weight, const Mask& mask, bool capped,
             const Image* weights = nullptr) {
        double count = 0;
        for (std::size_t i = 0; i < view_.size(); ++i) {
            if (!mask[i]) continue;
            float& own = counts_[view_.node[i]];
            if (own == 0) nodes_.push_back(view_.node[i]);  // again where weights are 0
            own += weights ? (*weights)[i] : 1.0f;
            count += 1;
        }
        std::sort(nodes_.begin(), nodes_.end());
        nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
        double sum = 0;
        for (const std::uint32_t node : nodes_) {
            float& value = counts_[node];
            value = static_cast<float>(value / count);
            if (capped) value = std::min(value, static_cast<float>(kMost));
            sum += value;
        }
        for (const std::uint32_t node : nodes_) {
            float& value = counts_[node];
            if (capped) value = static_cast<float>(value / sum);
            to[node] += static_cast<float>(weight * static_cast<double>(value));
            value = 0;
        }
        nodes_.clear();
    }

private:
    const View& view_;
    Grid counts_;  ///< all 0 between calls
    std::vector<std::uint32_t> nodes_;
};

/// Blurs along one axis of `nodes` values, `stride` elements apart.
void blur_axis(Grid& grid, int nodes, std::size_t stride, double sigma) {
    const int radius = static_cast<int>(std::lround(3 * sigma));
    std::vector<float> kernel;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
    for (int i = -radius; i <= radius; ++i) {
        kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)) / sum));
    }
    std::vector<float> line(static_cast<std::size_t>(nodes + 2 * radius), 0.0f);
    const std::size_t length = stride * static_cast<std::size_t>(nodes);
    for (std::size_t block = 0; block < grid.size(); block += length) {
        for (std::size_t first = block; first < block + stride; ++first) {
            bool some = false;
            for (int i = 0; i < nodes; ++i) {
                const float value = grid[first + stride * static_cast<std::size_t>(i)];
                line[static_cast<std::size_t>(i + radius)] = value;
                some |= value != 0;
            }
            if (!some) continue;
            for (int i = 0; i < nodes; ++i) {
                float value = 0;
                for (std::size_t k = 0; k < kernel.size(); ++k) {
                    value += kernel[k] * line[static_cast<std::size_t>(i) + k];
                }
                grid[first + stride * static_cast<std::size_t>(i)] = value;
            }
        }
    }
}

Grid blurred(Grid grid) {
    constexpr std::size_t line = MatteGrid::kLightnesses;
    blur_axis(grid, MatteGrid::kLightnesses, 1, kKernel);
    blur_axis(grid, MatteGrid::kSaturations, line, kKernel);
    blur_axis(grid, MatteGrid::kSaturations, line * MatteGrid::kSaturations, kKernel);
    return grid;
}

/// Calls work(i) for all numbers below `count`, on all processors.
template <class Work>
void for_each_number(std::size_t count, Work work) {
    share_rows(static_cast<int>(count), 0, [&work](const NextRow& next) {
        for (int i = next(); i >= 0; i = next()) work(static_cast<std::size_t>(i));
    });
}

/// What frames show:
using Densities = std::array<Grid, 5>;  ///< object, background, held, band, its wanted part

Densities densities_of(const View& view, const Parts& parts, double weight) {
    Densities densities;
    densities.fill(Grid(MatteGrid::kSize));
    auto& [object, background, held, mixed, part] = densities;
    Histograms histograms(view);
    histograms.add(object, weight, parts.object, true);
    histograms.add(background, weight, parts.background, true);
    histograms.add(held, weight, parts.held, true);
    const auto count = [](const Mask& mask) {
        return static_cast<double>(std::count(mask.begin(), mask.end(), 1));
    };
    const double band = count(parts.band);
    if (band == 0) return densities;
    const double counts =
        std::min(std::pow(band / std::max(count(parts.background), 1.0), kEdge), 1.0);
    histograms.add(mixed, counts * weight, parts.band, false);
    histograms.add(part, counts * weight, parts.band, false, &parts.wanted);
    return densities;
}

/// What other colours leave of the object's, by how near a colour is to both.
Grid shared(const std::vector<Vec3>& own, const std::vector<Vec3>& others) {
    Grid left(MatteGrid::kSize, 1.0f);
    for (const Vec3& other : others) {
        std::size_t at = 0;
        for (int u = 0; u < MatteGrid::kSaturations; ++u) {
            for (int v = 0; v < MatteGrid::kSaturations; ++v) {
                for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
                    const Vec3 node = MatteGrid::point(u, v, l);
                    double most = 0;
                    for (const Vec3& part : own) most = std::max(most, spared(node, other, part));
                    left[at++] *= static_cast<float>(most);
                }
            }
        }
    }
    return left;
}

}  // namespace

LearnedMatte learn_matte(const std::vector<LearningFrame>& frames, const Vec3& picked,
                         const std::vector<Vec3>& holds, const DisplayCurve* display) {
    if (frames.empty()) throw std::invalid_argument("learn_matte: found no frame");
    std::vector<View> views(frames.size());
    for_each_number(frames.size(),
                    [&](std::size_t n) { views[n] = reduced(frames[n], picked, display); });
    const Grid hue = hue_grid(displayed(picked, display));
    MarkedColours marked;
    for (const View& view : views) {
        const auto& [own, held] = view.marked;
        marked.own.insert(marked.own.end(), own.begin(), own.end());
        marked.held.insert(marked.held.end(), held.begin(), held.end());
    }
    std::vector<Vec3> kept;
    for (const Vec3& hold : holds) kept.push_back(pick_point(displayed(hold, display)));
    // Colours that no frame shows are whose mark is nearer.
    const Grid left = shared(marked.own, kept), unseen = shared(marked.own, marked.held);
    LearnedMatte learned;
    Grid membership(MatteGrid::kSize), sure;
    for (std::size_t i = 0; i < membership.size(); ++i) membership[i] = hue[i] * left[i];
    for (int round = 0; round < kRounds; ++round) {
        // Other frames count once there is something to find the object by.
        const auto counts = [&](const View& view) { return view.seeded || round > 0; };
        // What was clicked on counts as much as all other frames together.
        const double others =
            static_cast<double>(std::count_if(views.begin(), views.end(), counts)) - 1;
        std::vector<Densities> each(views.size());
        for_each_number(views.size(), [&](std::size_t n) {
            if (!counts(views[n])) return;
            const Parts parts = find_object(views[n], membership, sure, marked);
            each[n] = densities_of(views[n], parts, n > 0 ? 0.5 / others : others > 0 ? 0.5 : 1.0);
            if (n > 0) return;
            const auto area = static_cast<double>(
                std::count(parts.region.begin(), parts.region.end(), std::uint8_t{1}));
            learned.share = area / static_cast<double>(views[n].size());
            learned.found = area > 0;
        });
        Densities all;
        for_each_number(all.size(), [&](std::size_t kind) {
            Grid sum(MatteGrid::kSize);
            for (const Densities& own : each) {
                for (std::size_t i = 0; i < own[kind].size(); ++i) sum[i] += own[kind][i];
            }
            all[kind] = blurred(std::move(sum));
        });
        const auto& [object, background, held, band, part] = all;
        sure.resize(membership.size());
        for (std::size_t i = 0; i < membership.size(); ++i) {
            const double f = object[i], b = background[i] + held[i], q = band[i], qm = part[i];
            const double prior = std::sqrt(static_cast<double>(hue[i]));
            sure[i] = static_cast<float>(f / (f + b + q + kUnseen));
            const double m = prior * (f + qm + kUnseen * unseen[i]) / (prior * f + q + b + kUnseen);
            membership[i] = static_cast<float>(std::clamp(m, 0.0, 1.0) * left[i]);
        }
    }
    learned.membership = std::move(membership);
    return learned;
}

}  // namespace palette4d
