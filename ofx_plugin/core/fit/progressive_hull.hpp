// Simplified convex hulls (Tan, Lien and Gingold 2016): a progressive hull of a convex mesh, and
// one in RGB and time (section 6.2 of Du et al. 2021).
#pragma once

#include <array>
#include <vector>

#include "fit/linear_program.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// Contracts edges of a closed convex triangle mesh until at most `target` (>= 4) vertices are
/// left. Each step takes the edge whose contraction adds the least volume. The new vertex minimises
/// that volume while the mesh still encloses the old one (a linear program in three variables).
/// Returns the vertices of the enclosing polyhedron, which may lie outside the unit cube. Throws
/// std::invalid_argument when the mesh is not closed or a vertex is not finite.
std::vector<Vec3> progressive_hull(const std::vector<Vec3>& rgb, const std::vector<Face>& faces,
                                   int target);

/// Contracts edges of a convex hull until at most `target` (>= 5) vertices are left, or no edge can
/// be contracted. `simplices` are the hull's facets, tetrahedra in any orientation. Each step takes
/// the edge whose contraction adds the least volume. The new vertex minimises that volume, while
/// the hull still encloses the old one and the vertex stays within the limits (a linear program in
/// four variables). All axes are first scaled to one length. This keeps the order of volumes, so
/// the unit of time is free.
///
/// Returns the remaining vertices: their convex hull encloses the points to about 1e-7 of the
/// extent. The result depends on the arguments only. Throws std::invalid_argument when the facets
/// are not closed (each ridge between two) or a number is not finite.
std::vector<std::array<double, 4>> progressive_hull_4d(
    const std::vector<std::array<double, 4>>& points,
    const std::vector<std::array<int, 4>>& simplices, int target,
    const std::vector<HalfSpace<4>>& limits);

}  // namespace palette4d
