#include "fit/reconstruction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

constexpr int kLeaf = LossLeaf::kSize;
static_assert(ColourTree::kLeafSize == kLeaf, "a leaf at a time");
static_assert(ColourTree::Boxes::kSize == LossKernels::kBoxes, "so many boxes at a time");

// Largest weight in E per unit of distance. Farther out the weight stays constant, so that a few
// wrong pixels (hot ones, say) cannot blow up the palette.
constexpr double kMostReach = 8;

struct Closest {
    double d2 = std::numeric_limits<double>::infinity();
    Face at{0, 0, 0};
    Vec3 weight{1, 0, 0};
};

void try_edge(const Vec3& p, const LossEdge& edge, Closest& best) {
    const Vec3 ab = vec3(edge.along), ap = p - vec3(edge.from);
    const double s = std::clamp(dot(ap, ab) * edge.inverse_length2, 0.0, 1.0);
    Vec3 d = ap;
    add(d, -s, ab);
    const double d2 = dot(d, d);
    const int a = edge.at[0], b = edge.at[1];
    if (d2 < best.d2) best = {d2, {a, b, b}, {1 - s, s, 0}};
}

/// The foot of the perpendicular, if it lies on the facet.
void try_facet(const Vec3& p, const std::vector<Vec3>& v, const LossFacet& f, Closest& best) {
    const int* const at = f.at;
    const Vec3 ab = v[at[1]] - v[at[0]], ac = v[at[2]] - v[at[0]], ap = p - v[at[0]];
    const Vec3 n = cross(ab, ac);
    const double nn = dot(n, n);
    if (!(nn > 1e-28)) return;
    const double wb = dot(cross(ap, ac), n) / nn, wc = dot(cross(ab, ap), n) / nn;
    if (!(wb >= 0 && wc >= 0 && wb + wc <= 1)) return;
    const double h = dot(ap, n), d2 = h * h / nn;
    if (d2 < best.d2) best = {d2, {at[0], at[1], at[2]}, {1 - wb - wc, wb, wc}};
}

/// Sums count * distance over the pixels outside.
class Outside {
public:
    Outside(const ColourTree& colours, const std::vector<Vec3>& v, const PaletteHull& hull,
            const LossWeights& weights, const LossKernels& kernels, ReconstructionScratch& scratch,
            std::vector<Vec3>* gradient)
        : colours_(colours),
          v_(v),
          hull_(hull),
          reach_{weights.reach > 0 ? 1 / (weights.reach * weights.reach * weights.reach) : 0,
                 kMostReach, weights.slight},
          kernels_(kernels),
          scratch_(scratch),
          gradient_(gradient) {}

    void run(FrameLoss& loss) {
        const std::size_t facets = hull_.facets.size(), levels = colours_.levels().size();
        if (gradient_) {
            gradient_->assign(v_.size(), Vec3{0, 0, 0});
            scratch_.loads.assign(facets, {});
        }
        if (hull_.solid) {
            scratch_.facets.resize((levels + 1) * facets);
            scratch_.reached.resize(levels * facets);
            int* const all = scratch_.facets.data() + levels * facets;
            for (std::size_t i = 0; i < facets; ++i) all[i] = static_cast<int>(i);
            visit(levels - 1, 0, all, static_cast<int>(facets));
            finish_beside();
        } else {
            flat();
        }
        const auto total = [](const double* lanes) {
            return std::accumulate(lanes, lanes + kLeaf, 0.0);
        };
        loss.R = total(sums_.distance) / colours_.total();
        loss.E = total(sums_.far_distance) / colours_.total();
        loss.outside = total(sums_.counted) / colours_.total();
        loss.max_distance = *std::max_element(sums_.most, sums_.most + kLeaf);
        if (gradient_) finish_gradient();
    }

private:
    /// Tests box group number `group` of a level against the `count` facets that its boxes may
    /// reach. All operations are monotonic, even rounded: an outer box reaches all that its inner
    /// boxes reach.
    void visit(std::size_t level, std::size_t group, const int* which, int count) {
        const ColourTree::Boxes& boxes = colours_.levels()[level][group];
        const std::size_t mine = level * hull_.facets.size();
        unsigned* const reached = scratch_.reached.data() + mine;
        int* const facets = scratch_.facets.data() + mine;
        kernels_.reach(hull_.facets.data(), which, count, boxes.sides, kFlat, reached);
        unsigned some = 0;
        for (int i = 0; i < count; ++i) some |= reached[i];
        for (int box = 0; box < boxes.count; ++box) {
            if (!(some >> box & 1u)) continue;
            int found = 0;
            for (int i = 0; i < count; ++i) {
                facets[found] = which[i];
                found += (reached[i] >> box) & 1u;
            }
            const std::size_t inner = LossKernels::kBoxes * group + static_cast<std::size_t>(box);
            if (level > 0)
                visit(level - 1, inner, facets, found);
            else
                leaf(inner, facets, found);
        }
    }

