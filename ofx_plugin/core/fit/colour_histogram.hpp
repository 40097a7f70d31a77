// A frame's colours on a coarse grid, for comparing frames.
#pragma once

#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// The grid is even in the eased channels: the square root up to 1, 1 + above_one * log(x) above,
/// where 1 is at `to_one`. Colours outside count to the nearest of its `cells`^3 cells.
struct HistogramGrid {
    int cells;
    double to_one, above_one;
};

/// The pixels of each cell, blue first. Each pixel is shared by the eight cells around it. Throws
/// std::invalid_argument unless there are at least two cells and as many counts as colours.
std::vector<double> colour_histogram(const std::vector<Vec3>& rgb,
                                     const std::vector<double>& counts, const HistogramGrid& grid);

}  // namespace palette4d
