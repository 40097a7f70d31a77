// Chooses colours that represent a frame with more colours than can be kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Cells of a fine grid in colour space and how many pixels lie in each.
struct ColourCells {
    /// The cell's three numbers, interleaved bit by bit (a Morton code): cells with equal upper
    /// bits share a larger cell. Strictly increasing.
    std::vector<std::uint64_t> keys;
    std::vector<double> counts;  ///< pixels of each cell, positive
};

/// Groups of neighbouring cells; one cell represents each group.
struct ColourSample {
    std::vector<std::size_t> chosen;  ///< indices of cells, rising
    std::vector<double> counts;       ///< pixels of each group
};

/// The blocks of 8x8x8 cells that `cells` touch: the index of each block's first cell, then the
/// number of cells.
std::vector<std::size_t> colour_blocks(const ColourCells& cells);

/// At most `most` groups; all cells when there are no more.
///
/// The losses (section 3) depend on the outermost colours, so groups there are small. A group's
/// width grows in proportion to its depth below the surface of the colours, plus a twentieth of
/// their extent. One cell represents each group, drawn with a probability in proportion to its
/// pixels. A mean would lie inside the palette too often and make the reconstruction loss (eq. 2)
/// too small. The draws are a low-discrepancy sequence, so the result depends on the arguments
/// only. `places` are colours of the `colour_blocks`, such as their centres.
ColourSample sample_colours(const ColourCells& cells, const std::vector<Vec3>& places,
                            std::size_t most);

}  // namespace palette4d
