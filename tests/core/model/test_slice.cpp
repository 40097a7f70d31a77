// Bits and ends; tests/parity has the values at all other times.
#include "model/slice.hpp"

#include <limits>
#include <stdexcept>

#include "check.hpp"
#include "colours.hpp"
#include "shapes.hpp"

using namespace colours;
using namespace palette4d;
using namespace shapes;

TEST(a_vertex_at_its_own_frame_is_exact) {
    const Polytope polytope = split_parts().build();
    const Slice slice = slice_at(polytope, 5.5);
    CHECK_EQUAL(slice.where[1].from, 3);
    CHECK_EQUAL(slice.where[1].to, 3);
    CHECK_EQUAL(slice.where[1].edge, -1);
    CHECK_EQUAL(slice.where[1].weight, 0.0);
    CHECK(same_bits(slice.rgb[1], polytope.vertices()[3].rgb));
}

TEST(outside_the_clip_the_ends_hold) {
    const Polytope polytope = split_parts().build();
    const double inf = std::numeric_limits<double>::infinity();
    for (const double frame : {-inf, -1e300, -0.001, 0.0}) {
        const Slice slice = slice_at(polytope, frame);
        CHECK_EQUAL(slice.frame, 0.0);
        CHECK_EQUAL(slice.rgb.size(), 4u);
        CHECK(same_bits(slice.rgb[3], polytope.vertices()[9].rgb));
    }
    for (const double frame : {20.0, 20.001, 1e300, inf}) {
        const Slice slice = slice_at(polytope, frame);
        CHECK_EQUAL(slice.frame, 20.0);
        CHECK_EQUAL(slice.section, 2);
        CHECK(same_bits(slice.rgb[4], polytope.vertices()[14].rgb));
    }
    CHECK_THROWS(std::invalid_argument, slice_at(polytope, std::nan("")));
    CHECK_THROWS(std::invalid_argument, slice_at(Polytope(), 0));
}

TEST(the_weight_never_reaches_one) {
    SplitParts parts;
    const double end = 1e8, just_before = std::nextafter(end, 0);
    parts.vertices = {{"a", {0, 0, 0}, -1e8 - 0.1}, {"b", {1, 1, 1}, end}};
    parts.edges = {{"e", 0, 1}};
    parts.sections = {{-1e8, just_before, false, {{0, 1}}, {}}};
    const Slice slice = slice_at(parts.build(), just_before);
    CHECK_EQUAL(slice.where[0].edge, 0);
    CHECK(slice.where[0].weight < 1);
}
