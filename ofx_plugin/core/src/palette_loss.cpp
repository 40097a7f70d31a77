#include "palette4d/palette_loss.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel_choice.hpp"
#include "vec3.hpp"

namespace palette4d {
namespace {

void add(Vec3& a, double s, const Vec3& b) {
    for (int c = 0; c < 3; ++c) a[c] += s * b[c];
}

// A vertex or colour this close to a plane counts as in it. By rounding, a colour in the plane of
// several facets may lie above one whose triangle is elsewhere.
constexpr double kFlat = 1e-9;

Vec3 vec3(const double (&a)[3]) { return {a[0], a[1], a[2]}; }

LossFacet facet_of(const std::vector<Vec3>& v, const Face& at, const Vec3& normal, double offset) {
    const Vec3 ab = v[at[1]] - v[at[0]], ac = v[at[2]] - v[at[0]];
    const Vec3 n = cross(ab, ac);
    const double scale = 1 / dot(n, n);
    const Vec3 slope[2] = {scale * cross(ac, n), scale * cross(n, ab)};
    LossFacet f{};
    f.offset = offset;
    for (int c = 0; c < 3; ++c) {
        f.at[c] = at[c];
        f.normal[c] = normal[c];
        f.high[c] = normal[c] > 0;
        for (int i = 0; i < 2; ++i) f.slope[i][c] = slope[i][c];
    }
    for (int i = 0; i < 2; ++i) f.start[i] = -dot(slope[i], v[at[0]]);
    return f;
}

/// A segment, as a degenerate triangle.
LossFacet segment_of(int from, int to) {
    LossFacet f{};
    f.at[0] = f.at[1] = from;
    f.at[2] = to;
    return f;
}

/// All vertex triples that support the hull. Coplanar vertices give overlapping triangles, which
/// does no harm to a closest point. `solid` is false for flat palettes: then every triple is a
/// facet.
struct Hull {
    std::vector<LossFacet> facets;
    bool solid = false;
};

void build_hull(const std::vector<Vec3>& v, Hull& hull) {
    hull.facets.clear();
    hull.solid = false;
    const int n = static_cast<int>(v.size());
    for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j)
            for (int k = j + 1; k < n; ++k) {
                Vec3 normal = cross(v[j] - v[i], v[k] - v[i]);
                const double length = std::sqrt(dot(normal, normal));
                if (length < 1e-14) continue;
                for (double& x : normal) x /= length;
                const double offset = -dot(normal, v[i]);
                double low = 0, high = 0;
                for (int m = 0; m < n; ++m) {
                    if (m == i || m == j || m == k) continue;
                    const double d = dot(normal, v[m]) + offset;
                    low = std::min(low, d);
                    high = std::max(high, d);
                    if (low < -kFlat && high > kFlat) break;
                }
                if (low < -kFlat && high > kFlat) continue;
                if (high > kFlat) {
                    hull.facets.push_back(facet_of(v, {i, k, j}, -1 * normal, -offset));
                    hull.solid = true;
                } else if (low < -kFlat) {
                    hull.facets.push_back(facet_of(v, {i, j, k}, normal, offset));
                    hull.solid = true;
                } else {
                    hull.facets.push_back(facet_of(v, {i, j, k}, normal, offset));
                }
            }
    if (hull.solid || !hull.facets.empty()) return;
    // All on a line (or one colour): the segments between all pairs, as degenerate triangles.
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j)
            if (i != j || n == 1) hull.facets.push_back(segment_of(i, j));
}

struct Closest {
    double d2 = std::numeric_limits<double>::infinity();
    Face at{0, 0, 0};
    Vec3 weight{1, 0, 0};
};

void try_segment(const Vec3& p, const std::vector<Vec3>& v, int a, int b, Closest& best) {
    const Vec3 ab = v[b] - v[a];
    const double length2 = dot(ab, ab);
    double s = length2 > 0 ? dot(p - v[a], ab) / length2 : 0;
    s = std::clamp(s, 0.0, 1.0);
    Vec3 d = p - v[a];
    add(d, -s, ab);
    const double d2 = dot(d, d);
    if (d2 < best.d2) best = {d2, {a, b, b}, {1 - s, s, 0}};
}

void try_triangle(const Vec3& p, const std::vector<Vec3>& v, const int (&f)[3], Closest& best) {
    const Vec3 ab = v[f[1]] - v[f[0]], ac = v[f[2]] - v[f[0]], ap = p - v[f[0]];
    const Vec3 n = cross(ab, ac);
    const double nn = dot(n, n);
    if (nn > 1e-28) {
        const double wb = dot(cross(ap, ac), n) / nn;
        const double wc = dot(cross(ab, ap), n) / nn;
        if (wb >= 0 && wc >= 0 && wb + wc <= 1) {
            const double h = dot(ap, n);
            const double d2 = h * h / nn;
            if (d2 < best.d2) best = {d2, {f[0], f[1], f[2]}, {1 - wb - wc, wb, wc}};
            return;
        }
    }
    try_segment(p, v, f[0], f[1], best);
    try_segment(p, v, f[1], f[2], best);
    try_segment(p, v, f[2], f[0], best);
}

