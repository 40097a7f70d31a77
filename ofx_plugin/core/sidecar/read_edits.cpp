// The members "edits", "versions" and "colours": the user's edits, the picks and their solution.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "model/ramps.hpp"
#include "model/sidecar_error.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

/// In memory each version has a colour for each vertex.
constexpr std::size_t kMaxVersionVertices = 1'000'000;
/// More than the solver makes: each of a hundred picks has at most nine.
constexpr std::size_t kMaxBumps = 1000;
/// The solver takes a hundred that are enabled, and milliseconds for each key of a path.
constexpr std::size_t kMaxPicks = 1000, kMaxPathKeys = 20'000;
/// The analysis writes some hundreds.
constexpr std::size_t kMaxWeighted = 100'000;
/// Smallest radius of a bump, so that its square stays a normal float.
constexpr double kMinRadius = 1e-4;
/// Smallest share that distances to shades count, so that bumps stay finite.
constexpr double kMinShade = 0.1;

std::optional<Ramp> read_ramp(const Cursor& entry) {
    if (!entry.has("ramp")) return std::nullopt;
    constexpr Ramp kRamps[] = {Ramp::kLinear, Ramp::kSmooth, Ramp::kHold};
    return kRamps[entry.member("ramp").choice({"linear", "smooth", "hold"})];
}

/// Reads the members `edge` and `frame`: a place strictly inside an edge, `occupied` by nothing.
std::pair<int, double> read_place(const Cursor& entry, const Polytope& polytope, const Ids& ids,
                                  const char* what, std::set<std::pair<int, double>>& occupied) {
    const int at = ids.edge(entry.member("edge"));
    const Cursor frame = entry.member("frame");
    const double number = frame.frame();
    const Edge& edge = polytope.edges()[static_cast<std::size_t>(at)];
    const double from = polytope.vertices()[static_cast<std::size_t>(edge.from)].frame;
    const double to = polytope.vertices()[static_cast<std::size_t>(edge.to)].frame;
    if (!(number > from && number < to)) {
        frame.wrong("a frame inside the edge " + in_quotes(edge.id) + ", between " +
                    number_text(from) + " and " + number_text(to));
    }
    if (!occupied.emplace(at, number).second) {
        frame.fail("a second " + std::string(what) + " of the edge " + in_quotes(edge.id) +
                       " at this frame",
                   "at most one " + std::string(what) + " of an edge at a frame");
    }
    return {at, number};
}

double read_shade(const Cursor& entry) {
    return entry.has("shade") ? entry.member("shade").number(kMinShade, 1) : 1;
}

/// The length of a list, which with the `others` may have at most `most` entries.
std::size_t count_of(const Cursor& list, const char* what, std::size_t most,
                     std::size_t others = 0) {
    const std::size_t count = list.list(what);
    if (count + others > most) {
        list.fail(std::to_string(count + others) + " " + what,
                  "at most " + std::to_string(most) + " " + what);
    }
    return count;
}

