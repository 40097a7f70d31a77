// Small linear programs for the progressive hulls (not installed, not used by the node).
#pragma once

#include <array>
#include <optional>
#include <vector>

namespace palette4d {

/// The points x with a . x >= b.
template <int N>
struct HalfSpace {
    std::array<double, N> a;
    double b;
};

/// Seidel's incremental linear program: the x that minimises c . x in the half-spaces and in the
/// box [low, high], or nothing. Each half-space's `a` has about unit length. Constraints are added
/// in the given order; when one is violated, the optimum lies on its boundary. A constraint counts
/// as met within 1e-10. N is 3.
template <int N>
std::optional<std::array<double, N>> minimise(const std::array<double, N>& c,
                                              const std::vector<HalfSpace<N>>& constraints,
                                              const std::array<double, N>& low,
                                              const std::array<double, N>& high);

/// The same optimum, but the most violated constraint is added next, so few are added; this pays in
/// four dimensions. Where several points are optimal, the two functions may differ. N is 4.
template <int N>
std::optional<std::array<double, N>> minimise_by_need(const std::array<double, N>& c,
                                                      const std::vector<HalfSpace<N>>& constraints,
                                                      const std::array<double, N>& low,
                                                      const std::array<double, N>& high);

}  // namespace palette4d
