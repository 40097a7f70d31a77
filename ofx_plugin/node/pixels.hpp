// The pixels of OFX images: where they lie, and how they are read, written and copied.
// Rows count upwards from bounds.y1; row_bytes is signed and may hold padding.
#pragma once

#include <cstddef>
#include <optional>

#include "host.hpp"

namespace palette4d::node {

enum class Depth { kByte, kShort, kHalf, kFloat };

/// An image as its property set describes it.
struct Image {
    char* data = nullptr;  ///< the pixel at (bounds.x1, bounds.y1)
    OfxRectI bounds{};
    std::ptrdiff_t row_bytes = 0;
    Depth depth = Depth::kFloat;
    int channels = 0;
    int pixel_bytes = 0;
    bool premultiplied = false;  ///< only ever for four channels
    bool opaque = false;         ///< likewise: whatever its alpha holds, the picture covers all
    /// The whole picture, of which bounds may be a part; bounds where the host does not tell.
    OfxRectI definition{};

    char* at(int x, int y) const {
        return data + (static_cast<std::ptrdiff_t>(y) - bounds.y1) * row_bytes +
               (static_cast<std::ptrdiff_t>(x) - bounds.x1) * pixel_bytes;
    }
};

/// Empty when the host does not say where the pixels lie, or lays them where they cannot be. Depth,
/// components and premultiplication that the image does not tell are taken from its clip.
std::optional<Image> read_image(const Properties& image, const Properties& clip);

OfxRectI intersect(const OfxRectI& a, const OfxRectI& b);
bool is_empty(const OfxRectI& rect);
/// The two hold the same pixels in the same layout, so that one can be copied to the other.
bool same_format(const Image& a, const Image& b);

/// The pixels of an area within the bounds, row after row without gaps. Integers are value / 255 or
/// value / 65535, and come back rounded and clamped; halves come back rounded.
void read_floats(const Image& image, const OfxRectI& area, float* to);
void write_floats(const float* from, const Image& image, const OfxRectI& area);

/// Transparent black, over what `covered` leaves of `area`.
void clear_around(const Image& out, const OfxRectI& area, const OfxRectI& covered);
/// Transparent black.
void clear(const Image& out, const OfxRectI& area);
/// Copies what `in` covers of `area`; the rest becomes transparent black.
void copy(const Image& in, const Image& out, const OfxRectI& area);

}  // namespace palette4d::node