    void leaf(std::size_t at, const int* facets, int count) {
        const int begin = colours_.leaf_starts()[at], size = colours_.leaf_starts()[at + 1] - begin;
        const double* const channels[3] = {colours_.channel(0) + begin, colours_.channel(1) + begin,
                                           colours_.channel(2) + begin};
        kernels_.fall(hull_.facets.data(), facets, count, channels, size, kFlat, leaf_);
        if (!leaf_.outside) return;
        kernels_.pull(colours_.counts() + begin, size, reach_, leaf_, sums_);
        if (gradient_) kernels_.press(facets, count, leaf_, scratch_.loads.data());
        for (unsigned left = leaf_.beside; left; left &= left - 1) {
            const int i = begin + __builtin_ctz(left);
            for (int c = 0; c < 3; ++c) beside_[c][beside_count_] = colours_.channel(c)[i];
            beside_[3][beside_count_] = colours_.counts()[i];
            if (++beside_count_ == kLeaf) finish_beside();
        }
    }

    /// The closest points of the colours beside the facets lie on edges of the hull.
    void finish_beside() {
        const double* const channels[3] = {beside_[0], beside_[1], beside_[2]};
        kernels_.to_edges(hull_.edges.data(), static_cast<int>(hull_.edges.size()), channels,
                          beside_count_, leaf_);
        kernels_.pull(beside_[3], beside_count_, reach_, leaf_, sums_);
        for (int i = 0; gradient_ && i < beside_count_; ++i) {
            const LossEdge& edge = hull_.edges[static_cast<std::size_t>(leaf_.edge[i])];
            const double s = leaf_.along[i];
            add_gradient<2>(i, {beside_[0][i], beside_[1][i], beside_[2][i]},
                            {edge.at[0], edge.at[1], 0}, {1 - s, s, 0});
        }
        beside_count_ = 0;
    }

    /// The palette is flat: tests all colours against all facets, which have no inside.
    void flat() {
        const int colours = static_cast<int>(colours_.size());
        for (int begin = 0; begin < colours; begin += kLeaf) {
            const int size = std::min(kLeaf, colours - begin);
            Closest closest[kLeaf];
            for (int i = 0; i < size; ++i) {
                const Vec3 p = colours_.rgb(begin + i);
                for (const LossFacet& f : hull_.facets) try_facet(p, v_, f, closest[i]);
                for (const LossEdge& edge : hull_.edges) try_edge(p, edge, closest[i]);
                // An empty palette has no facets.
                leaf_.distance[i] = std::isfinite(closest[i].d2) ? std::sqrt(closest[i].d2) : 0;
            }
            kernels_.pull(colours_.counts() + begin, size, reach_, leaf_, sums_);
            if (!gradient_) continue;
            for (int i = 0; i < size; ++i)
                if (leaf_.distance[i] > 0)
                    add_gradient<3>(i, colours_.rgb(begin + i), closest[i].at, closest[i].weight);
        }
    }

    /// Adds the gradient of the leaf's i-th colour, whose closest point lies between `count`
    /// corners.
    template <int count>
    void add_gradient(int i, const Vec3& p, const Face& at, const Vec3& weight) {
        Vec3 u = p;
        for (int c = 0; c < count; ++c) add(u, -weight[c], v_[at[c]]);
        for (int c = 0; c < count; ++c)
            add((*gradient_)[at[c]], -leaf_.pull[i] * weight[c] / leaf_.distance[i], u);
    }

    void finish_gradient() {
        for (std::size_t i = 0; i < hull_.facets.size(); ++i) {
            const LossFacet& f = hull_.facets[i];
            const Vec3 normal = vec3(f.normal);
            double at_corners[3] = {0, 0, 0};
            const LossLoad& load = scratch_.loads[i];
            for (int lane = 0; lane < kLeaf; ++lane) {
                const double first = load.corner[0][lane], second = load.corner[1][lane];
                at_corners[0] += first + second - load.all[lane];
                at_corners[1] -= first;
                at_corners[2] -= second;
            }
            for (int c = 0; c < 3; ++c) add((*gradient_)[f.at[c]], at_corners[c], normal);
        }
        for (Vec3& g : *gradient_)
            for (double& x : g) x /= colours_.total();
    }

    const ColourTree& colours_;
    const std::vector<Vec3>& v_;
    const PaletteHull& hull_;
    const LossReach reach_;
    const LossKernels& kernels_;
    ReconstructionScratch& scratch_;
    std::vector<Vec3>* gradient_;
    LossLeaf leaf_{};
    LossSums sums_{};
    alignas(64) double beside_[4][kLeaf] = {};  // colours and counts that wait for finish_beside()
    int beside_count_ = 0;
};

}  // namespace

void measure_reconstruction(const ColourTree& colours, const std::vector<Vec3>& palette,
                            const PaletteHull& hull, const LossWeights& weights,
                            const LossKernels& kernels, ReconstructionScratch& scratch,
                            FrameLoss& loss, std::vector<Vec3>* gradient) {
    Outside(colours, palette, hull, weights, kernels, scratch, gradient).run(loss);
}

}  // namespace palette4d
