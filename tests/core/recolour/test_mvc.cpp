// What holds of any weights; tests/parity has their values.
#include "recolour/mvc.hpp"

#include <limits>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

using Weights = std::vector<double>;

struct Projected {
    Projection at;
    Weights w;
};

Projected project(const Mesh& mesh, const Vec3& p) {
    Projected result;
    result.w.resize(mesh.rgb.size());
    PaletteBody::Workspace workspace;
    result.at = PaletteBody(mesh.rgb, mesh.faces).project(p, result.w.data(), workspace);
    return result;
}

Weights weights(const Mesh& mesh, const Vec3& p) { return project(mesh, p).w; }

double sum(const Weights& w) {
    double total = 0;
    for (const double x : w) total += x;
    return total;
}

Vec3 combined(const Mesh& mesh, const Weights& w) {
    Vec3 p{};
    for (std::size_t i = 0; i < w.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) p[c] += w[i] * mesh.rgb[i][c];
    }
    return p;
}

double apart(const Vec3& a, const Vec3& b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

double apart(const Weights& a, const Weights& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
    return most;
}

Vec3 mix(const Vec3& a, const Vec3& b, double t) {
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

Vec3 shifted(const Vec3& p, const Vec3& by, double s) {
    return {p[0] + s * by[0], p[1] + s * by[1], p[2] + s * by[2]};
}

Vec3 middle(const Mesh& mesh) {
    return combined(mesh, Weights(mesh.rgb.size(), 1.0 / static_cast<double>(mesh.rgb.size())));
}

/// Somewhere inside a convex mesh.
Vec3 inner_point(const Mesh& mesh, Random& random) {
    Weights w(mesh.rgb.size());
    for (double& x : w) x = -std::log(1 - random.uniform());
    const double total = sum(w);
    for (double& x : w) x /= total;
    return combined(mesh, w);
}

}  // namespace

TEST(weights_sum_to_one_and_reproduce_the_point) {
    Random random(2);
    for (int round = 0; round < 500; ++round) {
        const Mesh mesh = random_convex(random, 4 + random.below(20));
        for (int i = 0; i < 20; ++i) {
            const Vec3 p = inner_point(mesh, random);
            const Weights w = weights(mesh, p);
            CHECK_NEAR(sum(w), 1, 1e-13);
            CHECK(apart(combined(mesh, w), p) < 1e-12);
            for (const double x : w) CHECK(x >= -1e-13);
        }
    }
}

TEST(a_concave_body_reproduces_its_points_too) {
    const Mesh mesh = concave_cube();
    Random random(3);
    int inside = 0;
    for (int i = 0; i < 3000; ++i) {
        const Vec3 p = random.colour();
        const Projected at = project(mesh, p);
        CHECK_NEAR(sum(at.w), 1, 1e-12);
        CHECK(apart(combined(mesh, at.w), at.at.q) < 1e-11);
        // The pyramid below the top square, from (0.5, 0.5, 0.3) up, is outside.
        const double side = std::max(std::abs(p[0] - 0.5), std::abs(p[1] - 0.5));
        const double roof = 0.3 + 0.7 * side / 0.5;
        if (std::abs(p[2] - roof) > 1e-6) CHECK_EQUAL(at.at.inside, p[2] < roof);
        inside += at.at.inside;
    }
    CHECK(inside > 1000);
}

TEST(on_a_vertex_the_weight_is_its_own) {
    Random random(4);
    for (int round = 0; round < 100; ++round) {
        const Mesh mesh = random_convex(random, 4 + random.below(12));
        for (std::size_t i = 0; i < mesh.rgb.size(); ++i) {
            const Weights w = weights(mesh, mesh.rgb[i]);
            for (std::size_t j = 0; j < w.size(); ++j) CHECK_EQUAL(w[j], i == j ? 1.0 : 0.0);
            const Projected at = project(mesh, mesh.rgb[i]);
            CHECK_NEAR(at.w[i], 1, 1e-12);
            CHECK(at.at.inside);
            CHECK_EQUAL(at.at.distance, 0.0);
        }
    }
}

TEST(on_and_near_edges_and_faces_weights_are_barycentric) {
    Random random(5);
    for (int round = 0; round < 200; ++round) {
        const Mesh mesh = random_convex(random, 4 + random.below(12));
        const Vec3 centre = middle(mesh);
        for (const Face& face : mesh.faces) {
            const double t = random.uniform(0.1, 0.9);
            Weights on_edge(mesh.rgb.size()), on_face(mesh.rgb.size());
            on_edge[face[0]] = 1 - t;
            on_edge[face[1]] = t;
            double u = random.uniform(0.05, 1), v = random.uniform(0.05, 1),
                   w = random.uniform(0.05, 1);
            on_face[face[0]] = u / (u + v + w);
            on_face[face[1]] = v / (u + v + w);
            on_face[face[2]] = w / (u + v + w);
            for (const Weights& expected : {on_edge, on_face}) {
                const Vec3 p = combined(mesh, expected);
                CHECK(apart(weights(mesh, p), expected) < 1e-10);
                // Inwards, the weights move away in proportion, without a jump.
                for (const double step : {1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6}) {
                    const Weights near = weights(mesh, mix(p, centre, step));
                    CHECK(apart(near, expected) < 1e-10 + 1e3 * step);
                    CHECK(apart(combined(mesh, near), mix(p, centre, step)) < 1e-11);
                }
            }
        }
    }
}

TEST(close_to_a_face_nothing_is_lost) {
    // The weights at height h above a face, against the limit h -> 0 of their slope: a smooth
    // function of h, so that w(2h) - w(0) = 2 (w(h) - w(0)) up to terms of order h^2.
    const Mesh mesh = tetrahedron();
    const Weights expected{1 - 0.3 - 0.25, 0.3, 0.25, 0};
    for (const double h : {1e-6, 1e-7, 1e-8}) {
        const Weights once = weights(mesh, {0.3, 0.25, h}),
                      twice = weights(mesh, {0.3, 0.25, 2 * h});
        // In a tetrahedron mean value coordinates are barycentric coordinates.
        CHECK(apart(once, {1 - 0.55 - h, 0.3, 0.25, h}) < 1e-14);
        CHECK(apart(twice, {1 - 0.55 - 2 * h, 0.3, 0.25, 2 * h}) < 1e-14);
        CHECK(apart(once, expected) < 2 * h);
    }
}

TEST(a_face_whose_plane_holds_the_point_adds_nothing_beside_it) {
    // Inside a concave body, in the planes of the concavity's faces but beside them.
    const Mesh mesh = concave_cube();
    Random random(6);
    int tried = 0;
    for (int i = 0; i < 200; ++i) {
        // The plane through (0,0,1), (1,0,1), (.5,.5,.3): z = 1 - 1.4 y.
        const double y = random.uniform(0.51, 0.7);
        const Vec3 p{random.uniform(0.05, 0.95), y, 1 - 1.4 * y};
        const Weights w = weights(mesh, p);
        CHECK_NEAR(sum(w), 1, 1e-12);
        CHECK(apart(combined(mesh, w), p) < 1e-11);
        for (const double h : {1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-5, 1e-4, 1e-3}) {
            for (const double side : {-1.0, 1.0}) {
                const Vec3 q{p[0], p[1] + side * h * 0.81, p[2] + side * h * 0.58};
                const Weights near = weights(mesh, q);
                CHECK(apart(near, w) < 100 * h + 1e-11);
                CHECK(apart(combined(mesh, near), q) < 1e-11);
            }
        }
        ++tried;
    }
    CHECK_EQUAL(tried, 200);
}

TEST(the_two_ways_near_a_plane_and_away_from_it_meet) {
    // Across the height at which the formula changes, weights are continuous to rounding.
    const Mesh mesh = cube();
    for (double x = 0.1; x < 0.95; x += 0.1) {
        for (double z = 1e-3; z < 0.1; z *= 1.01) {
            const Weights a = weights(mesh, {x, 0.37, z}),
                          b = weights(mesh, {x, 0.37, z * (1 + 1e-12)});
            CHECK(apart(a, b) < 1e-12);
        }
    }
}

TEST(any_finite_point_gives_finite_weights_that_sum_to_one) {
    Random random(7);
    std::vector<Mesh> meshes{tetrahedron(), cube(), concave_cube(), flat_square(), flat_triangle()};
    // Collapsed in every way: a point, a line, twins, slivers.
    meshes.push_back(
        {{{.5, .5, .5}, {.5, .5, .5}, {.5, .5, .5}, {.5, .5, .5}}, tetrahedron().faces});
    meshes.push_back({{{0, 0, 0}, {1, 1, 1}, {.5, .5, .5}, {.2, .2, .2}}, tetrahedron().faces});
    meshes.push_back({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}}, tetrahedron().faces});
    meshes.push_back({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 1e-15}}, tetrahedron().faces});
    meshes.push_back({{{0, 0, 0}, {1, 0, 0}, {.3, 1e-9, 0}, {.2, 0, 1e-9}}, tetrahedron().faces});
    meshes.push_back(
        {{{1e-200, 0, 0}, {2e-200, 0, 0}, {0, 1e-200, 0}, {0, 0, 1e-200}}, tetrahedron().faces});
    meshes.push_back(
        {{{1e6, 1e6, 1e6}, {1e6 + 1e-9, 1e6, 1e6}, {1e6, 1e6 + 1e-9, 1e6}, {1e6, 1e6, 1e6 + 1e-9}},
         tetrahedron().faces});
    for (const Mesh& mesh : meshes) {
        std::vector<Vec3> points{
            {0, 0, 0},   {1e300, -1e300, 1e300}, {1e-300, 0, 0}, {.2, .2, .2}, {1e30, 1, 1},
            {1e6, 0, 0}, {0.5, 0.5, 0.5},        {2, 0, 0}};
        for (const Vec3& v : mesh.rgb) points.push_back(v);
        for (int i = 0; i < 200; ++i) {
            const double scale = std::pow(10, random.uniform(-12, 6));
            points.push_back(shifted(mesh.rgb[0], random.colour(-1, 1), scale));
            points.push_back(random.colour(-1, 2));
        }
        for (const Vec3& p : points) {
            const Projected at = project(mesh, p);
            CHECK_NEAR(sum(at.w), 1, 1e-9);
            CHECK(std::isfinite(at.at.q[0]) && at.at.distance >= 0);
        }
    }
}

