// Handles: the colours that a user can edit, and new colours for them from the host.
#pragma once

#include <string>
#include <vector>

#include "model/edits.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// A palette vertex or a colour stop.
struct Handle {
    std::string id;
    bool stop;
    int index;  ///< into polytope.vertices(), or edits.stops
    double frame;
    Vec3 rgb;  ///< as edited, else the vertex's own colour
    /// The name of its colour before edits; a stop's is that of the nearer end of its edge.
    std::string name;
};

/// All handles: the polytope's vertices in order, then the stops in order.
std::vector<Handle> handles_of(const Polytope& polytope, const Edits& edits);
/// The index of an id in handles_of(), or -1.
int find_handle(const Polytope& polytope, const Edits& edits, const std::string& id);

/// A new colour for handles_of()[handle].
struct HandleColour {
    int handle;
    Vec3 rgb;
};

/// The edits overridden by new colours; without `keep` the new colours alone. Stops without a new
/// colour are then dropped, and vertices keep their own colour. Throws std::invalid_argument for an
/// unknown handle or a colour that is not finite.
Edits with_colours(const Polytope& polytope, const Edits& edits, bool keep,
                   const std::vector<HandleColour>& colours);

}  // namespace palette4d
