// Simplified convex hulls (Tan, Lien and Gingold 2016): a progressive hull of a convex mesh.
#pragma once

#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Contracts edges of a closed convex triangle mesh until at most `target` (>= 4) vertices are
/// left. Each step takes the edge whose contraction adds the least volume. The new vertex minimises
/// that volume while the mesh still encloses the old one (a linear program in three variables).
/// Returns the vertices of the enclosing polyhedron, which may lie outside the unit cube. Throws
/// std::invalid_argument when the mesh is not closed or a vertex is not finite.
std::vector<Vec3> progressive_hull(const std::vector<Vec3>& rgb, const std::vector<Face>& faces,
                                   int target);

}  // namespace palette4d
