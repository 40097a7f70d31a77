// The members of a sidecar, read from a JSON tree that fits the schema: one source each. All throw
// SidecarError for what no schema can say.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "model/picks.hpp"
#include "sidecar/cursor.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d {

ClipInfo read_clip(const Cursor& clip);
std::shared_ptr<const ClipConversion> read_conversion(const Cursor& where);
ColourConversion read_steps(const Cursor& steps);

/// An index that was looked up; refuses -1, an unknown id. `all`: "12 vertices".
int known(const Cursor& where, int index, const char* kind, const std::string& all);
/// Refuses an id or a name that is taken. Vertices, edges and stops share one set of ids, so an id
/// alone identifies a handle.
void claim(std::set<std::string>& taken, const Cursor& id);

Polytope read_polytope(const Cursor& where, const ClipInfo& clip);

/// Mattes that `known` has with the same text are shared with it.
PickMattes read_mattes(const Cursor& mattes, const PickMattes& known);
std::vector<Pick> read_picks(const Cursor& where, const PickMattes& mattes);

/// Edits of a sidecar whose clip, polytope and mattes are known.
Edits read_edits(const Cursor& where, const Sidecar& of);
std::vector<NamedVersion> read_versions(const Cursor& where, const Sidecar& of);
/// Checks the clip's weighted colours, which only Python reads.
void check_colours(const Cursor& colours);

}  // namespace palette4d
