#include "model/slice.hpp"

#include <algorithm>
#include <limits>
#include <optional>
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

TEST(inside_an_edge_colours_are_linear) {
    const Polytope polytope = split_parts().build();
    const Slice slice = slice_at(polytope, 5);
    CHECK_EQUAL(slice.where[0].edge, 0);
    CHECK_EQUAL(slice.where[0].from, 0);
    CHECK_EQUAL(slice.where[0].to, 1);
    CHECK_EQUAL(slice.where[0].weight, 0.25);
    CHECK_NEAR(slice.rgb[0][0], 0.025, 1e-17);
    CHECK_NEAR(slice.rgb[2][1], 1 - 0.1 * 5 / 8, 1e-15);
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

TEST(a_split_starts_at_one_colour_and_a_boundary_is_continuous) {
    const Polytope polytope = split_parts().build();
    const double eps = 1e-9;
    const Slice before = slice_at(polytope, 8), after = slice_at(polytope, 8 + eps);
    CHECK_EQUAL(before.section, 0);
    CHECK_EQUAL(after.section, 1);
    CHECK_EQUAL(after.rgb.size(), 5u);
    for (std::size_t i = 0; i < 4; ++i) CHECK(apart(before.rgb[i], after.rgb[i]) < 1e-8);
    CHECK(apart(before.rgb[3], after.rgb[4]) < 1e-8);
    // The edge through the boundary is the same on both sides.
    CHECK_EQUAL(before.where[0].edge, after.where[0].edge);
    const Slice left = slice_at(polytope, 10 - eps), right = slice_at(polytope, 10);
    CHECK_EQUAL(left.section, 1);
    CHECK_EQUAL(right.section, 2);
    for (std::size_t i = 0; i < 5; ++i) CHECK(apart(left.rgb[i], right.rgb[i]) < 1e-8);
}

TEST(slices_move_continuously_within_their_sections) {
    const Polytope polytope = split_parts().build();
    Slice last = slice_at(polytope, 0);
    for (double t = 0; t <= 20; t += 1.0 / 64) {
        const Slice slice = slice_at(polytope, t);
        if (slice.section == last.section) {
            for (std::size_t i = 0; i < slice.rgb.size(); ++i) {
                CHECK(apart(slice.rgb[i], last.rgb[i]) < 0.01);
            }
        }
        for (const SlicePoint& point : slice.where) {
            CHECK(point.weight >= 0 && point.weight < 1);
            CHECK((point.edge < 0) == (point.from == point.to));
        }
        last = slice;
    }
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
