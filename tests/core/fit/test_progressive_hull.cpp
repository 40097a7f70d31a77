#include "fit/progressive_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "model/vec3.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 u = b - a, v = c - a;
    return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

/// The farthest that a point of `inner` lies outside the convex hull of `outer`, over every plane
/// through three points of `outer` that has all of `outer` on one side.
double farthest_outside(const std::vector<Vec3>& inner, const std::vector<Vec3>& outer) {
    double worst = 0;
    int planes = 0;
    for (std::size_t i = 0; i < outer.size(); ++i)
        for (std::size_t j = 0; j < outer.size(); ++j)
            for (std::size_t k = 0; k < outer.size(); ++k) {
                Vec3 n = normal_of(outer[i], outer[j], outer[k]);
                const double length = std::sqrt(dot(n, n));
                if (length < 1e-12) continue;
                for (double& x : n) x /= length;
                bool supports = true;
                for (const Vec3& v : outer) supports &= dot(n, v - outer[i]) < 1e-9;
                if (!supports) continue;
                ++planes;
                for (const Vec3& v : inner) worst = std::max(worst, dot(n, v - outer[i]));
            }
    CHECK(planes > 0);
    return worst;
}

}  // namespace

TEST(a_mesh_that_is_small_enough_stays_as_it_is) {
    for (const int target : {-5, 0, 4, 100}) {
        const shapes::Mesh mesh = shapes::tetrahedron();
        const std::vector<Vec3> hull = progressive_hull(mesh.rgb, mesh.faces, target);
        CHECK_EQUAL(hull.size(), std::size_t{4});
        for (std::size_t i = 0; i < hull.size(); ++i)
            for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(hull[i][c], mesh.rgb[i][c], 1e-15);
    }
}

TEST(a_cut_corner_grows_back) {
    // A tetrahedron with the corner (0, 0, 1) cut off at a height of 0.9: the cheapest contraction
    // that encloses it ends with the whole tetrahedron.
    const std::vector<Vec3> rgb{{0, 0, 0},   {1, 0, 0},     {0, 1, 0},
                                {0, 0, 0.9}, {0.1, 0, 0.9}, {0, 0.1, 0.9}};
    const std::vector<Face> faces{{0, 2, 1}, {0, 1, 4}, {0, 4, 3}, {0, 3, 5},
                                  {0, 5, 2}, {1, 2, 5}, {1, 5, 4}, {3, 4, 5}};
    const std::vector<Vec3> hull = progressive_hull(rgb, faces, 4);
    CHECK_EQUAL(hull.size(), std::size_t{4});
    for (const Vec3& corner : shapes::tetrahedron().rgb) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Vec3& v : hull) nearest = std::min(nearest, dot(v - corner, v - corner));
        CHECK_NEAR(std::sqrt(nearest), 0, 1e-8);
    }
}

TEST(every_hull_encloses_its_mesh_with_no_more_vertices_than_asked) {
    for (int seed = 1; seed <= 12; ++seed) {
        shapes::Random random(static_cast<std::uint64_t>(seed));
        const shapes::Mesh mesh = shapes::random_convex(random, 30);
        for (const int target : {20, 8, 6}) {
            const std::vector<Vec3> hull = progressive_hull(mesh.rgb, mesh.faces, target);
            CHECK(hull.size() >= 4 && hull.size() <= static_cast<std::size_t>(target));
            CHECK(farthest_outside(mesh.rgb, hull) < 1e-6);
        }
    }
}

TEST(the_scale_and_place_of_the_colours_do_not_matter) {
    shapes::Random random(3);
    const shapes::Mesh mesh = shapes::random_convex(random, 20);
    const std::vector<Vec3> small = progressive_hull(mesh.rgb, mesh.faces, 8);
    std::vector<Vec3> rgb = mesh.rgb;
    // A power of two: the unit cube's coordinates are the same to the last bits.
    for (Vec3& v : rgb)
        for (double& x : v) x *= 1024;
    const std::vector<Vec3> large = progressive_hull(rgb, mesh.faces, 8);
    CHECK_EQUAL(large.size(), small.size());
    for (std::size_t i = 0; i < std::min(small.size(), large.size()); ++i)
        for (std::size_t c = 0; c < 3; ++c) CHECK_EQUAL(large[i][c], 1024 * small[i][c]);
}

TEST(meshes_without_volume_end_without_a_crash) {
    for (const shapes::Mesh& mesh : {shapes::flat_square(), shapes::flat_triangle()}) {
        const std::vector<Vec3> hull = progressive_hull(mesh.rgb, mesh.faces, 4);
        CHECK_EQUAL(hull.size(), mesh.rgb.size());
    }
    const shapes::Mesh cube = shapes::cube();
    const std::vector<Vec3> point(8, {0.5, 0.5, 0.5});
    for (const Vec3& v : progressive_hull(point, cube.faces, 4))
        for (const double x : v) CHECK(std::isfinite(x));
}

TEST(bad_meshes_are_refused) {
    const shapes::Mesh mesh = shapes::cube();
    CHECK_THROWS(std::invalid_argument, progressive_hull({}, {}, 4));
    std::vector<Face> open = mesh.faces;
    open.pop_back();
    CHECK_THROWS(std::invalid_argument, progressive_hull(mesh.rgb, open, 4));
    std::vector<Face> turned = mesh.faces;
    std::swap(turned[0][1], turned[0][2]);
    CHECK_THROWS(std::invalid_argument, progressive_hull(mesh.rgb, turned, 4));
    for (const int corner : {-1, 8}) {
        std::vector<Face> faces = mesh.faces;
        faces[3][1] = corner;
        CHECK_THROWS(std::invalid_argument, progressive_hull(mesh.rgb, faces, 4));
    }
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        for (std::size_t c = 0; c < 3; ++c) {
            std::vector<Vec3> rgb = mesh.rgb;
            rgb[5][c] = bad;
            CHECK_THROWS(std::invalid_argument, progressive_hull(rgb, mesh.faces, 4));
        }
}