// Of E, times the distance itself: farther out a pixel's weight does not grow any more, so that
// a few pixels that are wrong (hot ones, say) cannot blow up the palette.
constexpr double kMostReach = 8;

/// Sums count * distance over the pixels outside.
class Outside {
public:
    Outside(const ColourTree& colours, const std::vector<Vec3>& v, const Hull& hull, double reach,
            const LossKernels& kernels, std::vector<Vec3>* gradient)
        : colours_(colours),
          v_(v),
          hull_(hull),
          far_(reach > 0 ? 1 / (reach * reach * reach) : 0),
          fall_(kernels.fall),
          gradient_(gradient) {}

    void run(FrameLoss& loss) {
        if (gradient_) gradient_->assign(v_.size(), Vec3{0, 0, 0});
        std::vector<int> active(hull_.facets.size());
        for (std::size_t i = 0; i < active.size(); ++i) active[i] = static_cast<int>(i);
        active_.push_back(std::move(active));
        loads_.resize(hull_.facets.size());
        visit(0, 0);
        loss.R = sum_ / colours_.total();
        loss.E = far_sum_ / colours_.total();
        loss.outside = count_ / colours_.total();
        loss.max_distance = max_;
        if (!gradient_) return;
        for (std::size_t i = 0; i < loads_.size(); ++i) {
            const LossFacet& f = hull_.facets[i];
            const Vec3 normal = vec3(f.normal);
            const Load& load = loads_[i];
            add((*gradient_)[f.at[0]], load.corner[0] + load.corner[1] - load.all, normal);
            for (int c = 0; c < 2; ++c) add((*gradient_)[f.at[c + 1]], -load.corner[c], normal);
        }
        for (Vec3& g : *gradient_)
            for (double& x : g) x /= colours_.total();
    }

private:
    // active_[depth]: the facets that some colour of the node may lie outside of.
    void visit(int index, std::size_t depth) {
        const ColourTree::Node& node = colours_.nodes()[index];
        if (active_.size() <= depth + 1) active_.emplace_back();
        const std::vector<int>& from = active_[depth];
        std::vector<int>& facets = active_[depth + 1];
        if (hull_.solid) {
            facets.clear();
            for (int f : from) {
                const LossFacet& facet = hull_.facets[f];
                // The box's corner farthest along the normal.
                double high = facet.offset;
                for (int c = 0; c < 3; ++c)
                    high += facet.normal[c] * (facet.high[c] ? node.high : node.low)[c];
                if (high > kFlat) facets.push_back(f);
            }
            if (facets.empty()) return;
        } else {
            facets = from;
        }
        if (node.left >= 0) {
            const int left = node.left, right = node.right;
            visit(left, depth + 1);
            visit(right, depth + 1);
            return;
        }
        if (hull_.solid)
            leaf(node, facets);
        else
            for (int i = node.begin; i < node.end; ++i) {
                const Vec3 p = colours_.rgb(i);
                Closest best;
                for (int f : facets) try_triangle(p, v_, hull_.facets[f].at, best);
                // An empty palette has no facets.
                if (best.d2 > 0 && std::isfinite(best.d2))
                    add_colour(colours_.counts()[i], p, best, std::sqrt(best.d2));
            }
    }

    /// The colours of a leaf against the facets that some of them may see. The closest point of a
    /// convex body lies on a facet that the colour sees; where the colour falls straight onto such
    /// a facet, that is it.
    void leaf(const ColourTree::Node& node, const std::vector<int>& facets) {
        static_assert(ColourTree::kLeafSize == LossLeaf::kSize, "a leaf at a time");
        const double* const channels[3] = {colours_.channel(0) + node.begin,
                                           colours_.channel(1) + node.begin,
                                           colours_.channel(2) + node.begin};
        const double* const count = colours_.counts().data() + node.begin;
        fall_(hull_.facets.data(), facets.data(), static_cast<int>(facets.size()), channels, kFlat,
              leaf_);
        for (int i = 0; i < node.end - node.begin; ++i) {
            if (leaf_.highest[i] <= kFlat) continue;
            if (leaf_.facet[i] >= 0) {
                const double pull = add_distance(count[i], leaf_.height[i]);
                Load& load = loads_[static_cast<std::size_t>(leaf_.facet[i])];
                load.all += pull;
                for (int c = 0; c < 2; ++c) load.corner[c] += pull * leaf_.share[c][i];
                continue;
            }
            const Vec3 p{channels[0][i], channels[1][i], channels[2][i]};
            Closest best;
            for (int index : facets) {
                const LossFacet& f = hull_.facets[index];
                if (dot(vec3(f.normal), p) + f.offset <= kFlat) continue;
                for (int e = 0; e < 3; ++e) try_segment(p, v_, f.at[e], f.at[(e + 1) % 3], best);
            }
            if (best.d2 > 0) add_colour(count[i], p, best, std::sqrt(best.d2));
        }
    }

    /// Returns the slope of R + E with d, times all pixels.
    double add_distance(double n, double d) {
        const double cubed = far_ * d * d * d, bound = 1 / (1 + cubed / kMostReach);
        const double far = cubed * bound;
        sum_ += n * d;
        far_sum_ += n * far * d;
        if (d > 1e-6) count_ += n;
        max_ = std::max(max_, d);
        return n * (1 + far * (1 + 3 * bound));
    }