Solution read_solution(const Cursor& where, const Polytope& polytope, const Ids& ids) {
    where.require_members({"vertices", "keys", "bumps"}, {"holds"});
    Solution solution;
    const Cursor vertices = where.member("vertices");
    const std::size_t moved = vertices.list("vertices that move");
    if (moved > 0) solution.vertex_by.resize(polytope.vertices().size());
    std::set<int> seen;
    for (std::size_t i = 0; i < moved; ++i) {
        const Cursor entry = vertices.element(i);
        entry.require_members({"vertex", "by"});
        const Cursor vertex = entry.member("vertex");
        const int at = ids.vertex(vertex);
        if (!seen.insert(at).second) {
            vertex.fail("the vertex " + in_quotes(vertex.text()) + " a second time",
                        "each vertex at most once");
        }
        solution.vertex_by[static_cast<std::size_t>(at)] = entry.member("by").rgb();
    }

    std::set<std::pair<int, double>> occupied;
    const Cursor keys = where.member("keys");
    for (std::size_t i = 0, n = keys.list("keys"); i < n; ++i) {
        const Cursor entry = keys.element(i);
        entry.require_members({"edge", "frame", "by"});
        const auto [edge, frame] = read_place(entry, polytope, ids, "key", occupied);
        solution.keys.push_back({edge, frame, entry.member("by").rgb()});
    }
    std::sort(solution.keys.begin(), solution.keys.end(), [](const auto& a, const auto& b) {
        return std::tie(a.edge, a.frame) < std::tie(b.edge, b.frame);
    });

    const Cursor bumps = where.member("bumps");
    for (std::size_t i = 0, n = count_of(bumps, "bumps", kMaxBumps); i < n; ++i) {
        const Cursor entry = bumps.element(i);
        entry.require_members({"radius", "keys"}, {"shade"});
        Solution::MovingBump bump{
            entry.member("radius").number(kMinRadius, kMaxColour), {}, read_shade(entry)};
        const Cursor steps = entry.member("keys");
        std::optional<double> previous;
        const std::size_t count = steps.list("keys");
        if (count == 0) steps.wrong("at least one key");
        for (std::size_t j = 0; j < count; ++j) {
            const Cursor step = steps.element(j);
            step.require_members({"frame", "rgb", "by"});
            bump.keys.push_back({step.member("frame").later_frame(previous),
                                 step.member("rgb").rgb(), step.member("by").rgb()});
        }
        solution.bumps.push_back(std::move(bump));
    }

    if (!where.has("holds")) return solution;
    const Cursor holds = where.member("holds");
    for (std::size_t i = 0, n = count_of(holds, "holds", kMaxBumps); i < n; ++i) {
        const Cursor entry = holds.element(i);
        entry.require_members({"keys"}, {"shade"});
        Solution::MovingHold hold{{}, read_shade(entry)};
        const Cursor steps = entry.member("keys");
        std::optional<double> previous;
        const std::size_t count = steps.list("keys");
        if (count == 0) steps.wrong("at least one key");
        for (std::size_t j = 0; j < count; ++j) {
            const Cursor step = steps.element(j);
            step.require_members({"frame", "rgb", "radius", "keep"});
            hold.keys.push_back({step.member("frame").later_frame(previous),
                                 step.member("rgb").rgb(),
                                 step.member("radius").number(kMinRadius, kMaxColour),
                                 step.member("keep").number(0, 1)});
        }
        solution.holds.push_back(std::move(hold));
    }
    return solution;
}

constexpr std::size_t kMostSpread = 8;

/// Checks what only the solver reads.
/// `keys`: how many keys the paths of the picks before have; this one's are added.
void check_pick(const Cursor& pick, std::set<std::string>& taken, std::size_t& keys) {
    pick.require_members(
        {"id", "kind", "frame", "rgb"},
        {"to", "toward", "from", "until", "fade", "radius", "global_only", "enabled", "path",
         "pixel", "box", "spread", "residual", "worst", "worst_frame", "global"});
    claim(taken, pick.member("id"), pick.member("id").id());
    pick.member("kind").choice({"pick", "hold"});
    pick.member("frame").frame();
    pick.member("rgb").rgb();
    if (pick.has("to")) pick.member("to").rgb();
    if (pick.has("toward")) pick.member("toward").choice({"shift", "colour"});
    if (pick.has("from")) pick.member("from").frame();
    if (pick.has("until")) pick.member("until").frame();
    if (pick.has("fade")) pick.member("fade").number(0, static_cast<double>(kMaxFrame));
    if (pick.has("radius")) pick.member("radius").number(kMinRadius, kMaxColour);
    if (pick.has("global_only")) pick.member("global_only").flag();
    if (pick.has("enabled")) pick.member("enabled").flag();
    if (pick.has("path")) {
        const Cursor path = pick.member("path");
        std::optional<double> previous;
        const std::size_t count = count_of(path, "colours over time in all", kMaxPathKeys, keys);
        keys += count;
        for (std::size_t i = 0; i < count; ++i) {
            const Cursor step = path.element(i);
            step.require_members({"frame", "rgb"}, {"given", "there"});
            step.member("frame").later_frame(previous);
            step.member("rgb").rgb();
            if (step.has("given")) step.member("given").flag();
            if (step.has("there")) step.member("there").number(0, 1);
        }
    }
    if (pick.has("pixel")) {
        const Cursor pixel = pick.member("pixel");
        if (pixel.list("2 numbers, x and y") != 2) pixel.wrong("a list of 2 numbers, x and y");
        for (std::size_t i = 0; i < 2; ++i) pixel.element(i).number(0.0, double{kMaxSize});
    }
    if (pick.has("box")) pick.member("box").integer(1, kMaxSize);
    if (pick.has("spread")) {
        const Cursor spread = pick.member("spread");
        const std::size_t count = spread.list("offsets");
        if (count > kMostSpread) spread.wrong("at most 8 offsets");
        for (std::size_t i = 0; i < count; ++i) spread.element(i).rgb();
    }
    if (pick.has("residual")) pick.member("residual").number(0, kMaxColour);
    if (pick.has("worst")) pick.member("worst").number(0, kMaxColour);
    if (pick.has("worst_frame")) pick.member("worst_frame").frame();
    if (pick.has("global")) pick.member("global").number(0, 1);
}

}  // namespace

