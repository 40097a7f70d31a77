// The user's edits (section 6.3): new colours of palette vertices, colour stops on edges, and the
// solution of his picks.
#pragma once

#include <optional>
#include <string>
#include <vector>

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

/// A colour's neighbourhood that moves by itself, on top of the palette. The displacement of a
/// colour c is w by, with v = c - centre and
/// w = max(0, 1 - (|v|^2 - (along . v)^2) / radius^2)^3.
struct Bump {
    Vec3 centre;
    double radius;  ///< where the bump ends, in the palette's code values
    Vec3 by;        ///< the displacement at its centre
    /// Where above 0 this is a hold: the displacement by the palette and by all other bumps is
    /// multiplied by 1 - keep (1 - (1 - w)^3). `by` does not count.
    double keep = 0;
    /// Shorter than 1; 0 for a sphere. The bump is longer this way, by 1 / sqrt(1 - |along|^2).
    Vec3 along{};
};

/// Displacements that meet the user's picks, added to the edited colours.
struct Solution {
    /// At `frame`, strictly inside edge `edge`, the palette colour moves by `by`.
    struct Key {
        int edge;
        double frame;
        Vec3 by;
    };
    struct BumpKey {
        double frame;
        Vec3 centre, by;
    };
    /// A bump over time: linear between keys, constant before the first and after the last one.
    struct MovingBump {
        double radius;
        std::vector<BumpKey> keys;  ///< at least one, in increasing frame order
        /// Distances to shades of the centre, lighter and darker, count this; 0 < shade <= 1.
        double shade = 1;
    };

    struct HoldKey {
        double frame;
        Vec3 centre;
        double radius, keep;
    };
    /// A hold over time, as a bump.
    struct MovingHold {
        std::vector<HoldKey> keys;
        double shade = 1;
    };

    /// One element per polytope vertex, or none. Linear in time between vertices and keys.
    std::vector<Vec3> vertex_by;
    /// At most one key per edge and frame; any order.
    std::vector<Key> keys;
    std::vector<MovingBump> bumps;
    std::vector<MovingHold> holds;
};

struct Edits {
    /// One element per polytope vertex; empty where the vertex keeps its colour.
    std::vector<std::optional<Vec3>> vertex_rgb;
    /// At most one stop per edge and frame; any order.
    std::vector<Stop> stops;
    /// One element per polytope vertex, or none: the ramp on the edges that start there.
    std::vector<std::optional<Ramp>> vertex_ramp{};
    Ramp default_ramp = Ramp::kLinear;
    Solution solution{};
};

}  // namespace palette4d
