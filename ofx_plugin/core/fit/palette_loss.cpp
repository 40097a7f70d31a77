#include "fit/palette_loss.hpp"

#include <algorithm>
#include <cmath>

#include "fit/reconstruction.hpp"
#include "model/vec3.hpp"
#include "simd/instruction_set.hpp"

namespace palette4d {
namespace {

/// Sum over the mesh's edges of six times the volume by which its two faces fold inwards. `across`
/// is memory: the third corner of the face with each directed edge.
double concavity(const std::vector<Vec3>& v, const std::vector<Face>& faces, double scale,
                 std::vector<int>& across, std::vector<Vec3>* gradient) {
    const std::size_t n = v.size();
    across.assign(n * n, -1);
    for (const Face& f : faces)
        for (int e = 0; e < 3; ++e) across[n * f[e] + f[(e + 1) % 3]] = f[(e + 2) % 3];
    double sum = 0;
    for (const Face& f : faces)
        for (int e = 0; e < 3; ++e) {
            const int a = f[e], b = f[(e + 1) % 3], c = f[(e + 2) % 3];
            if (a > b) continue;  // each edge once
            const int d = across[n * b + a];
            if (d < 0 || d == c) continue;
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
    return sum;
}

/// S of palette_loss.hpp. Two equal colours (a split or a merge) have no direction to part in, so
/// they add no gradient.
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

/// The separation to use in this frame. Where all its colours are close, as in black, a larger one
/// would push palette colours away from them.
double separation_within(const ColourTree& colours, double separation) {
    double extent = 0;
    for (int c = 0; c < 3; ++c) extent = std::max(extent, colours.high()[c] - colours.low()[c]);
    return std::min(separation, extent / 4);
}

}  // namespace

FrameLoss palette_loss(const ColourTree& colours, const std::vector<Vec3>& palette,
                       const std::vector<Face>& faces, const LossWeights& weights,
                       std::vector<Vec3>* gradient, InstructionSet instructions) {
    // A frame's loss takes microseconds, so allocations would be a large share.
    struct Scratch {
        PaletteHull hull;
        ReconstructionScratch reconstruction;
        ColourTree::Nearest nearest;
        std::vector<int> across;
    };
    thread_local Scratch of_this_thread;
    Scratch& scratch = of_this_thread;  // once: each use of a thread_local may be a call
    FrameLoss loss;
    const LossKernels& kernels = kernels_of<LossKernels>(instructions);
    scratch.hull.build(palette);
    measure_reconstruction(colours, palette, scratch.hull, weights, kernels, scratch.reconstruction,
                           loss, gradient);
    if (gradient)
        for (Vec3& g : *gradient)
            for (double& x : g) x *= weights.lambda;
    const double n = static_cast<double>(palette.size());
    for (std::size_t i = 0; i < palette.size(); ++i) {
        const Vec3 d =
            palette[i] - colours.nearest_mean(palette[i], weights.k, kernels, scratch.nearest);
        const double length = std::sqrt(dot(d, d));
        loss.C += length / n;
        if (gradient && length > 1e-12) add((*gradient)[i], 1 / (n * length), d);
    }
    loss.D = concavity(palette, faces, weights.convexity, scratch.across,
                       weights.convexity > 0 ? gradient : nullptr);
    const double separation = separation_within(colours, weights.separation);
    if (separation > 0) loss.S = closeness(palette, separation, gradient);
    return loss;
}

}  // namespace palette4d
