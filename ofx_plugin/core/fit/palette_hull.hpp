// The convex hull of a palette, as the reconstruction loss needs it.
#pragma once

#include <vector>

#include "fit/loss_kernels.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// A vertex or colour this close to a plane counts as in it. By rounding, a colour in the plane of
/// several facets may lie above one whose triangle is elsewhere.
constexpr double kFlat = 1e-9;

/// All vertex triples that support the hull. Coplanar vertices give overlapping triangles, which
/// does no harm to a closest point. `solid` is false for flat palettes: then every triple is a
/// facet; for colours on a line, every pair, as a degenerate triangle.
struct PaletteHull {
    std::vector<LossFacet> facets;
    bool solid = false;

    /// Replaces both.
    void build(const std::vector<Vec3>& palette);
};

}  // namespace palette4d
