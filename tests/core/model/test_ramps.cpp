// Bits and refusals; tests/parity has the ramps of edits.
#include "model/ramps.hpp"

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
