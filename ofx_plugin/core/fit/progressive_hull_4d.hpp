// Simplified convex hulls in two to four dimensions: the progressive hull of Tan, Lien and Gingold
// (2016) for colours and time (section 6.2 of Du et al. 2021).
#pragma once

#include <array>
#include <vector>

namespace palette4d {

/// A limit on where new vertices may lie: the points x with a . x >= b.
template <int N>
struct Limit {
    std::array<double, N> a;
    double b;
};

/// Contracts edges of a convex hull until at most `target` (>= N + 1) vertices are left, or no edge
/// can be contracted any more. `simplices` are the hull's facets, N points each: segments for N =
/// 2, triangles for N = 3, tetrahedra for N = 4; their orientation does not matter. Each step takes
/// the edge whose contraction adds the least volume; the new vertex minimises that volume under the
/// linear constraints that the hull still encloses the old one and that the vertex keeps the limits
/// (a linear program in N variables). Volumes are those after the axes are scaled to one length
/// each, which does not change their order, so the unit of time is free.
///
/// Returns the vertices that are left: their convex hull encloses the points to about 1e-7 of the
/// extent. The result depends on nothing but the arguments. Throws std::invalid_argument when the
/// facets are not closed (each ridge between two), or a number is not finite. N is 2, 3 or 4.
template <int N>
std::vector<std::array<double, N>> progressive_hull_nd(
    const std::vector<std::array<double, N>>& points,
    const std::vector<std::array<int, N>>& simplices, int target,
    const std::vector<Limit<N>>& limits);

}  // namespace palette4d
