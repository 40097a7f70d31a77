// Parts of pictures, as hosts with tiles give them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "harness.hpp"

namespace test {

/// The pixels of a region that a picture has.
inline OfxRectI within(const std::array<double, 4>& region, const OfxRectI& bounds) {
    return {std::max(static_cast<int>(std::floor(region[0])), bounds.x1),
            std::max(static_cast<int>(std::floor(region[1])), bounds.y1),
            std::min(static_cast<int>(std::ceil(region[2])), bounds.x2),
            std::min(static_cast<int>(std::ceil(region[3])), bounds.y2)};
}

/// A part of a picture; `padding` as in Layout.
inline strict::Picture part_of(const strict::Picture& whole, const OfxRectI& area,
                               int padding = 0) {
    strict::Layout layout = whole.layout();
    layout.definition = layout.bounds;
    layout.bounds = area;
    layout.padding = padding;
    strict::Picture part(layout);
    const auto row = static_cast<std::size_t>(layout.width() * layout.pixel_bytes());
    for (int y = area.y1; y < area.y2; ++y) {
        std::memcpy(part.at(area.x1, y), whole.at(area.x1, y), row);
    }
    return part;
}

/// Calls draw(window, region of interest) for each tile of bounds, none a multiple of a cell.
template <class Draw>
void each_tile(const OfxRectI& bounds, Draw draw) {
    for (int y = bounds.y1; y < bounds.y2; y += 13) {
        for (int x = bounds.x1; x < bounds.x2; x += 37) {
            const OfxRectI window = {x, y, std::min(x + 37, bounds.x2),
                                     std::min(y + 13, bounds.y2)};
            draw(window, std::array<double, 4>{double(window.x1), double(window.y1),
                                               double(window.x2), double(window.y2)});
        }
    }
}

}  // namespace test
