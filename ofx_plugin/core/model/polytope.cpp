#include "model/polytope.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include "model/polytope_validation.hpp"

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
                   std::vector<Section> sections)
    : vertices_(std::move(vertices)), edges_(std::move(edges)), sections_(std::move(sections)) {
    validate_vertices_and_edges(vertices_, edges_);
    edges_by_ends_ = sorted_indices(
        edges_.size(), [this](int i) { return std::make_pair(edges_[i].from, edges_[i].to); });
    vertices_by_id_ = sorted_indices(
        vertices_.size(), [this](int i) -> const std::string& { return vertices_[i].id; });
    edges_by_id_ =
        sorted_indices(edges_.size(), [this](int i) -> const std::string& { return edges_[i].id; });
    validate_sections(*this);
}

int Polytope::find_edge(int from, int to) const {
    return find_index(edges_by_ends_, std::make_pair(from, to),
                      [this](int i) { return std::make_pair(edges_[i].from, edges_[i].to); });
}

int Polytope::find_vertex(const std::string& id) const {
    return find_index(vertices_by_id_, id,
                      [this](int i) -> const std::string& { return vertices_[i].id; });
}

int Polytope::find_edge(const std::string& id) const {
    return find_index(edges_by_id_, id,
                      [this](int i) -> const std::string& { return edges_[i].id; });
}

int Polytope::section_at(double frame) const {
    // The first section that ends at or after the frame; a transition's end belongs to the block.
    auto at = std::lower_bound(sections_.begin(), sections_.end(), frame,
                               [](const Section& section, double t) { return section.last < t; });
    if (at == sections_.end()) return static_cast<int>(sections_.size()) - 1;
    if (at->transition && frame >= at->last) ++at;
    return static_cast<int>(std::distance(sections_.begin(), at));
}

}  // namespace palette4d
