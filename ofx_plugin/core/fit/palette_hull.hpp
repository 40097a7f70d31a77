// The convex hull of a palette, as the reconstruction loss needs it.
#pragma once

#include <vector>

#include "fit/loss_kernels.hpp"
#include "model/polytope.hpp"

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

}  // namespace palette4d
