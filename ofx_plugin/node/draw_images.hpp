// Draws a frame's output into the host's images, of any depth and with the host's mask.
#pragma once

#include "output/drawing.hpp"
#include "pixels.hpp"

namespace palette4d::node {

/// What one render draws. Read-only, so that threads share it.
struct NodeDrawing : Drawing {
    /// Limits the result by its alpha or only channel; null for no limit.
    const Image* mask = nullptr;
};

/// Whether its rows can be read as floats where they are: hosts may put rows at any byte.
bool is_aligned(const Image& image);

/// Draws the part of `area` that `in` covers; the rest becomes transparent black. Both images have
/// the same format, with three or four channels.
void draw(const Image& in, const Image& out, const OfxRectI& area, const NodeDrawing& drawing);

}  // namespace palette4d::node
