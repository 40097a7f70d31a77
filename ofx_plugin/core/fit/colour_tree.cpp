#include "fit/colour_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "model/vec3.hpp"
#include "simd/instruction_set.hpp"

namespace palette4d {
namespace {

// Squared distances closer than this are ties (8-bit colours differ by far more).
constexpr double kTie = 1e-12;

}  // namespace

ColourTree::ColourTree(std::vector<Vec3> rgb, std::vector<double> counts) : size_(rgb.size()) {
    if (rgb.empty() || rgb.size() != counts.size())
        throw std::invalid_argument("a colour tree needs as many counts as colours, at least one");
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        if (!(counts[i] > 0) || !std::isfinite(counts[i]) || !finite(rgb[i]))
            throw std::invalid_argument("a colour tree needs finite colours and positive counts");
    }
    std::vector<Colour> order(rgb.size());
    for (std::size_t i = 0; i < rgb.size(); ++i) order[i].index = static_cast<int>(i);
    std::vector<Box> leaves;
    build(0, static_cast<int>(rgb.size()), rgb, order, leaves);
    leaf_starts_.push_back(static_cast<int>(size_));
    build_levels(std::move(leaves));
    counts_.resize(rgb.size() + kLeafSize);
    for (int c = 0; c < 3; ++c) {
        channel_[c].resize(rgb.size() + kLeafSize);
        for (std::size_t i = 0; i < order.size(); ++i) channel_[c][i] = rgb[order[i].index][c];
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
        counts_[i] = counts[order[i].index];
        total_ += counts_[i];
    }
}

void ColourTree::build(int begin, int end, const std::vector<Vec3>& rgb, std::vector<Colour>& order,
                       std::vector<Box>& leaves) {
    Box box{rgb[order[begin].index], rgb[order[begin].index]};
    auto& [low, high] = box;
    for (int i = begin; i < end; ++i)
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], rgb[order[i].index][c]);
            high[c] = std::max(high[c], rgb[order[i].index][c]);
        }
    if (end - begin <= kLeafSize) {
        leaf_starts_.push_back(begin);
        leaves.push_back(box);
        return;
    }
    int axis = 0;
    for (int c = 1; c < 3; ++c)
        if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
    const int middle = begin + (end - begin) / 2;
    for (int i = begin; i < end; ++i) order[i].along = rgb[order[i].index][axis];
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [](const Colour& a, const Colour& b) {
                         return (a.along < b.along) | ((a.along == b.along) & (a.index < b.index));
                     });
    build(begin, middle, rgb, order, leaves);
    build(middle, end, rgb, order, leaves);
}

/// A level's boxes: first the leaves, then one around each group of the level before.
void ColourTree::build_levels(std::vector<Box> boxes) {
    do {
        std::vector<Boxes> level((boxes.size() + Boxes::kSize - 1) / Boxes::kSize);
        std::vector<Box> around(level.size());
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            Boxes& group = level[i / Boxes::kSize];
            auto& [low, high] = around[i / Boxes::kSize];
            if (group.count == 0) std::tie(low, high) = boxes[i];
            for (int c = 0; c < 3; ++c) {
                group.sides[0][c][group.count] = boxes[i].first[c];
                group.sides[1][c][group.count] = boxes[i].second[c];
                low[c] = std::min(low[c], boxes[i].first[c]);
                high[c] = std::max(high[c], boxes[i].second[c]);
            }
            ++group.count;
        }
        levels_.push_back(std::move(level));
        boxes = std::move(around);
    } while (boxes.size() > 1);
    std::tie(low_, high_) = boxes[0];
}

/// Candidates sorted by distance.
class ColourTree::Search {
public:
    Search(const ColourTree& tree, const Vec3& v, double k, const LossKernels& kernels,
           Nearest& memory)
        : tree_(tree), v_(v), k_(k), kernels_(kernels), best_(memory.best) {
        visit(tree.levels_.size() - 1, 0);
    }

