#include "model/ramps.hpp"

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

namespace {

Edits no_edits(const Polytope& polytope) {
    Edits edits;
    edits.vertex_rgb.resize(polytope.vertices().size());
    return edits;
}

}  // namespace

TEST(without_edits_nothing_changes_a_bit) {
    const Polytope polytope = split_parts().build();
    for (double t = -1; t <= 21; t += 0.37) {
        const Slice slice = slice_at(polytope, t);
        for (const Edits& edits : {no_edits(polytope), Edits{}}) {
            const auto colours = edited_colours(polytope, edits, slice);
            CHECK_EQUAL(colours.size(), slice.rgb.size());
            for (std::size_t i = 0; i < colours.size(); ++i) {
                CHECK(same_bits(colours[i], slice.rgb[i]));
            }
        }
    }
}

TEST(an_edited_vertex_fades_out_along_its_edges_and_leaves_the_rest) {
    const Polytope polytope = split_parts().build();
    Edits edits = no_edits(polytope);
    edits.vertex_rgb[3] = Vec3{0.5, 0.6, 0.7};  // bm at 5.5
    CHECK(same_bits(edited_colours(polytope, edits, slice_at(polytope, 5.5))[1], {0.5, 0.6, 0.7}));
    // Halfway from b0: between the original b0 and the edited bm.
    const auto half = edited_colours(polytope, edits, slice_at(polytope, 2.75));
    CHECK(apart(half[1], {0.75, 0.3, 0.35}) < 1e-15);
    for (const double t : {0.0, 20.0}) {
        const Slice slice = slice_at(polytope, t);
        CHECK(same_bits(edited_colours(polytope, edits, slice)[1], slice.rgb[1]));
    }
    for (double t = 0; t <= 20; t += 0.31) {
        const Slice slice = slice_at(polytope, t);
        const auto colours = edited_colours(polytope, edits, slice);
        for (std::size_t i = 0; i < colours.size(); ++i) {
            if (i != 1) CHECK(same_bits(colours[i], slice.rgb[i]));
        }
    }
}

TEST(an_edit_equal_to_the_original_changes_nothing) {
    const Polytope polytope = split_parts().build();
    Edits edits = no_edits(polytope);
    for (std::size_t i = 0; i < 15; ++i) edits.vertex_rgb[i] = polytope.vertices()[i].rgb;
    for (double t = 0; t <= 20; t += 0.31) {
        const Slice slice = slice_at(polytope, t);
        const auto colours = edited_colours(polytope, edits, slice);
        for (std::size_t i = 0; i < colours.size(); ++i) CHECK(same_bits(colours[i], slice.rgb[i]));
    }
}

TEST(stops_hold_at_their_frames_and_are_joined_by_lines) {
    const Polytope polytope = split_parts().build();
    Edits edits = no_edits(polytope);
    // On the edge a0 -> a1 (0 to 20), not in order, one in each section.
    edits.stops = {{"s2", 0, 15, {1, 0, 0}}, {"s1", 0, 5, {0, 1, 0}}, {"s3", 0, 9, {0, 0, 1}}};
    edits.vertex_rgb[1] = Vec3{0, 1, 1};
    const auto at = [&](double t) {
        return edited_colours(polytope, edits, slice_at(polytope, t))[0];
    };
    CHECK(same_bits(at(0), {0, 0, 0}));
    CHECK(apart(at(2.5), {0, 0.5, 0}) < 1e-15);
    CHECK(same_bits(at(5), {0, 1, 0}));
    CHECK(apart(at(7), {0, 0.5, 0.5}) < 1e-15);
    CHECK(same_bits(at(9), {0, 0, 1}));
    CHECK(apart(at(12), {0.5, 0, 0.5}) < 1e-15);
    CHECK(same_bits(at(15), {1, 0, 0}));
    CHECK(apart(at(17.5), {0.5, 0.5, 0.5}) < 1e-15);
    CHECK(same_bits(at(20), {0, 1, 1}));
    // Continuous, the boundaries at 8 and 10 and the stops included.
    for (double t = 0; t < 20; t += 0.125) CHECK(apart(at(t), at(t + 1e-9)) < 1e-8);
    // The order that a sidecar brings along, or none.
    Edits ordered = edits;
    ordered.stop_order = order_of(edits.stops);
    CHECK(ordered.stop_order == (std::vector<int>{1, 2, 0}));
    for (double t = 0; t <= 20; t += 0.5) {
        CHECK(same_bits(edited_colours(polytope, ordered, slice_at(polytope, t))[0], at(t)));
    }
    // Another edge is left alone.
    const Slice slice = slice_at(polytope, 5);
    CHECK(same_bits(edited_colours(polytope, edits, slice)[1], slice.rgb[1]));
}