    void add_colour(double n, const Vec3& p, const Closest& closest, double d) {
        const double pull = add_distance(n, d);
        if (!gradient_) return;
        Vec3 u = p;
        for (int c = 0; c < 3; ++c) add(u, -closest.weight[c], v_[closest.at[c]]);
        for (int c = 0; c < 3; ++c)
            add((*gradient_)[closest.at[c]], -pull * closest.weight[c] / d, u);
    }

    /// How the colours above a facet pull at it, in all and on its corners 1 and 2: together with
    /// the normal, their gradient.
    struct Load {
        double all = 0;
        double corner[2] = {0, 0};
    };

    const ColourTree& colours_;
    const std::vector<Vec3>& v_;
    const Hull& hull_;
    const double far_;  ///< of d^4 in E
    decltype(LossKernels::fall) const fall_;
    std::vector<Vec3>* gradient_;
    std::vector<std::vector<int>> active_;
    std::vector<Load> loads_;  // one a facet
    LossLeaf leaf_;
    double sum_ = 0, far_sum_ = 0, count_ = 0, max_ = 0;
};

/// Six times the volumes by which faces fold inwards, summed over the mesh's edges.
double concavity(const std::vector<Vec3>& v, const std::vector<Face>& faces, double scale,
                 std::vector<Vec3>* gradient) {
    double sum = 0;
    for (const Face& f : faces)
        for (int e = 0; e < 3; ++e) {
            const int a = f[e], b = f[(e + 1) % 3], c = f[(e + 2) % 3];
            if (a > b) continue;  // each edge once
            for (const Face& g : faces)
                for (int m = 0; m < 3; ++m) {
                    if (g[m] != b || g[(m + 1) % 3] != a) continue;
                    const int d = g[(m + 2) % 3];
                    if (d == c) continue;
                    const Vec3 ab = v[b] - v[a], ac = v[c] - v[a], ad = v[d] - v[a];
                    const Vec3 gd = cross(ab, ac);
                    const double volume = dot(gd, ad);
                    if (volume <= 0) continue;  // d lies below the face: convex here
                    sum += volume;
                    if (!gradient) continue;
                    const Vec3 gb = cross(ac, ad), gc = cross(ad, ab);
                    add((*gradient)[b], scale, gb);
                    add((*gradient)[c], scale, gc);
                    add((*gradient)[d], scale, gd);
                    add((*gradient)[a], -scale, gb);
                    add((*gradient)[a], -scale, gc);
                    add((*gradient)[a], -scale, gd);
                }
        }
    return sum;
}

/// S of palette_loss.hpp. Colours that are one (a split or a merge) cannot be told which way to
/// part.
double closeness(const std::vector<Vec3>& v, double separation, std::vector<Vec3>* gradient) {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i)
        for (std::size_t j = i + 1; j < v.size(); ++j) {
            const Vec3 apart = v[j] - v[i];
            const double d = norm(apart);
            if (d >= separation) continue;
            const double missing = separation - d;
            sum += missing * missing / (2 * separation);
            if (!gradient || d < 1e-9) continue;
            const double slope = -missing / separation / d;
            add((*gradient)[j], slope, apart);
            add((*gradient)[i], -slope, apart);
        }
    return sum;
}

/// How far apart colours should stay in this frame: where its own colours are all near each other,
/// as in black, palette colours pushed farther apart would leave them.
double separation_within(const ColourTree& colours, double separation) {
    const ColourTree::Node& all = colours.nodes()[0];
    double extent = 0;
    for (int c = 0; c < 3; ++c) extent = std::max(extent, all.high[c] - all.low[c]);
    return std::min(separation, extent / 4);
}

}  // namespace

FrameLoss palette_loss(const ColourTree& colours, const std::vector<Vec3>& palette,
                       const std::vector<Face>& faces, const LossWeights& weights,
                       std::vector<Vec3>* gradient, InstructionSet instructions) {
    FrameLoss loss;
    Hull hull;
    build_hull(palette, hull);
    Outside(colours, palette, hull, weights.reach, kernels_of(instructions).loss, gradient)
        .run(loss);
    if (gradient)
        for (Vec3& g : *gradient)
            for (double& x : g) x *= weights.lambda;
    const double n = static_cast<double>(palette.size());
    for (std::size_t i = 0; i < palette.size(); ++i) {
        const Vec3 d = palette[i] - colours.nearest_mean(palette[i], weights.k);
        const double length = std::sqrt(dot(d, d));
        loss.C += length / n;
        if (gradient && length > 1e-12) add((*gradient)[i], 1 / (n * length), d);
    }
    if (weights.convexity > 0)
        loss.D = concavity(palette, faces, weights.convexity, gradient);
    else
        loss.D = concavity(palette, faces, 0, nullptr);
    const double separation = separation_within(colours, weights.separation);
    if (separation > 0) loss.S = closeness(palette, separation, gradient);
    return loss;
}

}  // namespace palette4d
