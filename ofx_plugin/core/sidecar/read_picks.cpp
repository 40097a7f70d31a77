// The members "picks" and "mattes": colours that change or stay, and the mattes learned for them.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "model/sidecar_error.hpp"
#include "sidecar/inflate.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

/// Each enabled pick costs time for each pixel, and a key of a path some.
constexpr std::size_t kMaxPicks = 1000, kMaxPathKeys = 20'000;
/// Points of strokes in all; of a stroke drawn by hand there are some hundreds.
constexpr std::size_t kMaxPoints = 100'000;
/// Learned mattes take some 15 KB each.
constexpr std::size_t kMaxMatteText = 1 << 17;
constexpr double kMaxReach = 8;

void check_point(const Cursor& point) {
    if (point.list("2 numbers, x and y") != 2) point.wrong("a list of 2 numbers, x and y");
    for (std::size_t i = 0; i < 2; ++i) point.element(i).number(0.0, double{kMaxSize});
}

/// Where the matte is learned from: only the program that learns it reads this.
void check_places(const Cursor& pick, std::size_t& points) {
    if (pick.has("pixel")) check_point(pick.member("pixel"));
    if (pick.has("box")) pick.member("box").integer(1, kMaxSize);
    if (!pick.has("areas")) return;
    const Cursor areas = pick.member("areas");
    for (std::size_t i = 0, n = areas.list("areas"); i < n; ++i) {
        const Cursor area = areas.element(i);
        area.require_members({"frame", "points", "radius"});
        area.member("frame").frame();
        area.member("radius").number(0, double{kMaxSize});
        const Cursor listed = area.member("points");
        const std::size_t count = listed.list("points of areas in all", kMaxPoints, points);
        if (count == 0) listed.wrong("at least one point");
        points += count;
        for (std::size_t j = 0; j < count; ++j) check_point(listed.element(j));
    }
}

Pick read_pick(const Cursor& where, const PickMattes& mattes, std::set<std::string>& taken,
               std::size_t& keys, std::size_t& points) {
    if (mattes.version == 1) {
        // From "radius" on: picks moved palette colours. These members no longer do anything.
        where.require_members(
            {"id", "kind", "frame", "rgb"},
            {"to", "toward", "from", "until", "fade", "enabled", "path", "pixel", "box", "radius",
             "global_only", "spread", "residual", "worst", "worst_frame", "global"});
    } else {
        where.require_members(
            {"id", "kind", "frame", "rgb"},
            {"to", "toward", "from", "until", "fade", "enabled", "path", "pixel", "box", "areas",
             "matte", "whole_hue", "reach", "softness", "lightness"});
    }
    Pick pick;
    pick.id = where.member("id").id();
    claim(taken, where.member("id"), pick.id);
    pick.hold = where.member("kind").choice({"pick", "hold"}) == 1;
    pick.frame = where.member("frame").frame();
    pick.rgb = pick.to = where.member("rgb").rgb();
    if (where.has("to")) pick.to = where.member("to").rgb();
    if (where.has("toward")) {
        pick.toward_colour = where.member("toward").choice({"shift", "colour"}) == 1;
    }
    if (where.has("from")) pick.from = where.member("from").frame();
    if (where.has("until")) pick.until = where.member("until").frame();
    if (where.has("fade")) {
        pick.fade = where.member("fade").number(0, static_cast<double>(kMaxFrame));
    }
    if (where.has("enabled")) pick.enabled = where.member("enabled").flag();
    if (where.has("path")) {
        const Cursor path = where.member("path");
        std::optional<double> previous;
        const std::size_t count = path.list("colours over time in all", kMaxPathKeys, keys);
        keys += count;
        for (std::size_t i = 0; i < count; ++i) {
            const Cursor step = path.element(i);
            step.require_members({"frame", "rgb"}, {"given", "there"});
            PathKey key{step.member("frame").later_frame(previous), step.member("rgb").rgb()};
            if (step.has("given")) step.member("given").flag();
            if (step.has("there")) key.there = step.member("there").number(0, 1);
            pick.path.push_back(key);
        }
    }
    check_places(where, points);
    if (where.has("whole_hue")) where.member("whole_hue").flag();
    if (where.has("reach")) pick.reach = where.member("reach").number(-kMaxReach, kMaxReach);
    if (where.has("softness")) pick.softness = where.member("softness").number(0, 1);
    if (where.has("lightness")) {
        const Cursor range = where.member("lightness");
        if (range.list("2 numbers, lowest and highest") != 2) {
            range.wrong("a list of 2 numbers, lowest and highest");
        }
        pick.darkest = range.element(0).number(0.0, 1.0);
        pick.lightest = range.element(1).number(0.0, 1.0);
        if (!(pick.darkest < pick.lightest)) {
            range.wrong("a lowest lightness below the highest one");
        }
    }
    if (where.has("matte")) {
        const Cursor name = where.member("matte");
        const std::string id = name.id();
        const auto grid = mattes.grids.find(id);
        if (grid == mattes.grids.end()) {
            name.fail("the matte " + in_quotes(id), "an id in the file's member \"mattes\"");
        }
        pick.matte = grid->second.matte;
    } else {
        const Vec3 shown = displayed(pick.rgb, mattes.display.get());
        pick.hue = std::make_shared<const HueMatte>(shown);
    }
    return pick;
}

