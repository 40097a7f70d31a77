#include "model/polytope.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace palette4d {
namespace {

template <class Map>
int found_in(const Map& map, const typename Map::key_type& wanted) {
    const auto at = map.find(wanted);
    return at == map.end() ? -1 : at->second;
}

}  // namespace

Polytope::Polytope(std::vector<Vertex> vertices, std::vector<Edge> edges,
                   std::vector<Section> sections) {
    validate_edges(vertices, edges);
    const auto parts = std::make_shared<Parts>();
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        parts->vertices_by_id.emplace(vertices[i].id, static_cast<int>(i));
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
        parts->edges_by_id.emplace(edges[i].id, static_cast<int>(i));
        parts->edges_by_ends.emplace(std::make_pair(edges[i].from, edges[i].to),
                                     static_cast<int>(i));
    }
    parts->vertices = std::move(vertices);
    parts->edges = std::move(edges);
    parts->sections = std::move(sections);
    parts_ = parts;
    validate_sections(*this);
}

int Polytope::find_edge(int from, int to) const {
    return found_in(parts_->edges_by_ends, {from, to});
}

int Polytope::find_vertex(const std::string& id) const {
    return found_in(parts_->vertices_by_id, id);
}

int Polytope::find_edge(const std::string& id) const { return found_in(parts_->edges_by_id, id); }

int Polytope::section_at(double frame) const {
    // The first section that ends at or after the frame; a transition's end belongs to the block.
    auto at = std::lower_bound(sections().begin(), sections().end(), frame,
                               [](const Section& section, double t) { return section.last < t; });
    if (at == sections().end()) return static_cast<int>(sections().size()) - 1;
    if (at->transition && frame >= at->last) ++at;
    return static_cast<int>(std::distance(sections().begin(), at));
}

}  // namespace palette4d
