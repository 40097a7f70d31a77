// The pixels of OFX images: layout, reading, writing and copying. Rows count upwards from
// bounds.y1; row_bytes is signed and may include padding.
#pragma once

#include <cstddef>
#include <optional>

#include "host.hpp"

namespace palette4d::node {

enum class Depth { kByte, kShort, kHalf, kFloat };

/// An image as described by its property set.
struct Image {
    char* data = nullptr;  ///< the pixel at (bounds.x1, bounds.y1)
    OfxRectI bounds{};
    std::ptrdiff_t row_bytes = 0;
    Depth depth = Depth::kFloat;
    int channels = 0;
    int pixel_bytes = 0;
    bool premultiplied = false;  ///< true for four channels only
    bool opaque = false;         ///< likewise: the picture covers all, whatever its alpha holds
    /// The whole picture, which bounds may be a part of; equals bounds where the host does not
    /// report it.
    OfxRectI definition{};

    char* at(int x, int y) const {
        return data + (static_cast<std::ptrdiff_t>(y) - bounds.y1) * row_bytes +
               (static_cast<std::ptrdiff_t>(x) - bounds.x1) * pixel_bytes;
    }
};

/// Empty when the host gives no valid pixel address or layout. Depth, components and
/// premultiplication come from the clip where the image lacks them.
std::optional<Image> read_image(const Properties& image, const Properties& clip);

OfxRectI intersect(const OfxRectI& a, const OfxRectI& b);
bool is_empty(const OfxRectI& rect);
/// Whether both have the same pixels in the same layout, so that one can be copied to the other.
bool same_format(const Image& a, const Image& b);

/// The pixels of an area within the bounds, row by row without gaps. Integers are value / 255 or
/// value / 65535, and are rounded and clamped when written; halves are rounded.
void read_floats(const Image& image, const OfxRectI& area, float* to);
void write_floats(const float* from, const Image& image, const OfxRectI& area);

/// Writes transparent black to the part of `area` outside `covered`.
void clear_around(const Image& out, const OfxRectI& area, const OfxRectI& covered);
/// Writes transparent black.
void clear(const Image& out, const OfxRectI& area);
/// Copies the part of `area` that `in` covers; the rest becomes transparent black.
void copy(const Image& in, const Image& out, const OfxRectI& area);

}  // namespace palette4d::node
