// Slicing (section 4.1.2, eqs. 5 and 6): the polyhedral palette of one frame.
#pragma once

#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// A sliced vertex's position in 4D (a row of W_t in eq. 6): rgb = (1 - weight) *
/// vertices[from].rgb + weight * vertices[to].rgb. On a vertex, from == to, weight == 0, and edge
/// is -1.
struct SlicePoint {
    int edge;
    int from;
    int to;
    double weight;  ///< in [0, 1)
};

/// A closed, consistently oriented triangle mesh (no faces for palettes of one or two colours).
struct Slice {
    double frame;  ///< after clamping to the clip
    int section;
    std::vector<Vec3> rgb;          ///< n original palette colours, one per track
    std::vector<SlicePoint> where;  ///< n
    std::vector<Face> faces;
};

/// u, moved towards v by `weight`.
Vec3 mixed(const Vec3& u, const Vec3& v, double weight);
/// Position between two frames, in [0, 1): rounding must not reach 1.
double weight_between(double from, double to, double frame);

/// Eq. 5 at any real frame; outside the clip, its first or last frame. Throws std::invalid_argument
/// for NaN.
Slice slice_at(const Polytope& polytope, double frame);

}  // namespace palette4d