    Vec3 mean() const {
        const double last = best_[count_ - 1].d2;
        double near = 0, tied = 0;
        Vec3 sum{0, 0, 0}, tied_sum{0, 0, 0};
        for (std::size_t i = 0; i < count_; ++i) {
            const Nearest::Candidate& b = best_[i];
            const double n = tree_.counts_[b.point];
            const bool tie = b.d2 >= last - kTie;
            (tie ? tied : near) += n;
            Vec3& s = tie ? tied_sum : sum;
            for (int c = 0; c < 3; ++c) s[c] += n * tree_.channel_[c][b.point];
        }
        const double share = (k_ - near) / tied;
        return {(sum[0] + share * tied_sum[0]) / k_, (sum[1] + share * tied_sum[1]) / k_,
                (sum[2] + share * tied_sum[2]) / k_};
    }

private:
    /// The nearest of a group's boxes first.
    void visit(std::size_t level, std::size_t group) {
        const Boxes& boxes = tree_.levels_[level][group];
        alignas(64) double squared[Boxes::kSize];
        kernels_.from_boxes(boxes.sides, v_.data(), squared);
        for (int n = 0; n < boxes.count; ++n) {
            int nearest = 0;
            for (int i = 1; i < boxes.count; ++i)
                nearest = squared[i] < squared[nearest] ? i : nearest;
            if (squared[nearest] > limit_ + kTie) return;
            squared[nearest] = std::numeric_limits<double>::infinity();
            const std::size_t inner = Boxes::kSize * group + static_cast<std::size_t>(nearest);
            if (level > 0)
                visit(level - 1, inner);
            else
                leaf(inner);
        }
    }

    void leaf(std::size_t at) {
        const int begin = tree_.leaf_starts_[at], size = tree_.leaf_starts_[at + 1] - begin;
        const double* const channels[3] = {tree_.channel(0) + begin, tree_.channel(1) + begin,
                                           tree_.channel(2) + begin};
        alignas(64) double squared[kLeafSize];
        unsigned near = kernels_.from_colours(channels, size, v_.data(), limit_ + kTie, squared);
        if (best_.size() < count_ + kLeafSize) best_.resize(2 * (count_ + kLeafSize));
        Nearest::Candidate* const best = best_.data();
        for (; near; near &= near - 1) {
            const int i = __builtin_ctz(near);
            std::size_t to = count_++;
            for (; to > 0 && best[to - 1].d2 > squared[i]; --to) best[to] = best[to - 1];
            best[to] = {squared[i], begin + i};
            have_ += tree_.counts_[begin + i];
        }
        drop();
    }

    /// Drops the farthest groups of ties as long as the rest suffices.
    void drop() {
        while (have_ >= k_) {
            limit_ = best_[count_ - 1].d2;
            double group = 0;
            std::size_t first = count_;
            while (first > 0 && best_[first - 1].d2 >= limit_ - kTie)
                group += tree_.counts_[best_[--first].point];
            if (first == 0 || have_ - group < k_) break;
            count_ = first;
            have_ -= group;
        }
    }

    const ColourTree& tree_;
    const Vec3& v_;
    const double k_;
    const LossKernels& kernels_;
    std::vector<Nearest::Candidate>& best_;  // the first count_ of them
    std::size_t count_ = 0;
    double have_ = 0;
    double limit_ = std::numeric_limits<double>::infinity();
};

Vec3 ColourTree::nearest_mean(const Vec3& v, double k, const LossKernels& kernels,
                              Nearest& memory) const {
    if (!finite(v) || !(k > 0))
        throw std::invalid_argument("nearest_mean needs a finite colour and a positive k");
    return Search(*this, v, std::min(k, total_), kernels, memory).mean();
}

Vec3 ColourTree::nearest_mean(const Vec3& v, double k) const {
    Nearest memory;
    return nearest_mean(v, k, kernels_of<LossKernels>(InstructionSet::kBest), memory);
}

}  // namespace palette4d
