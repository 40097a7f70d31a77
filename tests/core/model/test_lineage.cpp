#include "model/lineage.hpp"

#include <set>
#include <stdexcept>
#include <string>

#include "check.hpp"
#include "model/handles.hpp"
#include "recolour/recolour.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

/// Which tracks of the slice at a frame a handle is followed to.
std::set<int> tracks(const Polytope& polytope, const Edits& edits, const char* id, double frame) {
    const Lineage lineage(polytope, edits, find_handle(polytope, edits, id));
    const Slice slice = slice_at(polytope, frame);
    std::set<int> found;
    for (std::size_t i = 0; i < slice.where.size(); ++i) {
        if (lineage.holds(slice.where[i])) found.insert(static_cast<int>(i));
    }
    return found;
}

using Tracks = std::set<int>;

}  // namespace

TEST(a_colour_is_followed_forwards_and_backwards) {
    const Polytope polytope = split_parts().build();
    for (const double frame : {0.0, 3.0, 5.5, 8.0, 9.0, 10.0, 20.0}) {
        CHECK(tracks(polytope, {}, "a0", frame) == Tracks{0});
        CHECK(tracks(polytope, {}, "bm", frame) == Tracks{1});
        CHECK(tracks(polytope, {}, "c3", frame) == Tracks{2});
    }
}

TEST(a_split_leads_to_all_its_branches_and_each_branch_back_to_its_stem) {
    const Polytope polytope = split_parts().build();
    // d becomes d and e between the frames 8 and 10.
    for (const char* stem : {"d0", "d1"}) {
        CHECK(tracks(polytope, {}, stem, 4) == Tracks{3});
        CHECK(tracks(polytope, {}, stem, 8) == Tracks{3});
        CHECK(tracks(polytope, {}, stem, 9) == (Tracks{3, 4}));
        CHECK(tracks(polytope, {}, stem, 20) == (Tracks{3, 4}));
    }
    CHECK(tracks(polytope, {}, "e3", 20) == Tracks{4});
    CHECK(tracks(polytope, {}, "e2", 9) == Tracks{4});
    CHECK(tracks(polytope, {}, "e3", 4) == Tracks{3});
    CHECK(tracks(polytope, {}, "d3", 12) == Tracks{3});
}

TEST(a_stop_is_followed_from_its_edge) {
    const Polytope polytope = split_parts().build();
    Edits edits;
    edits.stops = {{"early", polytope.find_edge("ed"), 4, {0, 0, 0}},
                   {"late", polytope.find_edge("ee2"), 9, {0, 0, 0}}};
    CHECK(tracks(polytope, edits, "early", 2) == Tracks{3});
    CHECK(tracks(polytope, edits, "early", 0) == Tracks{3});
    CHECK(tracks(polytope, edits, "early", 15) == (Tracks{3, 4}));
    CHECK(tracks(polytope, edits, "late", 2) == Tracks{3});
    CHECK(tracks(polytope, edits, "late", 9.5) == Tracks{4});
    CHECK_THROWS(std::invalid_argument, Lineage(polytope, edits, 17));
    CHECK_THROWS(std::invalid_argument, Lineage(polytope, edits, -1));
}

TEST(readers_read_weights_and_the_surface) {
    const Polytope polytope = split_parts().build();
    Random random(4);
    for (const double frame : {0.0, 7.0, 9.5, 14.0}) {
        const Slice slice = slice_at(polytope, frame);
        const PaletteBody body(slice.rgb, slice.faces);
        const Lineage lineage(polytope, {}, find_handle(polytope, {}, "d1"));
        const Recolourer weight(slice.rgb, weight_reader(slice, lineage), slice.faces);
        const Recolourer surface(slice.rgb, surface_reader(slice), slice.faces);
        PaletteBody::Workspace workspace;
        std::vector<double> weights(slice.rgb.size());
        for (int i = 0; i < 200; ++i) {
            const Vec3 p = random.colour(-0.3, 1.2);
            const Projection projection = body.project(p, weights.data(), workspace);
            double sum = 0;
            for (std::size_t k = 0; k < weights.size(); ++k) {
                if (lineage.holds(slice.where[k])) sum += weights[k];
            }
            const Vec3 read = weight.displaced(p, 1);
            for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(read[c] - p[c], sum, 1e-12);
            const Vec3 q = surface.displaced(p, 1);
            for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(q[c] - p[c], projection.q[c], 1e-9);
        }
    }
}
