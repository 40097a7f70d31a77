// The members "edits", "versions" and "colours".
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
/// The analysis writes some hundreds.
constexpr std::size_t kMaxWeighted = 100'000;
std::optional<Ramp> read_ramp(const Cursor& entry) {
    if (!entry.has("ramp")) return std::nullopt;
    constexpr Ramp kRamps[] = {Ramp::kLinear, Ramp::kSmooth, Ramp::kHold};
    return kRamps[entry.member("ramp").choice({"linear", "smooth", "hold"})];
}

/// Reads the members `edge` and `frame`: a place strictly inside an edge, `occupied` by nothing.
std::pair<int, double> read_place(const Cursor& entry, const Polytope& polytope,
                                  std::set<std::pair<int, double>>& occupied) {
    const Cursor id = entry.member("edge");
    const int at = known(id, polytope.find_edge(id.id()), "edge",
                         std::to_string(polytope.edges().size()) + " edges");
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
        frame.fail("a second stop of the edge " + in_quotes(edge.id) + " at this frame",
                   "at most one stop of an edge at a frame");
    }
    return {at, number};
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
        const std::size_t count = rows.list("colours in all", kMaxWeighted, in_all);
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

Edits read_edits(const Cursor& where, const Polytope& polytope, const PickMattes& mattes) {
    if (mattes.version == 1) {
        // "solution" moved palette colours for picks.
        where.require_members({"vertices", "stops"}, {"ramp", "picks", "locks", "solution"});
    } else {
        where.require_members({"vertices", "stops"}, {"ramp", "picks", "locks"});
    }
    Edits edits;
    edits.frame_step = mattes.frame_step;
    edits.vertex_rgb.resize(polytope.vertices().size());
    edits.vertex_ramp.resize(edits.vertex_rgb.size());
    edits.default_ramp = read_ramp(where).value_or(Ramp::kLinear);
    const Cursor vertices = where.member("vertices");
    for (std::size_t i = 0, n = vertices.list("vertex edits"); i < n; ++i) {
        const Cursor entry = vertices.element(i);
        entry.require_members({"vertex", "rgb"}, {"ramp"});
        const Cursor vertex = entry.member("vertex");
        const auto at = static_cast<std::size_t>(
            known(vertex, polytope.find_vertex(vertex.id()), "vertex",
                  std::to_string(polytope.vertices().size()) + " vertices"));
        if (edits.vertex_rgb[at]) {
            vertex.fail("a second edit of the vertex " + in_quotes(vertex.text()),
                        "at most one edit of each vertex");
        }
        edits.vertex_rgb[at] = entry.member("rgb").rgb();
        edits.vertex_ramp[at] = read_ramp(entry);
    }

    std::set<std::string> taken;
    std::set<std::pair<int, double>> occupied;
    const Cursor stops = where.member("stops");
    for (std::size_t i = 0, n = stops.list("stops"); i < n; ++i) {
        const Cursor entry = stops.element(i);
        entry.require_members({"id", "edge", "frame", "rgb"}, {"ramp"});
        const Cursor id = entry.member("id");
        Stop stop{id.id(), 0, 0, entry.member("rgb").rgb(), read_ramp(entry)};
        std::tie(stop.edge, stop.frame) = read_place(entry, polytope, occupied);
        const bool palette = polytope.find_vertex(stop.id) >= 0 || polytope.find_edge(stop.id) >= 0;
        if (palette) taken.insert(stop.id);
        claim(taken, id, stop.id);
        edits.stops.push_back(std::move(stop));
    }
    edits.stop_order = order_of(edits.stops);

    edits.display = mattes.display;
    if (where.has("picks")) edits.picks = read_picks(where.member("picks"), mattes);
    if (where.has("locks")) {
        const Cursor locks = where.member("locks");
        for (std::size_t i = 0, n = locks.list("ids"); i < n; ++i) locks.element(i).id();
    }
    return edits;
}

std::vector<NamedVersion> read_versions(const Cursor& where, const Polytope& polytope,
                                        const PickMattes& mattes) {
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
        versions.push_back({name.name(), read_edits(entry.member("edits"), polytope, mattes)});
        if (!taken.insert(versions.back().name).second) {
            name.fail("a second version " + in_quotes(name.text()), "each name only once");
        }
    }
    return versions;
}

}  // namespace palette4d
