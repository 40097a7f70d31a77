#include "fit/progressive_hull.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

constexpr int N = 4;
using Point = std::array<double, N>;

struct Mesh {
    std::vector<Point> points;
    std::vector<std::array<int, N>> simplices;
};

/// The plane through N points as N + 1 numbers, a . x + b = 0, by elimination; all 0 when the
/// points lie in less than a plane. (The core takes cofactors.)
std::array<double, N + 1> plane_through(const std::array<Point, N>& p) {
    std::array<std::array<double, N + 1>, N> m;
    for (int r = 0; r < N; ++r) {
        std::copy(p[r].begin(), p[r].end(), m[r].begin());
        m[r][N] = 1;
    }
    std::array<int, N> pivot_of;
    std::array<bool, N + 1> taken{};
    for (int r = 0; r < N; ++r) {
        int pivot = -1, row = r;
        for (int s = r; s < N; ++s)
            for (int c = 0; c <= N; ++c)
                if (!taken[c] && (pivot < 0 || std::abs(m[s][c]) > std::abs(m[row][pivot])))
                    row = s, pivot = c;
        if (std::abs(m[row][pivot]) < 1e-9) return {};
        std::swap(m[r], m[row]);
        taken[pivot] = true;
        pivot_of[r] = pivot;
        for (int s = 0; s < N; ++s) {
            if (s == r) continue;
            const double factor = m[s][pivot] / m[r][pivot];
            for (int c = 0; c <= N; ++c) m[s][c] -= factor * m[r][c];
        }
    }
    std::array<double, N + 1> plane{};
    const int open = static_cast<int>(std::find(taken.begin(), taken.end(), false) - taken.begin());
    plane[open] = 1;
    for (int r = 0; r < N; ++r) plane[pivot_of[r]] = -m[r][open] / m[r][pivot_of[r]];
    double length = 0;
    for (int c = 0; c < N; ++c) length += plane[c] * plane[c];
    for (double& x : plane) x /= std::sqrt(length);
    return plane;
}

double height(const std::array<double, N + 1>& plane, const Point& p) {
    double sum = plane[N];
    for (int c = 0; c < N; ++c) sum += plane[c] * p[c];
    return sum;
}

/// Calls action(indices, plane turned outwards) for every facet of the convex hull: every choice of
/// N points whose plane has all others on one side.
template <class Action>
void each_facet(const std::vector<Point>& points, Action action) {
    std::array<int, N> at;
    for (int i = 0; i < N; ++i) at[i] = i;
    const int n = static_cast<int>(points.size());
    while (true) {
        std::array<Point, N> corners;
        for (int i = 0; i < N; ++i) corners[i] = points[at[i]];
        auto plane = plane_through(corners);
        double low = 0, high = 0;
        for (const Point& p : points) {
            low = std::min(low, height(plane, p));
            high = std::max(high, height(plane, p));
        }
        if (high > -low)
            for (double& x : plane) x = -x;
        if (std::min(high, -low) < 1e-9 && std::max(high, -low) > 0) action(at, plane);
        int i = N - 1;
        while (i >= 0 && at[i] == n - N + i) --i;
        if (i < 0) return;
        ++at[i];
        for (int j = i + 1; j < N; ++j) at[j] = at[j - 1] + 1;
    }
}

/// The hull of random points on a sphere: all of them are its vertices.
Mesh random_hull(std::uint64_t seed, int count) {
    shapes::Random random(seed);
    Mesh mesh;
    while (static_cast<int>(mesh.points.size()) < count) {
        Point p;
        double length = 0;
        for (double& x : p) {
            x = random.uniform(-1, 1);
            length += x * x;
        }
        if (length > 1 || length < 0.01) continue;
        for (double& x : p) x = 0.5 + 0.4 * x / std::sqrt(length);
        mesh.points.push_back(p);
    }
    each_facet(mesh.points,
               [&](const std::array<int, N>& at, const auto&) { mesh.simplices.push_back(at); });
    return mesh;
}

double farthest_outside(const std::vector<Point>& inner, const std::vector<Point>& outer) {
    double worst = -std::numeric_limits<double>::infinity();
    int facets = 0;
    each_facet(outer, [&](const std::array<int, N>&, const auto& plane) {
        ++facets;
        for (const Point& p : inner) worst = std::max(worst, height(plane, p));
    });
    CHECK(facets > N);
    return worst;
}

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

