// Follows a handle through time, and builds displacements that measure a palette.
#pragma once

#include <vector>

#include "model/edits.hpp"
#include "model/slice.hpp"

namespace palette4d {

/// All vertices that a handle reaches along the polytope's edges, forwards and backwards in time. A
/// split leads to all its branches, and a merge back to all merged colours.
class Lineage {
public:
    /// `handle` is an index in handles_of(). Throws std::invalid_argument when it does not exist.
    Lineage(const Polytope& polytope, const Edits& edits, int handle);
    bool holds(const SlicePoint& point) const;

private:
    void follow(const Polytope& polytope, int vertex, bool forwards);

    std::vector<bool> vertices_, edges_;
};

/// Edited colours that make a Recolourer add, to each channel, the summed weights of a handle's
/// lineage. That is 0 where the colour has no part in the pixel, 1 where it is all of it.
std::vector<Vec3> weight_reader(const Slice& slice, const Lineage& lineage);
/// Edited colours that make a Recolourer add q(p): the colour itself inside the palette, the
/// closest surface colour outside.
std::vector<Vec3> surface_reader(const Slice& slice);

}  // namespace palette4d
