// The members of a sidecar, read from the JSON tree: one source each. All throw SidecarError.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "sidecar/cursor.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d {

ClipInfo read_clip(const Cursor& clip);
std::shared_ptr<const ClipConversion> read_conversion(const Cursor& where, const std::string& file);
ColourConversion read_steps(const Cursor& steps, const std::string& file,
                            const std::string& pointer);

/// The ids of a polytope, which edits refer to.
struct Ids {
    std::unordered_map<std::string, int> vertices, edges;
    std::set<std::string> taken;  ///< by vertices and edges

    int vertex(const Cursor& where) const;
    int edge(const Cursor& where) const;
};
/// Vertices, edges and stops share one set of ids, so an id alone identifies a handle.
void claim(std::set<std::string>& taken, const Cursor& where, const std::string& id);

Polytope read_polytope(const Cursor& where, const ClipInfo& clip, const std::string& file,
                       Ids& ids);

Edits read_edits(const Cursor& where, const Polytope& polytope, const Ids& ids);
std::vector<NamedVersion> read_versions(const Cursor& where, const Polytope& polytope,
                                        const Ids& ids);
/// Checks the clip's weighted colours, which only the solver of picks reads.
void check_colours(const Cursor& colours);

}  // namespace palette4d
