// Checks the invariants of a polytope (see polytope.hpp) that hold between its parts. Numbers,
// counts, ids and indices are checked where they are read.
#pragma once

#include "model/polytope.hpp"

namespace palette4d {

/// Checks that edges run forwards, and between two vertices once. Throws SidecarError.
void validate_edges(const std::vector<Vertex>& vertices, const std::vector<Edge>& edges);
/// Checks sections, tracks, faces, and continuity of the palette across section boundaries. Throws
/// SidecarError.
void validate_sections(const Polytope& polytope);

}  // namespace palette4d
