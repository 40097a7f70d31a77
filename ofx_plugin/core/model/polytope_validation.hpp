// Checks the invariants of a polytope (see polytope.hpp).
#pragma once

#include "model/polytope.hpp"

namespace palette4d {

/// Checks vertices and edges alone: sizes, ids, numbers, indices. Throws SidecarError.
void validate_vertices_and_edges(const std::vector<Vertex>& vertices,
                                 const std::vector<Edge>& edges);
/// Checks sections, tracks, faces, and continuity of the palette across section boundaries. Throws
/// SidecarError.
void validate_sections(const Polytope& polytope);

}  // namespace palette4d
