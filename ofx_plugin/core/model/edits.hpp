// The user's edits (section 6.3): new colours of palette vertices, colour stops on edges, and
// picks.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/picks.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// How an edit goes from one handle to the next handle in time on an edge (section 7.2).
enum class Ramp {
    kLinear,
    kSmooth,  ///< a monotone cubic: no overshoot, and no kink at a handle
    kHold,    ///< the earlier handle's displacement until the next handle
};

/// A colour stop: at `frame`, strictly inside edge `edge`, the edited palette colour is `rgb`.
struct Stop {
    std::string id;
    int edge;
    double frame;
    Vec3 rgb;
    std::optional<Ramp> ramp{};  ///< to the next handle; Edits::default_ramp where empty
};

struct Edits {
    /// One element per polytope vertex; empty where the vertex keeps its colour.
    std::vector<std::optional<Vec3>> vertex_rgb;
    /// At most one stop per edge and frame; any order.
    std::vector<Stop> stops;
    /// The stops' indices by edge and frame, or none: then each palette sorts them.
    std::vector<int> stop_order{};
    /// One element per polytope vertex, or none: the ramp on the edges that start there.
    std::vector<std::optional<Ramp>> vertex_ramp{};
    Ramp default_ramp = Ramp::kLinear;
    std::vector<Pick> picks{};
    double width = 1, height = 1;  ///< of the clip, in pixels: where windows of picks are
    /// From the palette's code values to those of a display; null where they are the same.
    std::shared_ptr<const DisplayCurve> display{};
};

}  // namespace palette4d
