// One frame's drawing as flat single precision tables, which the kernel reads on a GPU: the
// palette, its displacements, picks and options. kernel/layout.inc has the layout.
#pragma once

#include <string>
#include <vector>

#include "output/drawing.hpp"

namespace palette4d::gpu {

struct FrameTable {
    std::vector<float> table;   ///< read by all pixels alike: constant memory
    std::vector<float> grids;   ///< mattes, curves; at least one value
    int columns = 0, rows = 0;  ///< of the cells of the clean-up; 0: nothing is cleaned up

    /// What is kept from pass to pass, in floats.
    std::size_t scratch() const;
};

/// The most floats of a table: 64 KB, the constant memory that every GPU has.
inline constexpr std::size_t kMostTable = 16384;

/// What the kernel cannot draw, in the words of *Status*; empty where it can.
std::string lacks(const Drawing& drawing);
/// Only where nothing is lacking. `premultiplied`: colours are divided by alpha. `place` is where
/// picks are cleaned up, in place of Drawing::clean_up; its `drawn` is the window.
FrameTable frame_table(const Drawing& drawing, bool premultiplied, const CleanUp::Place* place);

}  // namespace palette4d::gpu
