// One frame's drawing as flat single precision tables, which the kernel reads on a GPU: the
// palette, its displacements, picks and options. kernel/layout.inc has the layout.
#pragma once

#include <string>
#include <vector>

#include "output/drawing.hpp"

namespace palette4d::gpu {

struct FrameTable {
    std::vector<float> table;  ///< read by all pixels alike: constant memory
    std::vector<float> grids;  ///< mattes and display curve; at least one value
};

/// The most floats of a table: 64 KB, the constant memory that every GPU has.
inline constexpr std::size_t kMostTable = 16384;

/// What the kernel cannot draw, in the words of *Status*; empty where it can. `clean_up` of the
/// options counts, not whether Drawing::clean_up is there.
std::string lacks(const Drawing& drawing);
/// Only where nothing is lacking. `premultiplied`: colours are divided by alpha.
FrameTable frame_table(const Drawing& drawing, bool premultiplied);

}  // namespace palette4d::gpu
