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

/// Of one set of edits, which may be drawn: each takes 0.6 MB, and time, for each frame. As
/// MOST_PICKS of grade/picks.py.
constexpr std::size_t kMaxEnabled = 100;
/// Each key of a path costs time for each frame.
constexpr std::size_t kMaxPathKeys = 20'000;
/// Areas in all, each of which takes memory and time when its pick is learned, and their points; of
/// a stroke drawn by hand there are some hundreds.
constexpr std::size_t kMaxAreas = 200, kMaxPoints = 100'000;

/// What the picks of a file have together.
struct Counts {
    std::set<std::string> ids;
    std::size_t enabled = 0, keys = 0, areas = 0, points = 0;
};

PickWindow read_window(const Cursor& where, Counts& counts) {
    PickWindow window{where.member("feather").number(), {}};
    window.inverted = where.json().value("inverted", false);
    const Cursor keys = where.member("keys");
    keys.limit(counts.keys += keys.size(), kMaxPathKeys, "colours and boxes over time in all");
    std::optional<double> previous;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const Cursor key = keys.element(i), box = key.member("box");
        PickWindow::Key read{key.member("frame").later(previous), {}};
        for (std::size_t side = 0; side < 4; ++side) read.box[side] = box.element(side).number();
        if (!(read.box[0] < read.box[2] && read.box[1] < read.box[3])) {
            box.wrong("a left edge before the right one, and a top above the bottom");
        }
        window.keys.push_back(read);
    }
    return window;
}

Pick read_pick(const Cursor& where, const PickMattes& mattes, Counts& counts) {
    const Json& fields = where.json();
    const auto frame = [&](const char* name) {
        return where.has(name) ? std::optional(where.member(name).number()) : std::nullopt;
    };
    Pick pick;
    pick.id = where.member("id").text();
    claim(counts.ids, where.member("id"));
    pick.hold = where.member("kind").is("hold");
    pick.frame = where.member("frame").number();
    pick.rgb = pick.to = where.member("rgb").three();
    if (where.has("to")) pick.to = where.member("to").three();
    pick.toward_colour = where.has("toward") && where.member("toward").is("colour");
    pick.from = frame("from");
    pick.until = frame("until");
    pick.fade = fields.value("fade", 0.0);
    pick.fade_out = frame("fade_out");
    pick.enabled = fields.value("enabled", true);
    counts.enabled += pick.enabled;
    if (where.has("path")) {
        const Cursor path = where.member("path");
        path.limit(counts.keys += path.size(), kMaxPathKeys, "colours and boxes over time in all");
        std::optional<double> previous;
        for (std::size_t i = 0; i < path.size(); ++i) {
            const Cursor key = path.element(i);
            pick.path.push_back({key.member("frame").later(previous), key.member("rgb").three(),
                                 key.json().value("there", 1.0)});
        }
    }
    if (where.has("areas")) {
        const Cursor areas = where.member("areas");
        areas.limit(counts.areas += areas.size(), kMaxAreas, "areas in all");
        for (std::size_t i = 0; i < areas.size(); ++i) {
            const Cursor area = areas.element(i), points = area.member("points");
            points.limit(counts.points += points.size(), kMaxPoints, "points of areas in all");
        }
    }
    pick.reach = fields.value("reach", pick.reach);
    pick.softness = fields.value("softness", pick.softness);
    if (where.has("lightness")) {
        const Cursor range = where.member("lightness");
        pick.darkest = range.element(0).number();
        pick.lightest = range.element(1).number();
        if (!(pick.darkest < pick.lightest)) {
            range.wrong("a lowest lightness below the highest one");
        }
    }
    if (where.has("window")) {
        const Cursor window = where.member("window");
        if (pick.hold) window.wrong("no window of a hold: picks alone have one");
        pick.window = read_window(window, counts);
    }
    if (where.has("matte")) {
        const Cursor name = where.member("matte");
        const auto grid = mattes.grids.find(name.text());
        if (grid == mattes.grids.end()) {
            name.fail("the matte " + in_quotes(name.text()),
                      "an id in the file's member \"mattes\"");
        }
        pick.matte = grid->second.matte;
    } else {
        const Vec3 shown = displayed(pick.rgb, mattes.display.get());
        pick.hue = std::make_shared<const HueMatte>(shown);
    }
    return pick;
}

Matte matte_from(const Cursor& grid, const std::string& text) {
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

PickMattes read_mattes(const Cursor& where, const PickMattes& known) {
    PickMattes mattes;
    if (where.has("display")) {
        const Cursor curve = where.member("display"), to = curve.member("to");
        DisplayCurve display{curve.member("from").number(), to.number(), curve.json()["values"]};
        if (!(display.from < display.to)) to.wrong("a number above \"from\"");
        mattes.display = std::make_shared<const DisplayCurve>(std::move(display));
    }
    const Cursor grids = where.member("grids");
    for (const auto& [id, value] : grids.json().items()) {
        const auto same = known.grids.find(id);
        std::string text = value;
        mattes.grids[id] =
            same != known.grids.end() && same->second.text == text
                ? same->second
                : PickMattes::Grid{text, std::make_shared<const Matte>(
                                             matte_from(grids.member(id.c_str(), value), text))};
    }
    return mattes;
}

std::vector<Pick> read_picks(const Cursor& where, const PickMattes& mattes) {
    std::vector<Pick> picks;
    Counts counts;
    for (std::size_t i = 0; i < where.size(); ++i) {
        picks.push_back(read_pick(where.element(i), mattes, counts));
    }
    where.limit(counts.enabled, kMaxEnabled, "enabled picks and holds");
    return picks;
}

}  // namespace palette4d