void check_colours(const Cursor& colours) {
    std::optional<double> previous;
    std::size_t in_all = 0;
    for (std::size_t i = 0, n = colours.list("frames with colours"); i < n; ++i) {
        const Cursor entry = colours.element(i);
        entry.require_members({"frame", "rgbw"});
        entry.member("frame").later_frame(previous);
        const Cursor rows = entry.member("rgbw");
        const std::size_t count = count_of(rows, "colours in all", kMaxWeighted, in_all);
        if (count == 0) rows.wrong("at least one colour");
        in_all += count;
        for (std::size_t j = 0; j < count; ++j) {
            const Cursor row = rows.element(j);
            if (row.list("4 numbers") != 4) row.wrong("a list of 4 numbers: r, g, b and weight");
            for (std::size_t c = 0; c < 3; ++c) row.element(c).number(kMaxColour, "a number");
            row.element(3).number(0, 1);
        }
    }
}

Edits read_edits(const Cursor& where, const Polytope& polytope, const Ids& ids) {
    where.require_members({"vertices", "stops"}, {"ramp", "picks", "locks", "solution"});
    Edits edits;
    edits.vertex_rgb.resize(polytope.vertices().size());
    edits.vertex_ramp.resize(edits.vertex_rgb.size());
    edits.default_ramp = read_ramp(where).value_or(Ramp::kLinear);
    const Cursor vertices = where.member("vertices");
    for (std::size_t i = 0, n = vertices.list("vertex edits"); i < n; ++i) {
        const Cursor entry = vertices.element(i);
        entry.require_members({"vertex", "rgb"}, {"ramp"});
        const Cursor vertex = entry.member("vertex");
        const auto at = static_cast<std::size_t>(ids.vertex(vertex));
        if (edits.vertex_rgb[at]) {
            vertex.fail("a second edit of the vertex " + in_quotes(vertex.text()),
                        "at most one edit of each vertex");
        }
        edits.vertex_rgb[at] = entry.member("rgb").rgb();
        edits.vertex_ramp[at] = read_ramp(entry);
    }

    std::set<std::string> taken = ids.taken;
    std::set<std::pair<int, double>> occupied;
    const Cursor stops = where.member("stops");
    for (std::size_t i = 0, n = stops.list("stops"); i < n; ++i) {
        const Cursor entry = stops.element(i);
        entry.require_members({"id", "edge", "frame", "rgb"}, {"ramp"});
        const Cursor id = entry.member("id");
        Stop stop{id.id(), 0, 0, entry.member("rgb").rgb(), read_ramp(entry)};
        std::tie(stop.edge, stop.frame) = read_place(entry, polytope, ids, "stop", occupied);
        claim(taken, id, stop.id);
        edits.stops.push_back(std::move(stop));
    }
    edits.stop_order = order_of(edits.stops);

    if (where.has("picks")) {
        const Cursor picks = where.member("picks");
        std::set<std::string> pick_ids;
        std::size_t keys = 0;
        for (std::size_t i = 0, n = count_of(picks, "picks and holds", kMaxPicks); i < n; ++i) {
            check_pick(picks.element(i), pick_ids, keys);
        }
    }
    if (where.has("locks")) {
        const Cursor locks = where.member("locks");
        for (std::size_t i = 0, n = locks.list("ids"); i < n; ++i) locks.element(i).id();
    }
    if (where.has("solution")) {
        edits.solution = read_solution(where.member("solution"), polytope, ids);
    }
    return edits;
}

std::vector<NamedVersion> read_versions(const Cursor& where, const Polytope& polytope,
                                        const Ids& ids) {
    std::vector<NamedVersion> versions;
    std::set<std::string> taken;
    const std::size_t n = where.list("versions"), vertices = polytope.vertices().size();
    if (n * vertices > kMaxVersionVertices) {
        where.fail(std::to_string(n) + " versions of " + std::to_string(vertices) + " vertices",
                   "versions times vertices of at most " + std::to_string(kMaxVersionVertices));
    }
    for (std::size_t i = 0; i < n; ++i) {
        const Cursor entry = where.element(i);
        entry.require_members({"name", "edits"});
        const Cursor name = entry.member("name");
        versions.push_back({name.name(), read_edits(entry.member("edits"), polytope, ids)});
        if (!taken.insert(versions.back().name).second) {
            name.fail("a second version " + in_quotes(name.text()), "each name only once");
        }
    }
    return versions;
}

}  // namespace palette4d
