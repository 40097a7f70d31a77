#include "fit/colour_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "model/vec3.hpp"
#include "simd/kernel_choice.hpp"

namespace palette4d {
namespace {

// Squared distances closer than this are ties (8-bit colours differ by far more).
constexpr double kTie = 1e-12;

}  // namespace

/// Splits colours at their median again and again, along the longest side of their box.
class ColourTree::Builder {
public:
    static constexpr int kAxes = 3;

    explicit Builder(const std::vector<Vec3>& rgb) : rgb_(rgb), before_(rgb.size()) {
        spare_.resize(rgb.size());
        for (int c = 0; c < kAxes; ++c) sort_along(c);
        split(0, static_cast<int>(rgb.size()));
    }

    std::vector<int> leaf_starts;  ///< as in ColourTree, without size()
    std::vector<Box> boxes;        ///< of the leaves

    /// The colours' indices, leaf by leaf.
    const std::vector<int>& order() const { return sorted_[0]; }

private:
    /// A radix sort. Single precision will do: any split gives a tree.
    void sort_along(int axis) {
        constexpr int kDigit = 11, kValues = 1 << kDigit, kBits = 32;
        std::vector<std::uint32_t> keys;
        for (const Vec3& colour : rgb_) {
            const auto value = static_cast<float>(colour[axis]);
            std::uint32_t bits;
            std::memcpy(&bits, &value, sizeof bits);
            keys.push_back(bits >> (kBits - 1) ? ~bits : bits | 1u << (kBits - 1));
        }
        std::vector<int>& sorted = sorted_[axis];
        sorted.resize(rgb_.size());
        std::iota(sorted.begin(), sorted.end(), 0);
        for (int shift = 0; shift < kBits; shift += kDigit) {
            std::array<int, kValues + 1> at{};
            for (const std::uint32_t key : keys) ++at[(key >> shift) % kValues + 1];
            std::partial_sum(at.begin(), at.end(), at.begin());
            for (const int i : sorted) spare_[at[(keys[i] >> shift) % kValues]++] = i;
            sorted.swap(spare_);
        }
    }

    void split(int begin, int end) {
        if (end - begin <= kLeafSize) {
            leaf_starts.push_back(begin);
            boxes.push_back(box_of(begin, end));
            return;
        }
        int axis = 0;
        double longest = -1;
        for (int c = 0; c < kAxes; ++c) {
            const double length = rgb_[sorted_[c][end - 1]][c] - rgb_[sorted_[c][begin]][c];
            if (length > longest) {
                longest = length;
                axis = c;
            }
        }
        const int middle = begin + (end - begin) / 2;
        for (int i = begin; i < end; ++i) before_[sorted_[axis][i]] = i < middle;
        for (int c = 0; c < kAxes; ++c)
            if (c != axis) divide(sorted_[c], begin, end);
        split(begin, middle);
        split(middle, end);
    }

    /// Moves what is before the median to the front; both parts stay sorted.
    void divide(std::vector<int>& sorted, int begin, int end) {
        int front = begin, back = 0;
        for (int i = begin; i < end; ++i) {
            const int colour = sorted[i];
            sorted[front] = spare_[back] = colour;  // without a branch
            front += before_[colour];
            back += !before_[colour];
        }
        std::copy_n(spare_.begin(), back, sorted.begin() + front);
    }

    Box box_of(int begin, int end) const {
        Box box{rgb_[order()[begin]], rgb_[order()[begin]]};
        auto& [low, high] = box;
        for (int i = begin; i < end; ++i)
            for (int c = 0; c < kAxes; ++c) {
                low[c] = std::min(low[c], rgb_[order()[i]][c]);
                high[c] = std::max(high[c], rgb_[order()[i]][c]);
            }
        return box;
    }

    const std::vector<Vec3>& rgb_;
    std::array<std::vector<int>, kAxes> sorted_;  // indices, sorted along each axis in each part
    std::vector<std::uint8_t> before_;            // of each colour: whether it is before the median
    std::vector<int> spare_;
};

ColourTree::ColourTree(const std::vector<Vec3>& rgb, const std::vector<double>& counts)
    : size_(rgb.size()) {
    if (rgb.empty() || rgb.size() != counts.size())
        throw std::invalid_argument("a colour tree needs as many counts as colours, at least one");
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        if (!(counts[i] > 0) || !std::isfinite(counts[i]) || !finite(rgb[i]))
            throw std::invalid_argument("a colour tree needs finite colours and positive counts");
    }
    Builder builder(rgb);
    leaf_starts_ = std::move(builder.leaf_starts);
    leaf_starts_.push_back(static_cast<int>(size_));
    build_levels(std::move(builder.boxes));
    counts_.resize(size_ + kLeafSize);
    for (auto& channel : channel_) channel.resize(size_ + kLeafSize);
    for (std::size_t i = 0; i < size_; ++i) {
        const auto from = static_cast<std::size_t>(builder.order()[i]);
        for (std::size_t c = 0; c < channel_.size(); ++c) channel_[c][i] = rgb[from][c];
        counts_[i] = counts[from];
        total_ += counts_[i];
    }
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
