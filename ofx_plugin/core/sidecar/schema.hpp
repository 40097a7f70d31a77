// The JSON Schema of sidecars (src/palette4d/sidecar_v2.schema.json): what a file may hold, and the
// order and the form in which members are written.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sidecar/cursor.hpp"

namespace palette4d {

struct Schema {
    using Shared = std::shared_ptr<const Schema>;
    /// `type`, or what says more: `format`, the values of `enum` and `const`, `anyOf`.
    std::string kind;
    std::vector<Json> choices;     ///< of kind "enum"
    std::vector<Shared> variants;  ///< of kind "anyOf": objects, told apart by "kind"
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    std::size_t fewest = 0;                                      ///< elements
    std::size_t most = std::numeric_limits<std::size_t>::max();  ///< elements, members, bytes
    std::string of;                                              ///< what the elements are
    std::vector<std::pair<std::string, Shared>> members;         ///< in the file's order
    std::vector<std::string> required;
    std::vector<std::string> former;  ///< members of version 1 that nothing reads
    bool closed = false;              ///< no other members
    bool named_by_ids = false;        ///< names of members are ids
    Shared others, items;  ///< of members with other names, of elements; null: as they are
    bool rows = false;     ///< each element has a line
    bool whole = false;    ///< 24.0 is written as 24
    bool real = false;     ///< the elements: 24 is written as 24.0

    const Schema& member(const std::string& name) const;
};

const Schema& sidecar_schema();
/// Throws SidecarError at the first value that the schema does not allow in a file of a version.
void check(const Cursor& value, const Schema& schema, int version);

}  // namespace palette4d
