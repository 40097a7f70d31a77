// Handles: what edits hold on to, and new colours for them from somebody else than the sidecar.
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
    int index;  ///< of polytope.vertices(), or of edits.stops
    double frame;
    Vec3 rgb;  ///< as edited; the vertex' own colour where it is not
};

/// All handles: the vertices in the polytope's order, then the stops in theirs.
std::vector<Handle> handles_of(const Polytope& polytope, const Edits& edits);
/// The place of an id in handles_of(), or -1.
int find_handle(const Polytope& polytope, const Edits& edits, const std::string& id);

/// A new colour for handles_of()[handle].
struct HandleColour {
    int handle;
    Vec3 rgb;
};

/// The edits with new colours laid over them; without `keep` the new colours alone. A stop without
/// a new colour is then no stop, a vertex has its own colour. Throws std::invalid_argument for a
/// handle that does not exist and for a colour that is not finite.
Edits with_colours(const Polytope& polytope, const Edits& edits, bool keep,
                   const std::vector<HandleColour>& colours);

}  // namespace palette4d
