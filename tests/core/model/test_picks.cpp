// tests/parity has the paths, ranges and changes of picks.
#include "model/picks.hpp"

#include <stdexcept>

#include "check.hpp"
#include "colours.hpp"
#include "picks.hpp"

using namespace colours;
using namespace palette4d;
using picks::pick;

TEST(a_hold_changes_nothing) {
    Pick hold = picks::hold("h", {0.5, 0.25, 0.25});
    hold.to = {1, 1, 1};
    for (const bool toward : {false, true}) {
        hold.toward_colour = toward;
        CHECK(same_bits(hold.change_at(3), {0, 0, 0}));
    }
    CHECK_EQUAL(hold.strength_at(3), 1.0);
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
