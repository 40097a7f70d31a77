// Colour statistics of a frame: its pixels gathered in bins, each with its mean and count.
#pragma once

#include <cstddef>
#include <vector>

#include "palette4d/polytope.hpp"

namespace palette4d {

struct ColourBins {
    std::vector<Vec3> rgb;       ///< mean colour of each bin, in order of first appearance
    std::vector<double> counts;  ///< pixels of each bin
    double step = 0;             ///< width of a bin
    std::size_t ignored = 0;     ///< pixels left out: not finite, or fully transparent
};

/// Gathers `pixels` interleaved float32 pixels of `channels` (3 or 4; alpha 0 is left out) in cubes
/// of width `step`, centred on its multiples; doubles the width until at most `most` bins are left,
/// so that memory does not grow with resolution. `row_bytes` apart, `width` by `height`.
ColourBins bin_colours(const float* data, int width, int height, int channels,
                       std::ptrdiff_t row_bytes, double step, std::size_t most);

/// The same for colours with counts, such as other bins. Throws std::invalid_argument unless all
/// colours are finite and all counts positive and finite.
ColourBins coarsen_colours(const std::vector<Vec3>& rgb, const std::vector<double>& counts,
                           double step, std::size_t most);

}  // namespace palette4d
