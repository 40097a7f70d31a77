#include "fit/reconstruction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

void try_edge(const Vec3& p, const LossFacet& f, int e, Closest& best) {
    const LossEdge& edge = f.edges[e];
    const Vec3 ab = vec3(edge.along), ap = p - vec3(edge.from);
    const double s = std::clamp(dot(ap, ab) * edge.inverse_length2, 0.0, 1.0);
    Vec3 d = ap;
    add(d, -s, ab);
    const double d2 = dot(d, d);
    const int a = f.at[e], b = f.at[(e + 1) % 3];
    if (d2 < best.d2) best = {d2, {a, b, b}, {1 - s, s, 0}};
}

void try_facet(const Vec3& p, const std::vector<Vec3>& v, const LossFacet& f, Closest& best) {
    const int* const at = f.at;
    const Vec3 ab = v[at[1]] - v[at[0]], ac = v[at[2]] - v[at[0]], ap = p - v[at[0]];
    const Vec3 n = cross(ab, ac);
    const double nn = dot(n, n);
    if (nn > 1e-28) {
        const double wb = dot(cross(ap, ac), n) / nn;
        const double wc = dot(cross(ab, ap), n) / nn;
        if (wb >= 0 && wc >= 0 && wb + wc <= 1) {
            const double h = dot(ap, n);
            const double d2 = h * h / nn;
            if (d2 < best.d2) best = {d2, {at[0], at[1], at[2]}, {1 - wb - wc, wb, wc}};
            return;
        }
    }
    for (int e = 0; e < 3; ++e) try_edge(p, f, e, best);
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
        } else {
            flat();
        }
        loss.R = sum_ / colours_.total();
        loss.E = far_sum_ / colours_.total();
        loss.outside = count_ / colours_.total();
        loss.max_distance = max_;
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
        if (!kernels_.fall(hull_.facets.data(), facets, count, channels, size, kFlat, leaf_))
            return;
        kernels_.pull(colours_.counts() + begin, size, reach_, leaf_);
        add_up(size);
        if (!gradient_) return;
        // Lists instead of branches: those would be mispredicted for every second colour.
        int straight[kLeaf], beside[kLeaf], straight_count = 0, beside_count = 0;
        for (int i = 0; i < size; ++i) {
            const bool outside = leaf_.distance[i] > 0, on = leaf_.facet[i] >= 0;
            straight[straight_count] = beside[beside_count] = i;
            straight_count += on;
            beside_count += outside && !on;
        }
        for (int n = 0; n < straight_count; ++n) {
            const int i = straight[n];
            ReconstructionScratch::Load& load =
                scratch_.loads[static_cast<std::size_t>(leaf_.facet[i])];
            load.all += leaf_.pull[i];
            for (int c = 0; c < 2; ++c) load.corner[c] += leaf_.pull[i] * leaf_.share[c][i];
        }
        for (int n = 0; n < beside_count; ++n) {
            const int i = beside[n], edge = static_cast<int>(leaf_.edge[i]), e = edge % 3;
            const LossFacet& f = hull_.facets[static_cast<std::size_t>(edge / 3)];
            const double s = leaf_.along[i];
            add_gradient<2>(i, colours_.rgb(begin + i), {f.at[e], f.at[(e + 1) % 3], 0},
                            {1 - s, s, 0});
        }
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
                // An empty palette has no facets.
                leaf_.distance[i] = std::isfinite(closest[i].d2) ? std::sqrt(closest[i].d2) : 0;
            }
            kernels_.pull(colours_.counts() + begin, size, reach_, leaf_);
            add_up(size);
            if (!gradient_) continue;
            for (int i = 0; i < size; ++i)
                if (leaf_.distance[i] > 0)
                    add_gradient<3>(i, colours_.rgb(begin + i), closest[i].at, closest[i].weight);
        }
    }

    /// Colours inside add zeros, which do not change the sums.
    void add_up(int size) {
        double sum = sum_, far_sum = far_sum_, count = count_, most = max_;
        for (int i = 0; i < size; ++i) {
            sum += leaf_.weighted[i];
            far_sum += leaf_.far_weighted[i];
            count += leaf_.counted[i];
            most = std::max(most, leaf_.distance[i]);
        }
        sum_ = sum;
        far_sum_ = far_sum;
        count_ = count;
        max_ = most;
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
            const ReconstructionScratch::Load& load = scratch_.loads[i];
            add((*gradient_)[f.at[0]], load.corner[0] + load.corner[1] - load.all, normal);
            for (int c = 0; c < 2; ++c) add((*gradient_)[f.at[c + 1]], -load.corner[c], normal);
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
    double sum_ = 0, far_sum_ = 0, count_ = 0, max_ = 0;
};

}  // namespace

void measure_reconstruction(const ColourTree& colours, const std::vector<Vec3>& palette,
                            const PaletteHull& hull, const LossWeights& weights,
                            const LossKernels& kernels, ReconstructionScratch& scratch,
                            FrameLoss& loss, std::vector<Vec3>* gradient) {
    Outside(colours, palette, hull, weights, kernels, scratch, gradient).run(loss);
}

}  // namespace palette4d
