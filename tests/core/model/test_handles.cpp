#include "model/handles.hpp"

#include <limits>
#include <memory>
#include <stdexcept>

#include "check.hpp"
#include "model/ramps.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

/// Vertex b0 and two stops on edge eb.
Edits some_edits(const Polytope& polytope) {
    Edits edits;
    edits.vertex_rgb.resize(polytope.vertices().size());
    edits.vertex_rgb[2] = Vec3{0.5, 0.5, 0.5};
    edits.stops = {{"s2", polytope.find_edge("eb"), 4, {1, 2, 3}},
                   {"s1", polytope.find_edge("eb"), 2, {-1, 0, 9}}};
    return edits;
}

}  // namespace

TEST(handles_are_the_vertices_then_the_stops) {
    const Polytope polytope = split_parts().build();
    const Edits edits = some_edits(polytope);
    const std::vector<Handle> handles = handles_of(polytope, edits);
    CHECK_EQUAL(handles.size(), 17u);
    CHECK(handles[3].name.empty());
    for (std::size_t i = 0; i < handles.size(); ++i) {
        CHECK_EQUAL(find_handle(polytope, edits, handles[i].id), static_cast<int>(i));
        CHECK_EQUAL(handles[i].stop, i >= 15);
    }
    CHECK_EQUAL(handles[3].id, std::string("bm"));
    CHECK_EQUAL(handles[3].frame, 5.5);
    CHECK(handles[3].rgb == (Vec3{0.9, 0.1, 0}));
    CHECK(handles[2].rgb == (Vec3{0.5, 0.5, 0.5}));
    CHECK_EQUAL(handles[15].id, std::string("s2"));
    CHECK_EQUAL(handles[16].index, 1);
    CHECK(handles[16].rgb == (Vec3{-1, 0, 9}));
    for (const char* id : {"", "e2x", "eb", "s3"})
        CHECK_EQUAL(find_handle(polytope, edits, id), -1);
    // Edits of nothing at all name no vertices.
    CHECK_EQUAL(handles_of(polytope, {}).size(), 15u);
}

TEST(new_colours_lie_over_the_edits) {
    const Polytope polytope = split_parts().build();
    const Edits edits = some_edits(polytope);
    const std::vector<HandleColour> colours = {{0, {7, 7, 7}}, {2, {8, 8, 8}}, {16, {9, 9, 9}}};
    const Edits both = with_colours(polytope, edits, true, colours);
    CHECK(both.vertex_rgb[0] == Vec3({7, 7, 7}) && both.vertex_rgb[2] == Vec3({8, 8, 8}));
    CHECK_EQUAL(both.stops.size(), 2u);
    CHECK(both.stops[0].rgb == (Vec3{1, 2, 3}) && both.stops[1].rgb == (Vec3{9, 9, 9}));
    const Edits alone = with_colours(polytope, edits, false, {{0, {7, 7, 7}}, {16, {9, 9, 9}}});
    CHECK(alone.vertex_rgb[0].has_value() && !alone.vertex_rgb[2].has_value());
    CHECK_EQUAL(alone.stops.size(), 1u);
    CHECK_EQUAL(alone.stops[0].id, std::string("s1"));
    CHECK_EQUAL(alone.stops[0].frame, 2.0);
    // Without new colours: the edits as they are, or none.
    CHECK_EQUAL(with_colours(polytope, edits, true, {}).stops.size(), 2u);
    const Edits none = with_colours(polytope, edits, false, {});
    for (const double frame : {0.0, 3.0, 9.0, 20.0}) {
        const Slice slice = slice_at(polytope, frame);
        CHECK(edited_colours(polytope, none, slice) == slice.rgb);
    }
    CHECK_EQUAL(with_colours(polytope, {}, true, {{1, {1, 1, 1}}}).vertex_rgb.size(), 15u);
}

TEST(handles_that_do_not_exist_and_colours_that_are_none_are_refused) {
    const Polytope polytope = split_parts().build();
    const Edits edits = some_edits(polytope);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS(std::invalid_argument, with_colours(polytope, edits, true, {{-1, {0, 0, 0}}}));
    CHECK_THROWS(std::invalid_argument, with_colours(polytope, edits, true, {{17, {0, 0, 0}}}));
    CHECK_THROWS(std::invalid_argument, with_colours(polytope, edits, true, {{0, {0, nan, 0}}}));
}

TEST(colours_of_the_host_keep_ramps_and_picks) {
    const Polytope polytope = split_parts().build();
    Edits edits;
    edits.vertex_rgb.resize(polytope.vertices().size());
    edits.vertex_ramp.resize(polytope.vertices().size());
    edits.vertex_ramp[1] = Ramp::kHold;
    edits.default_ramp = Ramp::kSmooth;
    edits.stops = {{"s1", 0, 5, {0, 1, 0}, Ramp::kLinear}};
    edits.picks.resize(2);
    edits.display = std::make_shared<const DisplayCurve>(DisplayCurve{0, 1, {0, 1}});
    const int stop = static_cast<int>(polytope.vertices().size());
    const Edits kept = with_colours(polytope, edits, true, {{1, {1, 1, 1}}, {stop, {0, 0, 1}}});
    CHECK(kept.default_ramp == Ramp::kSmooth && kept.vertex_ramp == edits.vertex_ramp);
    CHECK(kept.stops[0].ramp == Ramp::kLinear && kept.stops[0].rgb == (Vec3{0, 0, 1}));
    CHECK(kept.picks.size() == 2 && kept.display == edits.display);
    // Alone, they are all there is.
    const Edits alone = with_colours(polytope, edits, false, {{1, {1, 1, 1}}});
    CHECK(alone.picks.empty());
    CHECK(alone.default_ramp == Ramp::kLinear && alone.stops.empty());
}
