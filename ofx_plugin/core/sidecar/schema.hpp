// The JSON Schema of sidecars (src/palette4d/sidecar_v2.schema.json): the order and the form in
// which members are written.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace palette4d {

struct Schema {
    using Shared = std::shared_ptr<const Schema>;
    std::vector<std::pair<std::string, Shared>> members;  ///< in the file's order
    Shared others, items;  ///< of members with other names, of elements; null: as they are
    bool rows = false;     ///< each element has a line
    bool whole = false;    ///< 24.0 is written as 24
    bool real = false;     ///< the elements: 24 is written as 24.0
};

const Schema& sidecar_schema();

}  // namespace palette4d
