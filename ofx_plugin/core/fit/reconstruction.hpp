// A palette's convex hull, and eq. 2 and related measures: how far a frame's colours lie outside
// it.
#pragma once

#include <vector>

#include "fit/loss_kernels.hpp"
#include "fit/palette_loss.hpp"

namespace palette4d {

/// A vertex or colour this close to a plane counts as in it. Because of rounding, a colour in the
/// plane of several facets may lie above one that is elsewhere in the plane.
constexpr double kFlat = 1e-9;

/// All vertex triples that support the hull. Coplanar vertices give overlapping triangles, which is
/// harmless for closest points. `solid` is false for flat palettes: every triple is then a facet.
/// For colours on a line, every pair is a degenerate triangle. `edges` has each side of a facet
/// once.
struct PaletteHull {
    std::vector<LossFacet> facets;
    std::vector<LossEdge> edges;
    bool solid = false;

    void build(const std::vector<Vec3>& palette);
};

/// Memory that is reused from one reconstruction to the next.
struct ReconstructionScratch {
    std::vector<int> facets;        // one list per level of the tree
    std::vector<unsigned> reached;  // one list per level too
    std::vector<LossLoad> loads;    // one per facet
};

/// Sets R, E, outside and max_distance of `loss`, with `reach` and `slight` of the weights.
/// `gradient`, unless null, receives the derivatives of R + E. `hull` must be built from `palette`.
void measure_reconstruction(const ColourTree& colours, const std::vector<Vec3>& palette,
                            const PaletteHull& hull, const LossWeights& weights,
                            const LossKernels& kernels, ReconstructionScratch& scratch,
                            FrameLoss& loss, std::vector<Vec3>* gradient);

}  // namespace palette4d
