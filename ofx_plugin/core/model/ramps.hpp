// Edits through time: what the handles of a polytope do to the palette of a frame.
#pragma once

#include <vector>

#include "model/edits.hpp"
#include "model/slice.hpp"

namespace palette4d {

/// The indices of stops by edge and frame: Edits::stop_order.
std::vector<int> order_of(const std::vector<Stop>& stops);

/// The edited colours of a slice's n vertices: displacements go from handle to handle along a ramp,
/// Bit-identical to slice.rgb[i] where nothing on the edge moves. Throws
/// std::invalid_argument for edits of another number of vertices.
std::vector<Vec3> edited_colours(const Polytope& polytope, const Edits& edits, const Slice& slice);

}  // namespace palette4d
