// The user's edits (section 6.3): new colours of palette vertices, and colour stops on edges.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// A colour stop: at `frame`, strictly inside edge `edge`, the edited palette colour is `rgb`.
struct Stop {
    std::string id;
    int edge;
    double frame;
    Vec3 rgb;
};

struct Edits {
    /// One element per polytope vertex; empty where the vertex keeps its colour.
    std::vector<std::optional<Vec3>> vertex_rgb;
    /// At most one stop per edge and frame; any order.
    std::vector<Stop> stops;
};

}  // namespace palette4d
