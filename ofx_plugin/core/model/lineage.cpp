#include "model/lineage.hpp"

#include <stdexcept>

#include "model/vec3.hpp"

namespace palette4d {

Lineage::Lineage(const Polytope& polytope, const Edits& edits, int handle)
    : vertices_(polytope.vertices().size()), edges_(polytope.edges().size()) {
    const auto at = static_cast<std::size_t>(handle);
    if (handle < 0 || at >= vertices_.size() + edits.stops.size()) {
        throw std::invalid_argument("Lineage: handle " + std::to_string(handle) +
                                    ", expected less than " +
                                    std::to_string(vertices_.size() + edits.stops.size()));
    }
    if (at < vertices_.size()) {
        follow(polytope, handle, true);
        vertices_[at] = false;  // so that the way back visits it again
        follow(polytope, handle, false);
        return;
    }
    const int edge = edits.stops[at - vertices_.size()].edge;
    edges_[static_cast<std::size_t>(edge)] = true;
    follow(polytope, polytope.edges()[static_cast<std::size_t>(edge)].to, true);
    follow(polytope, polytope.edges()[static_cast<std::size_t>(edge)].from, false);
}

void Lineage::follow(const Polytope& polytope, int vertex, bool forwards) {
    // Edges run forwards in time, so the search ends.
    std::vector<int> open = {vertex};
    while (!open.empty()) {
        const int from = open.back();
        open.pop_back();
        if (vertices_[static_cast<std::size_t>(from)]) continue;
        vertices_[static_cast<std::size_t>(from)] = true;
        for (std::size_t e = 0; e < edges_.size(); ++e) {
            const Edge& edge = polytope.edges()[e];
            if ((forwards ? edge.from : edge.to) != from) continue;
            edges_[e] = true;
            open.push_back(forwards ? edge.to : edge.from);
        }
    }
}

bool Lineage::holds(const SlicePoint& point) const {
    return point.edge < 0 ? vertices_[static_cast<std::size_t>(point.from)]
                          : edges_[static_cast<std::size_t>(point.edge)];
}

std::vector<Vec3> weight_reader(const Slice& slice, const Lineage& lineage) {
    std::vector<Vec3> edited = slice.rgb;
    for (std::size_t i = 0; i < edited.size(); ++i) {
        if (lineage.holds(slice.where[i])) edited[i] = edited[i] + Vec3{1, 1, 1};
    }
    return edited;
}

std::vector<Vec3> surface_reader(const Slice& slice) {
    std::vector<Vec3> edited = slice.rgb;
    for (Vec3& colour : edited) colour = colour + colour;
    return edited;
}

}  // namespace palette4d
