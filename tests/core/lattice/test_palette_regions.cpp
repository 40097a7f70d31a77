// The regions around a palette, held against the displacement of each colour by itself.
#include "lattice/palette_regions.hpp"

#include <algorithm>
#include <cmath>

#include "check.hpp"
#include "recolour/recolour.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

constexpr float kUnit[3] = {0.004f, 0.005f, 0.003f};

struct Subject {
    Mesh mesh;
    std::vector<Vec3> displacement, edited;
    PaletteBody body;
    explicit Subject(Mesh given, std::uint64_t seed)
        : mesh(std::move(given)), body(mesh.rgb, mesh.faces) {
        Random random(seed);
        for (const Vec3& colour : mesh.rgb) {
            displacement.push_back(random.colour(-0.4, 0.4));
            edited.push_back(colour);
            for (std::size_t c = 0; c < 3; ++c) edited.back()[c] += displacement.back()[c];
        }
    }
    std::unique_ptr<const PaletteRegions> regions(double size = 2) const {
        return PaletteRegions::of(body, displacement, kUnit, size);
    }
};

double height(const PaletteRegions::Plane& plane, const Vec3& p) {
    double sum = -plane.offset;
    for (std::size_t c = 0; c < 3; ++c) sum += plane.normal[c] * p[c];
    return sum;
}

/// Of the colour, from what is known of a box around it.
int region_of(const PaletteRegions& regions, const PaletteRegions::Within& within, const Vec3& p) {
    int at = within.plane < 0 ? within.region : PaletteRegions::chosen(within.plane);
    while (at < 0) {
        const auto& plane = regions.planes()[static_cast<std::size_t>(PaletteRegions::chosen(at))];
        at = height(plane, p) < 0 ? plane.below : plane.above;
    }
    return at;
}

/// Two faces a side in one plane, as near as numbers get, or nearly: its sides are bent outwards or
/// inwards by as much.
Mesh parallelepiped(Random& random, double bent) {
    Mesh mesh = cube();
    const Vec3 skew = random.colour(-0.2, 0.2);
    for (Vec3& colour : mesh.rgb) {
        colour = {0.6 * colour[0] + skew[0] * colour[1], 0.6 * colour[1] + skew[1] * colour[2],
                  0.6 * colour[2] + skew[2] * colour[0]};
        for (std::size_t c = 0; c < 3; ++c) colour[c] += 0.2 + random.uniform(-bent, bent);
    }
    return mesh;
}

std::vector<Mesh> convex_meshes(Random& random) {
    std::vector<Mesh> all;
    for (int i = 0; i < 6; ++i) all.push_back(random_convex(random, 5 + 3 * i));
    all.push_back(cube());
    for (const double bent : {0.0, 1e-14, 1e-13}) all.push_back(parallelepiped(random, bent));
    return all;
}

}  // namespace

TEST(colours_of_a_box_are_in_the_regions_that_are_said_of_it) {
    Random random(4);
    int inside = 0, whole = 0, split = 0, several = 0, by_edges = 0;
    std::uint64_t palette = 0;
    for (const Mesh& mesh : convex_meshes(random)) {
        const Subject subject(mesh, palette++);
        const auto regions = subject.regions();
        CHECK(regions != nullptr);
        const Recolourer recolourer(subject.mesh.rgb, subject.edited, subject.mesh.faces);
        for (int box = 0; box < 1200; ++box) {
            const Vec3 centre = random.colour(-0.1, 1.1);
            const float at[3] = {static_cast<float>(centre[0]), static_cast<float>(centre[1]),
                                 static_cast<float>(centre[2])};
            const float half = box % 2 ? 1.0f : 4.0f;
            const PaletteRegions::Within within = regions->within(at, half);
            if (within.region == PaletteRegions::kSeveral) {
                ++several;
                continue;
            }
            whole += within.plane < 0;
            by_edges += within.edge;
            split += within.plane >= 0 && !within.edge;
            for (int i = 0; i < 10; ++i) {
                Vec3 p;
                for (std::size_t c = 0; c < 3; ++c) {
                    p[c] = static_cast<double>(
                        at[c] + half * kUnit[c] * static_cast<float>(random.uniform(-1, 1)));
                }
                const int region = region_of(*regions, within, p);
                if (region == PaletteRegions::kInside) {
                    ++inside;
                    CHECK(within.inside);
                    for (const auto& plane : regions->planes()) {
                        if (plane.below == PaletteRegions::kInside && plane.above >= 0) {
                            CHECK(height(plane, p) < 1e-6);
                        }
                    }
                    continue;
                }
                const Vec3 exact = recolourer.displaced(p, 1);
                const auto& affine = regions->affine(static_cast<std::size_t>(region));
                for (std::size_t c = 0; c < 3; ++c) {
                    double moved = affine[0][c];
                    for (std::size_t k = 0; k < 3; ++k) moved += affine[k + 1][c] * p[k];
                    CHECK_NEAR(moved, exact[c] - p[c], 1e-4);
                }
            }
        }
    }
    CHECK(inside > 1000 && whole > 1000 && split > 300 && by_edges > 30 && several > 10);
}

TEST(no_more_boxes_of_a_grid_have_some_of_the_inside_than_is_said) {
    Random random(4);
    std::uint64_t palette = 0;
    for (const Mesh& mesh : convex_meshes(random)) {
        const auto regions = Subject(mesh, palette++).regions();
        CHECK(regions != nullptr);
        constexpr float kLow[3] = {-0.13f, -0.11f, -0.12f};
        for (const auto& [width, side] : {std::pair{8.0f, 40}, {2.5f, 31}}) {  // it cuts some off
            std::size_t found = 0;
            for (int box = 0; box < side * side * side; ++box) {
                const int place[3] = {box / side / side, box / side % side, box % side};
                float centre[3];
                for (int c = 0; c < 3; ++c) {
                    centre[c] = kLow[c] + (static_cast<float>(place[c]) + 0.5f) * width * kUnit[c];
                }
                found += regions->within(centre, width / 2).inside;
            }
            const std::size_t said = regions->most_inside(kLow, width, side);
            CHECK(found <= said);
            // Those near sharp edges as well that no wall tells to be outside.
            CHECK(said <= found + found / 10 + 200);
        }
    }
}

TEST(there_are_none_where_they_would_not_hold) {
    CHECK(Subject(tetrahedron(), 1).regions() != nullptr);
    CHECK(Subject(concave_cube(), 2).regions() == nullptr);
    CHECK(Subject(flat_square(), 3).regions() == nullptr);
    CHECK(Subject(tetrahedron(), 5).regions(1e9) == nullptr);
}
