#include "model/polytope.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace palette4d {
namespace {

template <class Key>
std::vector<int> sorted_indices(std::size_t count, Key key) {
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
    return order;
}

template <class Wanted, class Key>
int find_index(const std::vector<int>& order, const Wanted& wanted, Key key) {
    const auto at = std::lower_bound(order.begin(), order.end(), wanted,
                                     [&](int i, const Wanted& w) { return key(i) < w; });
    return at != order.end() && key(*at) == wanted ? *at : -1;
}

}  // namespace

Polytope::Polytope(std::vector<Vertex> vertices, std::vector<Edge> edges,
                   std::vector<Section> sections) {
    validate_edges(vertices, edges);
    const auto parts = std::make_shared<Parts>();
    parts->edges_by_ends = sorted_indices(
        edges.size(), [&](int i) { return std::make_pair(edges[i].from, edges[i].to); });
    parts->vertices_by_id = sorted_indices(
        vertices.size(), [&](int i) -> const std::string& { return vertices[i].id; });
    parts->edges_by_id =
        sorted_indices(edges.size(), [&](int i) -> const std::string& { return edges[i].id; });
    parts->vertices = std::move(vertices);
    parts->edges = std::move(edges);
    parts->sections = std::move(sections);
    parts_ = parts;
    validate_sections(*this);
}

int Polytope::find_edge(int from, int to) const {
    return find_index(parts_->edges_by_ends, std::make_pair(from, to),
                      [this](int i) { return std::make_pair(edges()[i].from, edges()[i].to); });
}

int Polytope::find_vertex(const std::string& id) const {
    return find_index(parts_->vertices_by_id, id,
                      [this](int i) -> const std::string& { return vertices()[i].id; });
}

int Polytope::find_edge(const std::string& id) const {
    return find_index(parts_->edges_by_id, id,
                      [this](int i) -> const std::string& { return edges()[i].id; });
}

int Polytope::section_at(double frame) const {
    // The first section that ends at or after the frame; a transition's end belongs to the block.
    auto at = std::lower_bound(sections().begin(), sections().end(), frame,
                               [](const Section& section, double t) { return section.last < t; });
    if (at == sections().end()) return static_cast<int>(sections().size()) - 1;
    if (at->transition && frame >= at->last) ++at;
    return static_cast<int>(std::distance(sections().begin(), at));
}

}  // namespace palette4d