/// Names of mattes are ids, as Cursor::id() has them.
void require_id(const Cursor& grids, const std::string& name) {
    bool valid = !name.empty() && name.size() <= 64;
    for (std::size_t i = 0; valid && i < name.size(); ++i) {
        const char c = name[i];
        const bool word =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        valid = word || (i > 0 && (c == '_' || c == '-' || c == '.'));
    }
    if (!valid) {
        grids.fail("the member " + in_quotes(name),
                   "ids: 1 to 64 letters, digits, '_', '-' or '.', a letter or a digit first");
    }
}

Matte matte_from(const Cursor& grid, const std::string& text) {
    if (text.size() > kMaxMatteText) {
        grid.fail("a text of " + std::to_string(text.size()) + " characters",
                  "at most " + std::to_string(kMaxMatteText));
    }
    const char* const wanted =
        "base64 of a zlib stream of 147456 differences of log odds (docs/sidecar.md)";
    const std::optional<std::string> stream = from_base64(text);
    if (!stream) grid.fail("a text that is not base64", wanted);
    std::optional<std::vector<std::uint8_t>> bytes = inflated(*stream, MatteGrid::kSize);
    if (!bytes) grid.fail("a damaged matte, or one of another size", wanted);
    unsigned value = 0;
    for (std::uint8_t& byte : *bytes) {
        value = (value + byte) & 0xffu;
        if (value > 2 * Matte::kMiddle) {
            grid.fail("log odds of " + std::to_string(value), "0 to 126");
        }
        byte = static_cast<std::uint8_t>(value);
    }
    return {std::move(*bytes)};
}

}  // namespace

PickMattes read_mattes(const Cursor& where, int version, const PickMattes& known) {
    PickMattes mattes;
    if (version == 1) where.fail("mattes in a file of version 1", "version 2");
    where.require_members({"grids"}, {"display"});
    if (where.has("display")) {
        const Cursor curve = where.member("display");
        curve.require_members({"from", "to", "values"});
        DisplayCurve display{curve.member("from").number(-kMaxColour, kMaxColour),
                             curve.member("to").number(-kMaxColour, kMaxColour),
                             {}};
        if (!(display.from < display.to)) curve.member("to").wrong("a number above \"from\"");
        const Cursor values = curve.member("values");
        const std::size_t count = values.list("values", 4096);
        if (count < 2) values.wrong("at least 2 values");
        for (std::size_t i = 0; i < count; ++i) {
            display.values.push_back(values.element(i).number(-kMaxColour, kMaxColour));
        }
        mattes.display = std::make_shared<const DisplayCurve>(std::move(display));
    }
    const Cursor grids = where.member("grids");
    for (const std::string& id : grids.names("mattes", kMaxPicks)) {
        require_id(grids, id);
        const Cursor grid = grids.member(id.c_str());
        const auto same = known.grids.find(id);
        std::string text = grid.text();
        mattes.grids[id] =
            same != known.grids.end() && same->second.text == text
                ? same->second
                : PickMattes::Grid{text, std::make_shared<const Matte>(matte_from(grid, text))};
    }
    return mattes;
}

std::vector<Pick> read_picks(const Cursor& where, const PickMattes& mattes) {
    std::vector<Pick> picks;
    std::set<std::string> taken;
    std::size_t keys = 0, points = 0;
    for (std::size_t i = 0, n = where.list("picks and holds", kMaxPicks); i < n; ++i) {
        picks.push_back(read_pick(where.element(i), mattes, taken, keys, points));
    }
    return picks;
}

}  // namespace palette4d
