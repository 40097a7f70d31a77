// Which of a slice's colours a handle was or became, and displacements that read a palette out.
#pragma once

#include <vector>

#include "model/edits.hpp"
#include "model/slice.hpp"

namespace palette4d {

/// What a handle can be followed to along the polytope's edges, forwards and backwards in time: a
/// split leads to all its branches, a merge back to all that were merged.
class Lineage {
public:
    /// `handle` counts as handles_of() does. Throws std::invalid_argument where there is none.
    Lineage(const Polytope& polytope, const Edits& edits, int handle);
    bool holds(const SlicePoint& point) const;

private:
    void follow(const Polytope& polytope, int vertex, bool forwards);

    std::vector<bool> vertices_, edges_;
};

/// Edited colours with which a Recolourer adds, to each channel, the sum of the weights of a
/// handle's lineage: 0 where the colour has no part in the pixel, 1 where it is all of it.
std::vector<Vec3> weight_reader(const Slice& slice, const Lineage& lineage);
/// Edited colours with which a Recolourer adds q(p), the colour itself inside of the palette and
/// the closest colour of its surface outside.
std::vector<Vec3> surface_reader(const Slice& slice);

}  // namespace palette4d
