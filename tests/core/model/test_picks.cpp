#include "model/picks.hpp"

#include <stdexcept>

#include "check.hpp"
#include "colours.hpp"
#include "picks.hpp"

using namespace colours;
using namespace palette4d;
using picks::pick;

TEST(a_picked_colour_moves_along_its_path) {
    Pick moving = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.25, 0.5});
    CHECK(same_bits(moving.colour_at(-1e9), moving.rgb));
    moving.path = {{2, {0.5, 0.25, 0.25}}, {4, {0.25, 0.5, 0.25}}, {8, {0, 0, 1}}};
    for (const double early : {-1e9, 0.0, 2.0}) {
        CHECK(same_bits(moving.colour_at(early), {0.5, 0.25, 0.25}));
    }
    for (const double late : {8.0, 9.0, 1e9}) CHECK(same_bits(moving.colour_at(late), {0, 0, 1}));
    CHECK(same_bits(moving.colour_at(3), {0.375, 0.375, 0.25}));
    CHECK(same_bits(moving.colour_at(4), {0.25, 0.5, 0.25}));
    CHECK(apart(moving.colour_at(7), {0.0625, 0.125, 0.8125}) < 1e-15);
}

TEST(a_shift_is_the_same_change_at_other_frames) {
    Pick shift = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.5, 0.25});
    CHECK(same_bits(shift.change_at(0), {-0.25, 0.25, 0}));
    shift.path = {{0, {0.5, 0.25, 0.25}}, {10, {0.75, 0.25, 0.375}}};
    CHECK(same_bits(shift.change_at(0), {-0.25, 0.25, 0}));
    CHECK(same_bits(shift.change_at(10), {-0.25, 0.25, 0}));
    // Of a shade, its part.
    shift.path = {{0, {0.5, 0.25, 0.25}}, {10, {0.25, 0.125, 0.125}}};
    CHECK(apart(shift.change_at(10), {-0.125, 0.125, 0}) < 1e-15);
    // And of black, nothing.
    shift.path[1].rgb = {0, 0, 0};
    CHECK_EQUAL(apart(shift.change_at(10), {0, 0, 0}), 0.0);
}

TEST(a_shift_leads_out_of_no_range) {
    Pick shift = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.75, 0.25});
    // Green has room for 0.25 of 0.5 only, so that red gets half of its change too.
    shift.path = {{0, {0.5, 0.25, 0.25}}, {10, {0.75, 0.75, 0.25}}};
    CHECK(apart(shift.change_at(10), {-0.125, 0.25, 0}) < 1e-15);
    // Red can fall by 0.125.
    shift.path[1].rgb = {0.125, 0.5, 0.25};
    CHECK(apart(shift.change_at(10), {-0.125, 0.25, 0}) < 1e-15);
    // Above 1 there is room where one of the colours is there; below 0 as far as one of them is.
    shift.path[1].rgb = {2, 2, 0.25};
    CHECK(same_bits(shift.change_at(10), {-0.25, 0.5, 0}));
    shift.path = {{0, {0.5, 0.25, 0.25}}, {5, {-1, 0.25, 0.25}}, {10, {0.5, 0.25, 0.25}}};
    CHECK(same_bits(shift.change_at(10), {-0.25, 0.5, 0}));
    CHECK_EQUAL(apart(shift.change_at(5), {0, 0, 0}), 0.0);
}

TEST(a_pick_toward_a_colour_ends_there_at_each_frame) {
    Pick toward = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.75, 0.25});
    toward.toward_colour = true;
    toward.path = {{0, {0.5, 0.25, 0.25}}, {10, {2, -1, 0}}};
    for (const double t : {0.0, 2.5, 10.0}) {
        const Vec3 end = toward.colour_at(t) + toward.change_at(t);
        CHECK(apart(end, {0.25, 0.75, 0.25}) < 1e-15);
    }
}

TEST(a_hold_changes_nothing) {
    Pick hold = picks::hold("h", {0.5, 0.25, 0.25});
    hold.to = {1, 1, 1};
    for (const bool toward : {false, true}) {
        hold.toward_colour = toward;
        CHECK(same_bits(hold.change_at(3), {0, 0, 0}));
    }
    CHECK_EQUAL(hold.strength_at(3, 1), 1.0);
}

TEST(a_pick_fades_in_before_its_range_and_out_after_it) {
    Pick ranged = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.75, 0.25});
    CHECK_EQUAL(ranged.strength_at(-1e9, 1), 1.0);
    ranged.from = 10;
    ranged.until = 20;
    for (const double t : {10.0, 15.0, 20.0}) CHECK_EQUAL(ranged.strength_at(t, 1), 1.0);
    // Without a fade, half a step beyond an end it is there by half.
    CHECK_EQUAL(ranged.strength_at(9.5, 1), 0.5);
    CHECK_EQUAL(ranged.strength_at(9, 2), 0.5);
    for (const double t : {-1e9, 9.0, 21.0, 1e9}) CHECK_EQUAL(ranged.strength_at(t, 1), 0.0);
    ranged.fade = 4;
    CHECK_EQUAL(ranged.strength_at(7, 1), 0.25);
    CHECK_EQUAL(ranged.strength_at(22, 1), 0.5);
    ranged.fade_out = 8;
    CHECK_EQUAL(ranged.strength_at(7, 1), 0.25);
    CHECK_EQUAL(ranged.strength_at(22, 1), 0.75);
    ranged.fade_out = 0;
    CHECK_EQUAL(ranged.strength_at(20.5, 1), 0.5);
    ranged.fade_out.reset();
    // Ramps that overlap: the smaller one.
    ranged.until = 6;
    CHECK_EQUAL(ranged.strength_at(8, 1), 0.5);
    CHECK_EQUAL(ranged.strength_at(9, 1), 0.25);
}

TEST(a_pick_is_as_strong_as_its_colour_is_there) {
    Pick leaves = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.75, 0.25});
    leaves.path = {{0, leaves.rgb, 1}, {4, leaves.rgb, 0.5}, {8, leaves.rgb, 0}};
    CHECK_EQUAL(leaves.strength_at(-1, 1), 1.0);
    CHECK_EQUAL(leaves.strength_at(2, 1), 0.75);
    CHECK_EQUAL(leaves.strength_at(6, 1), 0.25);
    CHECK_EQUAL(leaves.strength_at(9, 1), 0.0);
    leaves.from = 4;
    leaves.fade = 4;
    CHECK_EQUAL(leaves.strength_at(2, 1), 0.375);
}

TEST(a_pick_has_its_own_matte_or_that_of_its_hue) {
    Pick some = pick("p", {0.5, 0.25, 0.25}, {0.25, 0.75, 0.25});
    CHECK(&some.taken() == some.matte.get());
    some.matte = nullptr;
    CHECK_THROWS(std::invalid_argument, some.taken());
    some.hue = std::make_shared<const HueMatte>(some.rgb);
    CHECK(some.taken().odds == hue_matte(some.rgb).odds);
    const Pick copy = some;
    CHECK(&copy.taken() == &some.taken());
}
