// The members "edits", "versions" and "colours".
#include <cstddef>
#include <optional>
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
    const Cursor ramp = entry.member("ramp");
    return ramp.is("smooth") ? Ramp::kSmooth : ramp.is("hold") ? Ramp::kHold : Ramp::kLinear;
}

/// Reads a stop: its place is strictly inside an edge, `occupied` by nothing.
Stop read_stop(const Cursor& entry, const Polytope& polytope,
               std::set<std::pair<int, double>>& occupied) {
    const Cursor id = entry.member("edge"), frame = entry.member("frame");
    const int at = known(id, polytope.find_edge(id.text()), "edge",
                         std::to_string(polytope.edges().size()) + " edges");
    const double number = frame.number();
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
    return {entry.member("id").text(), at, number, entry.member("rgb").three(), read_ramp(entry)};
}

}  // namespace

void check_colours(const Cursor& colours) {
    std::optional<double> previous;
    std::size_t in_all = 0;
    for (std::size_t i = 0; i < colours.size(); ++i) {
        const Cursor entry = colours.element(i), rows = entry.member("rgbw");
        entry.member("frame").later(previous);
        rows.limit(in_all += rows.size(), kMaxWeighted, "colours in all");
    }
}

Edits read_edits(const Cursor& where, const Sidecar& of) {
    const Polytope& polytope = of.polytope;
    Edits edits;
    edits.width = static_cast<double>(of.clip.width);
    edits.height = static_cast<double>(of.clip.height);
    edits.vertex_rgb.resize(polytope.vertices().size());
    edits.vertex_ramp.resize(edits.vertex_rgb.size());
    edits.default_ramp = read_ramp(where).value_or(Ramp::kLinear);
    const Cursor vertices = where.member("vertices");
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Cursor entry = vertices.element(i), vertex = entry.member("vertex");
        const auto at = static_cast<std::size_t>(
            known(vertex, polytope.find_vertex(vertex.text()), "vertex",
                  std::to_string(polytope.vertices().size()) + " vertices"));
        if (edits.vertex_rgb[at]) {
            vertex.fail("a second edit of the vertex " + in_quotes(vertex.text()),
                        "at most one edit of each vertex");
        }
        edits.vertex_rgb[at] = entry.member("rgb").three();
        edits.vertex_ramp[at] = read_ramp(entry);
    }

    std::set<std::string> taken;
    std::set<std::pair<int, double>> occupied;
    const Cursor stops = where.member("stops");
    for (std::size_t i = 0; i < stops.size(); ++i) {
        const Cursor entry = stops.element(i);
        Stop stop = read_stop(entry, polytope, occupied);
        const bool palette = polytope.find_vertex(stop.id) >= 0 || polytope.find_edge(stop.id) >= 0;
        if (palette) taken.insert(stop.id);
        claim(taken, entry.member("id"));
        edits.stops.push_back(std::move(stop));
    }
    edits.stop_order = order_of(edits.stops);
    edits.display = of.mattes.display;
    if (where.has("picks")) edits.picks = read_picks(where.member("picks"), of.mattes);
    return edits;
}

std::vector<NamedVersion> read_versions(const Cursor& where, const Sidecar& of) {
    std::vector<NamedVersion> versions;
    std::set<std::string> taken;
    const std::size_t n = where.size(), vertices = of.polytope.vertices().size();
    if (n * vertices > kMaxVersionVertices) {
        where.fail(std::to_string(n) + " versions of " + std::to_string(vertices) + " vertices",
                   "versions times vertices of at most " + std::to_string(kMaxVersionVertices));
    }
    for (std::size_t i = 0; i < n; ++i) {
        const Cursor entry = where.element(i), name = entry.member("name");
        claim(taken, name);
        versions.push_back({name.text(), read_edits(entry.member("edits"), of)});
    }
    return versions;
}

}  // namespace palette4d
