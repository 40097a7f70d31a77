// Sidecars from JSON trees, and their text.
#pragma once

#include <string>

#include "sidecar/json_tree.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d {

/// As parse_sidecar() for a tree in memory.
Sidecar sidecar_of(const Json& members, const std::string& name);
/// The palette of a sidecar with other edits: members "edits" and "mattes" of the newest version.
/// It has no versions. Mattes that `palette` has too are shared with it.
Sidecar with_edits(const Sidecar& palette, const Json& edits, const Json& mattes,
                   const std::string& name);
/// The text of members that sidecar_of() accepts, in the schema's order. Floats have the fewest
/// digits that read back to the same double. Throws SidecarError where it is too long to be read.
std::string sidecar_text(const Json& members, const std::string& name);

}  // namespace palette4d
