// Simplified convex hulls in two to four dimensions: the progressive hull of Tan, Lien and Gingold
// (2016) for colours and time (section 6.2 of Du et al. 2021).
#pragma once

#include <array>
#include <vector>

namespace palette4d {

/// A limit for new vertices: the points x with a . x >= b.
template <int N>
struct Limit {
    std::array<double, N> a;
    double b;
};

/// Contracts edges of a convex hull until at most `target` (>= N + 1) vertices are left, or no edge
/// can be contracted. `simplices` are the hull's facets, N points each, in any orientation:
/// segments, triangles or tetrahedra for N = 2, 3 or 4. Each step takes the edge whose contraction
/// adds the least volume. The new vertex minimises that volume, while the hull still encloses the
/// old one and the vertex stays within the limits (a linear program in N variables). All axes are
/// first scaled to one length. This keeps the order of volumes, so the unit of time is free.
///
/// Returns the remaining vertices: their convex hull encloses the points to about 1e-7 of the
/// extent. The result depends on the arguments only. Throws std::invalid_argument when the facets
/// are not closed (each ridge between two) or a number is not finite.
template <int N>
std::vector<std::array<double, N>> progressive_hull_nd(
    const std::vector<std::array<double, N>>& points,
    const std::vector<std::array<int, N>>& simplices, int target,
    const std::vector<Limit<N>>& limits);

}  // namespace palette4d
