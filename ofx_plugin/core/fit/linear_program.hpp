// Small linear programs for the progressive hulls (not installed, not used by the node).
#pragma once

#include <array>
#include <optional>
#include <vector>

namespace palette4d {

template <int N>
using PointOf = std::array<double, N>;

/// The points x with a . x >= b.
template <int N>
struct HalfSpace {
    PointOf<N> a;
    double b;
};

/// Seidel's incremental linear program: the x that minimises c . x in the half-spaces and in the
/// box [low, high], or nothing. Each half-space's `a` has about unit length. Constraints are added
/// in the given order; when one is violated, the optimum lies on its boundary. A constraint counts
/// as met within 1e-10.
std::optional<PointOf<3>> minimise(const PointOf<3>& c,
                                   const std::vector<HalfSpace<3>>& constraints,
                                   const PointOf<3>& low, const PointOf<3>& high);

/// The same optimum, but the most violated constraint is added next, so few are added; this pays in
/// four dimensions. Where several points are optimal, the two functions may differ.
std::optional<PointOf<4>> minimise_by_need(const PointOf<4>& c,
                                           const std::vector<HalfSpace<4>>& constraints,
                                           const PointOf<4>& low, const PointOf<4>& high);

}  // namespace palette4d
