#include "fit/linear_program.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palette4d {
namespace {

constexpr double kSlack = 1e-10;  // constraints met within this count as met

template <int N>
using Solution = std::optional<PointOf<N>>;

template <int N>
double margin(const HalfSpace<N>& h, const PointOf<N>& x) {
    double value = -h.b;
    for (int i = 0; i < N; ++i) value += h.a[i] * x[i];
    return value;
}

/// The optimum in the box, without constraints.
template <int N>
PointOf<N> corner(const PointOf<N>& c, const PointOf<N>& low, const PointOf<N>& high) {
    PointOf<N> x;
    for (int i = 0; i < N; ++i) x[i] = c[i] >= 0 ? low[i] : high[i];
    return x;
}

template <int N>
Solution<N> on_boundary(const PointOf<N>& c, const HalfSpace<N>& h,
                        const std::vector<HalfSpace<N>>& constraints, std::size_t count,
                        const PointOf<N>& low, const PointOf<N>& high);

template <int N>
Solution<N> solve(const PointOf<N>& c, const std::vector<HalfSpace<N>>& constraints,
                  const PointOf<N>& low, const PointOf<N>& high) {
    PointOf<N> x = corner<N>(c, low, high);
    for (std::size_t m = 0; m < constraints.size(); ++m) {
        if (margin<N>(constraints[m], x) >= -kSlack) continue;
        const auto next = on_boundary<N>(c, constraints[m], constraints, m, low, high);
        if (!next) return std::nullopt;
        x = *next;
    }
    return x;
}

template <>
Solution<1> solve<1>(const PointOf<1>& c, const std::vector<HalfSpace<1>>& constraints,
                     const PointOf<1>& low, const PointOf<1>& high) {
    double lo = low[0], hi = high[0];
    for (const auto& h : constraints) {
        if (std::abs(h.a[0]) < 1e-13) {
            if (h.b > kSlack) return std::nullopt;
        } else if (h.a[0] > 0) {
            lo = std::max(lo, h.b / h.a[0]);
        } else {
            hi = std::min(hi, h.b / h.a[0]);
        }
    }
    if (lo > hi + kSlack) return std::nullopt;
    return PointOf<1>{c[0] >= 0 ? lo : hi};
}

/// The optimum on the boundary of h, under the first `count` constraints and the box. It is a
/// program with one dimension less: eliminates the variable with the largest coefficient in h.
template <int N>
Solution<N> on_boundary(const PointOf<N>& c, const HalfSpace<N>& h,
                        const std::vector<HalfSpace<N>>& constraints, std::size_t count,
                        const PointOf<N>& low, const PointOf<N>& high) {
    // x_e = (b - sum a_i x_i) / a_e
    int e = 0;
    for (int i = 1; i < N; ++i)
        if (std::abs(h.a[i]) > std::abs(h.a[e])) e = i;
    if (std::abs(h.a[e]) < 1e-13) return std::nullopt;
    auto project = [&](const PointOf<N>& a, double b) {
        HalfSpace<N - 1> out;
        const double s = a[e] / h.a[e];
        for (int i = 0, j = 0; i < N; ++i)
            if (i != e) out.a[j++] = a[i] - s * h.a[i];
        out.b = b - s * h.b;
        return out;
    };
    std::vector<HalfSpace<N - 1>> rest;
    rest.reserve(count + 2);
    for (std::size_t q = 0; q < count; ++q)
        rest.push_back(project(constraints[q].a, constraints[q].b));
    PointOf<N> unit{};
    unit[e] = 1;
    rest.push_back(project(unit, low[e]));
    unit[e] = -1;
    rest.push_back(project(unit, -high[e]));
    const HalfSpace<N - 1> objective = project(c, 0);
    PointOf<N - 1> sublow, subhigh;
    for (int i = 0, j = 0; i < N; ++i)
        if (i != e) {
            sublow[j] = low[i];
            subhigh[j++] = high[i];
        }
    const auto sub_x = solve<N - 1>(objective.a, rest, sublow, subhigh);
    if (!sub_x) return std::nullopt;
    PointOf<N> x;
    double sum = h.b;
    for (int i = 0, j = 0; i < N; ++i)
        if (i != e) {
            x[i] = (*sub_x)[j++];
            sum -= h.a[i] * x[i];
        }
    x[e] = sum / h.a[e];
    return x;
}

}  // namespace

Solution<3> minimise(const PointOf<3>& c, const std::vector<HalfSpace<3>>& constraints,
                     const PointOf<3>& low, const PointOf<3>& high) {
    return solve<3>(c, constraints, low, high);
}

Solution<4> minimise_by_need(const PointOf<4>& c, const std::vector<HalfSpace<4>>& constraints,
                             const PointOf<4>& low, const PointOf<4>& high) {
    PointOf<4> x = corner<4>(c, low, high);
    std::vector<HalfSpace<4>> taken;
    std::vector<bool> is_taken(constraints.size(), false);
    while (true) {
        double least = -kSlack;
        std::size_t worst = constraints.size();
        for (std::size_t m = 0; m < constraints.size(); ++m) {
            if (is_taken[m]) continue;
            const double value = margin<4>(constraints[m], x);
            if (value >= least) continue;
            least = value;
            worst = m;
        }
        if (worst == constraints.size()) return x;
        const auto next = on_boundary<4>(c, constraints[worst], taken, taken.size(), low, high);
        if (!next) return std::nullopt;
        x = *next;
        taken.push_back(constraints[worst]);
        is_taken[worst] = true;
    }
}

}  // namespace palette4d
