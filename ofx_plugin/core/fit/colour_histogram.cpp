#include "fit/colour_histogram.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace palette4d {

std::vector<double> colour_histogram(const std::vector<Vec3>& rgb,
                                     const std::vector<double>& counts, const HistogramGrid& grid) {
    if (grid.cells < 2 || rgb.size() != counts.size())
        throw std::invalid_argument("a histogram needs two cells, and a count for each colour");
    const std::size_t side = static_cast<std::size_t>(grid.cells);
    // One grid for each corner of the eight cells: rounding does not mix the corners.
    std::array<std::vector<double>, 8> corners;
    for (std::vector<double>& corner : corners) corner.resize(side * side * side);
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        std::size_t cell = 0;
        double share[3][2];
        for (int c = 0; c < 3; ++c) {
            const double x = std::max(rgb[i][c], 0.0);
            const double eased = x <= 1 ? std::sqrt(x) : 1 + grid.above_one * std::log(x);
            const double place = std::clamp(grid.to_one * eased, 0.0, grid.cells - 1.0);
            const int lower = std::min(static_cast<int>(place), grid.cells - 2);
            share[c][1] = place - lower;
            share[c][0] = 1 - share[c][1];
            cell = cell * side + static_cast<std::size_t>(lower);
        }
        for (std::size_t k = 0; k < 8; ++k)
            corners[k][cell] +=
                counts[i] * share[0][k >> 2] * share[1][k >> 1 & 1] * share[2][k & 1];
    }
    std::vector<double> out(corners[0].size());
    for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t offset = ((k >> 2) * side + (k >> 1 & 1)) * side + (k & 1);
        for (std::size_t cell = 0; cell + offset < out.size(); ++cell)
            out[cell + offset] += corners[k][cell];
    }
    return out;
}

}  // namespace palette4d