TEST(outside_the_closest_surface_point_counts) {
    const Mesh mesh = cube();
    Random random(8);
    for (int i = 0; i < 2000; ++i) {
        const Vec3 p = random.colour(-1, 2);
        Vec3 q = p;
        for (double& x : q) x = std::min(std::max(x, 0.0), 1.0);
        const Projected at = project(mesh, p);
        CHECK(apart(at.at.q, q) < 1e-14);
        CHECK(apart(combined(mesh, at.w), q) < 1e-13);
        const double expected =
            std::sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                      (p[2] - q[2]) * (p[2] - q[2]));
        CHECK_NEAR(at.at.distance, expected, 1e-14);
        CHECK_EQUAL(at.at.inside, expected == 0);
        int used = 0;
        for (const double x : at.w) {
            CHECK(x >= 0);
            used += x > 0;
        }
        if (expected > 0) CHECK(used <= 3);
    }
}

TEST(weights_are_continuous_across_the_surface) {
    Random random(10);
    for (int round = 0; round < check::rounds(100); ++round) {
        const Mesh mesh = round % 3 ? random_convex(random, 4 + random.below(12)) : concave_cube();
        const Vec3 centre = round % 3 ? middle(mesh) : Vec3{0.5, 0.5, 0.1};
        for (int i = 0; i < 20; ++i) {
            Vec3 in = centre, out = shifted(centre, random.colour(-1, 1), 3);
            if (project(mesh, out).at.inside) continue;
            while (apart(in, out) > 1e-15) {
                const Vec3 half = mix(in, out, 0.5);
                if (half == in || half == out) break;
                (project(mesh, half).at.inside ? in : out) = half;
            }
            CHECK(apart(project(mesh, in).w, project(mesh, out).w) < 1e-9);
            for (const double step : {1e-10, 1e-8, 1e-6}) {
                const Vec3 inner = mix(in, centre, step), outer = mix(out, centre, -step);
                CHECK(apart(project(mesh, inner).w, project(mesh, outer).w) < 1e-9 + 300 * step);
            }
        }
    }
}

