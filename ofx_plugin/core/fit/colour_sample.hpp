// Which colours stand for a frame that has more of them than can be kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Cells of a fine grid in colour space and how many pixels lie in each.
struct ColourCells {
    /// The cell's three numbers, bit by bit in turns (a Morton code): cells with equal upper bits
    /// share a larger cell. Rising, no two equal.
    std::vector<std::uint64_t> keys;
    std::vector<double> counts;  ///< pixels of each cell, positive
};

/// Groups of neighbouring cells, each with one of them that stands for all.
struct ColourSample {
    std::vector<std::size_t> chosen;  ///< indices of cells, rising
    std::vector<double> counts;       ///< pixels of each group
};

/// The blocks of 8x8x8 cells that `cells` touch: the index of each one's first cell, and the number
/// of cells at the end.
std::vector<std::size_t> colour_blocks(const ColourCells& cells);

/// At most `most` groups, all cells when there are no more.
///
/// What a palette is measured by (section 3) happens where the colours end, so groups grow with
/// the distance from there: their width is in proportion to a twentieth of the colours' extent plus
/// the depth below the surface of (a polytope around) all colours. Each group is represented by one
/// of its cells, drawn with a probability in proportion to its pixels: a mean lies inside of a
/// palette more often than its pixels do, and would make the reconstruction loss (eq. 2) too small;
/// one that is drawn does not. The draws are a low-discrepancy sequence, so the result depends on
/// nothing but the arguments. `places` are colours of the `colour_blocks`, such as their centres.
ColourSample sample_colours(const ColourCells& cells, const std::vector<Vec3>& places,
                            std::size_t most);

}  // namespace palette4d
