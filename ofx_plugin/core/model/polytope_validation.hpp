// The invariants of a polytope (see polytope.hpp), apart from the class that relies on them.
#pragma once

#include "model/polytope.hpp"

namespace palette4d {

/// Vertices and edges on their own: sizes, ids, numbers, indices. Throws SidecarError.
void validate_vertices_and_edges(const std::vector<Vertex>& vertices,
                                 const std::vector<Edge>& edges);
/// Sections, tracks, faces, and that the palette goes on across their boundaries. Throws
/// SidecarError.
void validate_sections(const Polytope& polytope);

}  // namespace palette4d