void encloses(int points, const std::vector<int>& targets) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const Mesh mesh = random_hull(seed, points);
        for (const int target : targets) {
            const auto hull = progressive_hull_4d(mesh.points, mesh.simplices, target, {});
            CHECK_EQUAL(hull.size(), static_cast<std::size_t>(target));
            CHECK(farthest_outside(mesh.points, hull) < 1e-7);
        }
    }
}

void keeps_limits() {
    constexpr double margin = 0.01;
    double beyond = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const Mesh mesh = random_hull(seed, 14);
        double low = 1, high = 0;
        for (const auto& p : mesh.points) {
            low = std::min(low, p[N - 1]);
            high = std::max(high, p[N - 1]);
        }
        low -= margin;
        high += margin;
        // Not of unit length: a limit is a half-space, however it is written.
        HalfSpace<4> floor{}, ceiling{};
        floor.a[N - 1] = 2;
        floor.b = 2 * low;
        ceiling.a[N - 1] = -3;
        ceiling.b = -3 * high;
        for (const auto& p : progressive_hull_4d(mesh.points, mesh.simplices, N + 3, {}))
            beyond = std::max({beyond, low - p[N - 1], p[N - 1] - high});
        const auto kept = progressive_hull_4d(mesh.points, mesh.simplices, N + 3, {floor, ceiling});
        CHECK(kept.size() < mesh.points.size());
        for (const auto& p : kept) {
            CHECK(p[N - 1] > low - 1e-8);
            CHECK(p[N - 1] < high + 1e-8);
        }
        CHECK(farthest_outside(mesh.points, kept) < 1e-7);
    }
    CHECK(beyond > margin);  // without limits they do not
}

void refuses() {
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

/// A simplex with its last corner cut off at nine tenths: the cheapest hull around it is the whole.
void cut_corner_grows_back() {
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

TEST(a_cut_corner_grows_back_in_4d) { cut_corner_grows_back(); }

TEST(hulls_enclose_their_points_with_as_many_vertices_as_asked) { encloses(16, {14, 11, 9}); }

TEST(new_vertices_keep_their_limits) { keeps_limits(); }

TEST(a_limit_that_allows_nothing_leaves_the_hull_as_it_is) {
    const Mesh mesh = random_hull(3, 12);
    HalfSpace<4> nowhere{};
    nowhere.a[0] = 1;
    nowhere.b = 100;
    const auto hull = progressive_hull_4d(mesh.points, mesh.simplices, 8, {nowhere});
    CHECK_EQUAL(hull.size(), mesh.points.size());
    for (std::size_t i = 0; i < hull.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) CHECK_NEAR(hull[i][c], mesh.points[i][c], 1e-14);
}

TEST(the_unit_of_an_axis_does_not_matter) {
    const Mesh mesh = random_hull(5, 16);
    const auto small = progressive_hull_4d(mesh.points, mesh.simplices, 9, {});
    std::vector<Point> frames = mesh.points;
    // A power of two, so that the numbers in a unit cube are the same to the last bit.
    for (auto& p : frames) p[3] *= 64;
    const auto large = progressive_hull_4d(frames, mesh.simplices, 9, {});
    CHECK_EQUAL(large.size(), small.size());
    for (std::size_t i = 0; i < std::min(small.size(), large.size()); ++i)
        for (std::size_t c = 0; c < 4; ++c)
            CHECK_EQUAL(large[i][c], (c == 3 ? 64 : 1) * small[i][c]);
}

TEST(points_without_volume_end_without_a_crash) {
    Mesh mesh = random_hull(2, 10);
    for (auto& p : mesh.points) p[1] = 0.25;
    for (const auto& p : progressive_hull_4d(mesh.points, mesh.simplices, 6, {}))
        for (const double x : p) CHECK(std::isfinite(x));
    for (auto& p : mesh.points) p.fill(0.5);
    for (const auto& p : progressive_hull_4d(mesh.points, mesh.simplices, 6, {}))
        for (const double x : p) CHECK(std::isfinite(x));
}

TEST(bad_hulls_are_refused) { refuses(); }
