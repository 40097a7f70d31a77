// The 4D skew polytope of section 4.1: vertices in RGB + time, inter-frame edges, and per-block
// topology. Immutable once built; its constructor checks what must hold between its parts.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "model/vec3.hpp"

namespace palette4d {

using Face = std::array<int, 3>;

/// A palette colour at one frame. `rgb` is in the palette's encoding (any finite value). `frame` is
/// the time t in the clip's frame numbers (not normalised; may be fractional). `name` says for
/// people what colour it is; it may be empty.
struct Vertex {
    std::string id;
    Vec3 rgb;
    double frame;
    std::string name = {};
};

/// An inter-frame edge; `from` and `to` index vertices and vertices[from].frame <
/// vertices[to].frame.
struct Edge {
    std::string id;
    int from;
    int to;
};

/// A time span with one palette topology: a block (section 5.3.1), closed [first, last], or a
/// transition between two adjacent blocks, open (first, last).
///
/// A track is one palette colour over that span: vertex indices in increasing frame order,
/// consecutive vertices joined by an edge. Tracks cover [first, last] and may exceed it, since an
/// edge may cross block boundaries. A track of one vertex is allowed only when first == last ==
/// that vertex's frame. `faces` are triangles of track indices: a closed 2-manifold, each directed
/// edge once, anticlockwise from outside. Palettes of one colour (1 track) or two (2 tracks) have
/// no faces; a flat palette is a two-sided polygon.
struct Section {
    double first;
    double last;
    bool transition;
    std::vector<std::vector<int>> tracks;
    std::vector<Face> faces;
};

/// Copies share their parts.
class Polytope {
public:
    Polytope() = default;
    /// Blocks and transitions alternate: sections[0] is a block, then transition, block, … Throws
    /// SidecarError (with an empty file name) when an invariant is violated.
    Polytope(std::vector<Vertex> vertices, std::vector<Edge> edges, std::vector<Section> sections);

    const std::vector<Vertex>& vertices() const { return parts_->vertices; }
    const std::vector<Edge>& edges() const { return parts_->edges; }
    const std::vector<Section>& sections() const { return parts_->sections; }
    double first_frame() const { return sections().front().first; }
    double last_frame() const { return sections().back().last; }
    /// Index of the edge from -> to, or -1.
    int find_edge(int from, int to) const;
    /// Index of the vertex / edge with that id, or -1.
    int find_vertex(const std::string& id) const;
    int find_edge(const std::string& id) const;
    /// The section at `frame` (clamped to the clip). At a block's ends the block wins.
    int section_at(double frame) const;

private:
    struct Parts {
        std::vector<Vertex> vertices;
        std::vector<Edge> edges;
        std::vector<Section> sections;
        std::map<std::pair<int, int>, int> edges_by_ends;
        std::unordered_map<std::string, int> vertices_by_id, edges_by_id;
    };
    std::shared_ptr<const Parts> parts_ = std::make_shared<const Parts>();
};

/// What a polytope's constructor checks: invariants between its parts. Numbers, counts, ids and
/// indices are checked where they are read. Both throw SidecarError.
void validate_edges(const std::vector<Vertex>& vertices, const std::vector<Edge>& edges);
void validate_sections(const Polytope& polytope);

}  // namespace palette4d
