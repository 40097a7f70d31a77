#include "fit/colour_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

// Squared distances closer than this are ties (8-bit colours differ by far more).
constexpr double kTie = 1e-12;

double squared_distance_to_box(const Vec3& p, const ColourTree::Node& node) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double below = node.low[c] - p[c], above = p[c] - node.high[c];
        const double beside = below > above ? below : above, d = beside > 0 ? beside : 0;
        sum += d * d;
    }
    return sum;
}

struct Candidate {
    double d2;
    int point;
};

}  // namespace

ColourTree::ColourTree(std::vector<Vec3> rgb, std::vector<double> counts) : size_(rgb.size()) {
    if (rgb.empty() || rgb.size() != counts.size())
        throw std::invalid_argument("a colour tree needs as many counts as colours, at least one");
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        if (!(counts[i] > 0) || !std::isfinite(counts[i]) || !finite(rgb[i]))
            throw std::invalid_argument("a colour tree needs finite colours and positive counts");
    }
    std::vector<Colour> order(rgb.size());
    for (std::size_t i = 0; i < rgb.size(); ++i) order[i] = {rgb[i], static_cast<int>(i)};
    nodes_.reserve(4 * rgb.size() / kLeafSize + 4);
    build(0, static_cast<int>(rgb.size()), order);
    build_levels();
    counts_.resize(rgb.size() + kLeafSize);
    for (int c = 0; c < 3; ++c) {
        channel_[c].resize(rgb.size() + kLeafSize);
        for (std::size_t i = 0; i < order.size(); ++i) channel_[c][i] = order[i].rgb[c];
    }
    for (std::size_t i = 0; i < order.size(); ++i) {
        counts_[i] = counts[order[i].index];
        total_ += counts_[i];
    }
}

int ColourTree::build(int begin, int end, std::vector<Colour>& order) {
    const int index = static_cast<int>(nodes_.size());
    nodes_.push_back({});
    Node node{order[begin].rgb, order[begin].rgb, begin, end, -1, -1};
    for (int i = begin; i < end; ++i)
        for (int c = 0; c < 3; ++c) {
            node.low[c] = std::min(node.low[c], order[i].rgb[c]);
            node.high[c] = std::max(node.high[c], order[i].rgb[c]);
        }
    if (end - begin > kLeafSize) {
        int axis = 0;
        for (int c = 1; c < 3; ++c)
            if (node.high[c] - node.low[c] > node.high[axis] - node.low[axis]) axis = c;
        const int middle = begin + (end - begin) / 2;
        std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                         [axis](const Colour& a, const Colour& b) {
                             return a.rgb[axis] != b.rgb[axis] ? a.rgb[axis] < b.rgb[axis]
                                                               : a.index < b.index;
                         });
        node.left = build(begin, middle, order);
        node.right = build(middle, end, order);
    }
    nodes_[index] = node;
    return index;
}

void ColourTree::build_levels() {
    // A level's boxes: first the leaves, then one around each group of the level before.
    std::vector<std::pair<Vec3, Vec3>> boxes;
    for (std::size_t i = 0; i < nodes_.size(); ++i)
        if (nodes_[i].left < 0) {
            leaves_.push_back(static_cast<int>(i));
            boxes.emplace_back(nodes_[i].low, nodes_[i].high);
        }
    do {
        std::vector<Boxes> level((boxes.size() + Boxes::kSize - 1) / Boxes::kSize);
        std::vector<std::pair<Vec3, Vec3>> around(level.size());
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
}

Vec3 ColourTree::nearest_mean(const Vec3& v, double k) const {
    if (!finite(v) || !(k > 0))
        throw std::invalid_argument("nearest_mean needs a finite colour and a positive k");
    k = std::min(k, total_);
    // Candidates sorted by distance. The farthest group of ties is dropped once the rest suffices.
    struct Search {
        std::vector<Candidate> best;
        std::vector<std::pair<double, int>> stack;
    };
    thread_local Search of_this_thread;
    Search& search = of_this_thread;  // once: each use of a thread_local may be a call
    auto& [best, stack] = search;
    best.clear();
    stack.clear();
    double have = 0;
    double limit = std::numeric_limits<double>::infinity();
    stack.emplace_back(squared_distance_to_box(v, nodes_[0]), 0);
    while (!stack.empty()) {
        const auto [box, index] = stack.back();
        stack.pop_back();
        if (box > limit + kTie) continue;
        const Node& node = nodes_[index];
        if (node.left >= 0) {
            const double l = squared_distance_to_box(v, nodes_[node.left]);
            const double r = squared_distance_to_box(v, nodes_[node.right]);
            if (l <= r) {
                stack.emplace_back(r, node.right);
                stack.emplace_back(l, node.left);
            } else {
                stack.emplace_back(l, node.left);
                stack.emplace_back(r, node.right);
            }
            continue;
        }
        // Always a whole leaf, padding included, so that compilers vectorise the loop.
        double squared[kLeafSize];
        const double *const x = channel(0) + node.begin, *const y = channel(1) + node.begin,
                            *const z = channel(2) + node.begin;
        for (int i = 0; i < kLeafSize; ++i) {
            const double dx = x[i] - v[0], dy = y[i] - v[1], dz = z[i] - v[2];
            squared[i] = dx * dx + dy * dy + dz * dz;
        }
        for (int i = node.begin; i < node.end; ++i) {
            const double d2 = squared[i - node.begin];
            if (d2 > limit + kTie) continue;
            auto at = best.end();
            while (at != best.begin() && (at - 1)->d2 > d2) --at;
            best.insert(at, {d2, i});
            have += counts_[i];
            while (have >= k) {
                limit = best.back().d2;
                double group = 0;
                std::size_t first = best.size();
                while (first > 0 && best[first - 1].d2 >= limit - kTie)
                    group += counts_[best[--first].point];
                if (first == 0 || have - group < k) break;
                best.resize(first);
                have -= group;
            }
        }
    }
    const double last = best.back().d2;
    double near = 0, tied = 0;
    Vec3 sum{0, 0, 0}, tied_sum{0, 0, 0};
    for (const Candidate& b : best) {
        const double n = counts_[b.point];
        const bool tie = b.d2 >= last - kTie;
        (tie ? tied : near) += n;
        Vec3& s = tie ? tied_sum : sum;
        for (int c = 0; c < 3; ++c) s[c] += n * channel_[c][b.point];
    }
    const double share = (k - near) / tied;
    return {(sum[0] + share * tied_sum[0]) / k, (sum[1] + share * tied_sum[1]) / k,
            (sum[2] + share * tied_sum[2]) / k};
}

}  // namespace palette4d