TEST(edits_of_another_polytope_are_refused) {
    const Polytope polytope = split_parts().build();
    Edits edits;
    edits.vertex_rgb.resize(3);
    CHECK_THROWS(std::invalid_argument, edited_colours(polytope, edits, slice_at(polytope, 1)));
}

TEST(edits_of_the_wrong_size_are_refused) {
    const Polytope polytope = split_parts().build();
    Edits edits = no_edits(polytope);
    edits.vertex_ramp.resize(3);
    CHECK_THROWS(std::invalid_argument, edited_colours(polytope, edits, slice_at(polytope, 1)));
}

TEST(a_held_edit_stays_and_a_smooth_one_does_not_overshoot) {
    const Polytope polytope = split_parts().build();
    Edits edits = no_edits(polytope);
    edits.vertex_rgb[1] = Vec3{0, 1, 1};  // the end of the edge a0 -> a1, 0 to 20
    edits.stops = {{"s2", 0, 15, {1, 0, 0}}, {"s1", 0, 5, {0, 1, 0}, Ramp::kLinear}};
    const auto moved = [&](double t) {
        const Slice slice = slice_at(polytope, t);
        const Vec3 colour = edited_colours(polytope, edits, slice)[0];
        Vec3 by{};
        for (std::size_t c = 0; c < 3; ++c) by[c] = colour[c] - slice.rgb[0][c];
        return by;
    };
    edits.default_ramp = Ramp::kHold;
    for (const double t : {0.0, 2.5, 4.999}) CHECK(same_bits(moved(t), {0, 0, 0}));
    CHECK(apart(moved(10), {0.5 - 0.05, 0.5, 0}) < 1e-14);  // the stop at 5 has its own ramp
    for (const double t : {15.5, 19.999}) CHECK(apart(moved(t), moved(15)) < 1e-14);
    CHECK(same_bits(edited_colours(polytope, edits, slice_at(polytope, 20))[0], {0, 1, 1}));
    CHECK(same_bits(edited_colours(polytope, edits, slice_at(polytope, 15))[0], {1, 0, 0}));
    edits.default_ramp = Ramp::kSmooth;
    edits.stops[1].ramp = std::nullopt;
    for (double t = 0; t < 20; t += 0.125) {
        const double from = t < 5 ? 0 : t < 15 ? 5 : 15, to = t < 5 ? 5 : t < 15 ? 15 : 20;
        const Vec3 a = moved(from), b = moved(to), here = moved(t);
        for (std::size_t c = 0; c < 3; ++c) {
            CHECK(here[c] >= std::min(a[c], b[c]) - 1e-14 &&
                  here[c] <= std::max(a[c], b[c]) + 1e-14);
        }
        CHECK(apart(here, moved(t + 1e-9)) < 1e-8);
    }
    // A vertex's own ramp comes before the default.
    edits.vertex_ramp.resize(polytope.vertices().size());
    edits.vertex_ramp[0] = Ramp::kHold;
    CHECK(same_bits(moved(4.9), {0, 0, 0}) && !same_bits(moved(6), moved(5)));
}
