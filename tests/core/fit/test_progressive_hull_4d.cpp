// By hand, and refusals; tests/analysis/baselines compares hulls with SciPy's.
#include "fit/progressive_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "check.hpp"

using namespace palette4d;

namespace {

constexpr int N = 4;
using Point = std::array<double, N>;

struct Mesh {
    std::vector<Point> points;
    std::vector<std::array<int, N>> simplices;
};

Mesh simplex() {
    Mesh mesh;
    mesh.points.assign(N + 1, Point{});
    for (int i = 0; i < N; ++i) mesh.points[i + 1][i] = 1;
    for (int skip = 0; skip <= N; ++skip) {
        std::array<int, N> facet;
        for (int i = 0, to = 0; i <= N; ++i)
            if (i != skip) facet[to++] = i;
        mesh.simplices.push_back(facet);
    }
    return mesh;
}

}  // namespace

TEST(a_simplex_stays_as_it_is) {
    for (const int target : {-5, 0, 5, 100}) {
        const Mesh mesh = simplex();
        const auto hull = progressive_hull_4d(mesh.points, mesh.simplices, target, {});
        CHECK_EQUAL(hull.size(), std::size_t{5});
        for (std::size_t i = 0; i < hull.size(); ++i)
            for (std::size_t c = 0; c < 4; ++c) CHECK_NEAR(hull[i][c], mesh.points[i][c], 1e-15);
    }
}

/// A simplex with its last corner cut off at nine tenths: the cheapest hull around it is the whole.
TEST(a_cut_corner_grows_back_in_4d) {
    Mesh mesh;
    const Mesh whole = simplex();
    mesh.points.assign(whole.points.begin(), whole.points.end() - 1);
    for (int i = 0; i < N; ++i) {
        Point p{};
        p[N - 1] = 0.9;
        if (i > 0) p[i - 1] = 0.1;
        mesh.points.push_back(p);
    }
    // The prism's sides are cut by lowest index first, which neighbours agree on.
    std::array<int, N> base, top;
    for (int i = 0; i < N; ++i) {
        base[i] = i;
        top[i] = N + i;
    }
    mesh.simplices = {base, top};
    for (int skip = 0; skip < N; ++skip) {
        std::array<int, N - 1> side;
        for (int i = 0, to = 0; i < N; ++i)
            if (i != skip) side[to++] = i;
        for (int step = 0; step < N - 1; ++step) {
            std::array<int, N> facet;
            for (int i = 0, to = 0; i < N - 1; ++i) {
                if (i <= step) facet[to++] = side[i];
                if (i >= step) facet[to++] = N + side[i];
            }
            mesh.simplices.push_back(facet);
        }
    }
    const auto hull = progressive_hull_4d(mesh.points, mesh.simplices, N + 1, {});
    CHECK_EQUAL(hull.size(), static_cast<std::size_t>(N + 1));
    for (const auto& corner : whole.points) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& p : hull) {
            double d2 = 0;
            for (int c = 0; c < N; ++c) d2 += (p[c] - corner[c]) * (p[c] - corner[c]);
            nearest = std::min(nearest, d2);
        }
        CHECK_NEAR(std::sqrt(nearest), 0, 1e-8);
    }
}

TEST(bad_hulls_are_refused) {
    const Mesh mesh = simplex();
    const auto call = [](const Mesh& m, const std::vector<HalfSpace<4>>& limits) {
        progressive_hull_4d(m.points, m.simplices, 20, limits);
    };
    CHECK_THROWS(std::invalid_argument, call({}, {}));
    Mesh bad = mesh;
    bad.simplices.pop_back();
    CHECK_THROWS(std::invalid_argument, call(bad, {}));
    bad = mesh;
    bad.simplices.push_back(bad.simplices[0]);
    CHECK_THROWS(std::invalid_argument, call(bad, {}));
    for (const int corner : {-1, N + 1}) {
        bad = mesh;
        bad.simplices[0][0] = corner;
        CHECK_THROWS(std::invalid_argument, call(bad, {}));
    }
    for (const double number :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        bad = mesh;
        bad.points[1][0] = number;
        CHECK_THROWS(std::invalid_argument, call(bad, {}));
        CHECK_THROWS(std::invalid_argument, call(mesh, {HalfSpace<4>{{}, number}}));
    }
}
