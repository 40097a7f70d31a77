#include "model/handles.hpp"

#include <optional>
#include <stdexcept>

#include "model/vec3.hpp"

namespace palette4d {

std::vector<Handle> handles_of(const Polytope& polytope, const Edits& edits) {
    std::vector<Handle> handles;
    const std::vector<Vertex>& vertices = polytope.vertices();
    handles.reserve(vertices.size() + edits.stops.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Vertex& vertex = vertices[i];
        const bool edited = i < edits.vertex_rgb.size() && edits.vertex_rgb[i].has_value();
        handles.push_back({vertex.id, false, static_cast<int>(i), vertex.frame,
                           edited ? *edits.vertex_rgb[i] : vertex.rgb, vertex.name});
    }
    for (std::size_t i = 0; i < edits.stops.size(); ++i) {
        const Stop& stop = edits.stops[i];
        const Edge& edge = polytope.edges()[static_cast<std::size_t>(stop.edge)];
        const Vertex& from = vertices[static_cast<std::size_t>(edge.from)];
        const Vertex& to = vertices[static_cast<std::size_t>(edge.to)];
        const bool later = to.frame - stop.frame < stop.frame - from.frame;
        handles.push_back({stop.id, true, static_cast<int>(i), stop.frame, stop.rgb,
                           later ? to.name : from.name});
    }
    return handles;
}

int find_handle(const Polytope& polytope, const Edits& edits, const std::string& id) {
    const int vertex = polytope.find_vertex(id);
    if (vertex >= 0) return vertex;
    for (std::size_t i = 0; i < edits.stops.size(); ++i) {
        if (edits.stops[i].id == id) return static_cast<int>(polytope.vertices().size() + i);
    }
    return -1;
}

Edits with_colours(const Polytope& polytope, const Edits& edits, bool keep,
                   const std::vector<HandleColour>& colours) {
    const std::size_t vertices = polytope.vertices().size();
    Edits result;
    if (keep) {
        result = edits;  // with the order of its stops
        result.stops.clear();
    }
    result.vertex_rgb.resize(vertices);
    std::vector<std::optional<Vec3>> stops(edits.stops.size());
    for (const HandleColour& colour : colours) {
        const auto at = static_cast<std::size_t>(colour.handle);
        if (colour.handle < 0 || at >= vertices + stops.size()) {
            throw std::invalid_argument("with_colours: handle " + std::to_string(colour.handle) +
                                        ", expected less than " +
                                        std::to_string(vertices + stops.size()));
        }
        if (!finite(colour.rgb)) {
            throw std::invalid_argument("with_colours: a colour that is not finite");
        }
        (at < vertices ? result.vertex_rgb[at] : stops[at - vertices]) = colour.rgb;
    }
    for (std::size_t i = 0; i < stops.size(); ++i) {
        if (!keep && !stops[i]) continue;
        result.stops.push_back(edits.stops[i]);
        if (stops[i]) result.stops.back().rgb = *stops[i];
    }
    return result;
}

}  // namespace palette4d
