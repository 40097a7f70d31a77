// The members of a sidecar, read from the JSON tree: one source each. All throw SidecarError.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "model/picks.hpp"
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

/// What all picks of a file share.
struct PickMattes {
    std::unordered_map<std::string, std::shared_ptr<const Matte>> grids;
    std::shared_ptr<const DisplayCurve> display;
    int version = 0;        ///< of the file
    double frame_step = 1;  ///< Edits::frame_step

    /// Null for an unknown id.
    std::shared_ptr<const Matte> of(const std::string& id) const;
};
PickMattes read_mattes(const Cursor& root, int version);
std::vector<Pick> read_picks(const Cursor& where, const PickMattes& mattes);

Edits read_edits(const Cursor& where, const Polytope& polytope, const Ids& ids,
                 const PickMattes& mattes);
std::vector<NamedVersion> read_versions(const Cursor& where, const Polytope& polytope,
                                        const Ids& ids, const PickMattes& mattes);
/// Checks the clip's weighted colours, which only Python reads.
void check_colours(const Cursor& colours);

}  // namespace palette4d