TEST(a_flat_palette_is_all_surface) {
    for (const Mesh& mesh : {flat_square(), flat_triangle()}) {
        Random random(11);
        for (int i = 0; i < 200; ++i) {
            const Face& face = mesh.faces[random.below(static_cast<int>(mesh.faces.size()))];
            const double u = random.uniform(), v = random.uniform() * (1 - u);
            const Vec3 p = mix(mix(mesh.rgb[face[0]], mesh.rgb[face[1]], u), mesh.rgb[face[2]], v);
            const Projected at = project(mesh, p);
            CHECK(at.at.inside);
            CHECK_EQUAL(at.at.distance, 0.0);
            CHECK(apart(combined(mesh, at.w), p) < 1e-12);
            const Projected off = project(mesh, shifted(p, {0.3, -0.2, 0.9}, 0.1));
            CHECK(!off.at.inside);
            CHECK(apart(combined(mesh, off.w), off.at.q) < 1e-13);
        }
    }
    // No jumps over any diagonal of either side, in whatever order the faces come.
    Mesh mixed = flat_square();
    mixed.faces = {mixed.faces[0], mixed.faces[2], mixed.faces[1], mixed.faces[3]};
    for (const Mesh& mesh : {flat_square(), mixed}) {
        for (double x = 0.01; x < 0.99; x += 0.001) {
            const Vec3 p{x, 0.83 * x + 0.05, 0.5}, q{x, 0.97 - 0.83 * x, 0.7};
            for (const Vec3& here : {p, q}) {
                const Vec3 there{here[0] + 0.001, here[1], here[2]};
                CHECK(apart(weights(mesh, here), weights(mesh, there)) < 0.003);
            }
        }
    }
    const Projected above = project(flat_square(), {0.25, 0.5, 0.9});
    CHECK_NEAR(above.at.distance, 0.4, 1e-15);
}

TEST(faces_that_look_inwards_are_a_body_too) {
    Mesh mesh = cube();
    for (Face& face : mesh.faces) std::swap(face[0], face[1]);
    const Projected at = project(mesh, {0.3, 0.4, 0.5});
    CHECK(at.at.inside);
    CHECK(apart(combined(mesh, at.w), {0.3, 0.4, 0.5}) < 1e-13);
    CHECK(!project(mesh, {0.3, 0.4, 1.5}).at.inside);
}

TEST(what_is_not_finite_stays_unknown) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    for (const Vec3& p : {Vec3{nan, 0, 0}, Vec3{0, inf, 0}, Vec3{0, 0, -inf}}) {
        const Projected at = project(cube(), p);
        for (const double x : at.w) CHECK(std::isnan(x));
        CHECK(std::isnan(at.at.distance));
        for (const double x : weights(cube(), p)) CHECK(std::isnan(x));
    }
}
