// The losses of a whole 4D skew polytope (eq. 8 without its weights), frame by frame, with the
// gradient with respect to the 4D vertices: chain rule through the slicing of eq. 6.
#pragma once

#include <memory>
#include <vector>

#include "fit/palette_loss.hpp"

namespace palette4d {

/// (r, g, b, t) with t a frame number.
using Vec4 = std::array<double, 4>;

/// The topology of one block: tracks as in polytope.hpp, and its faces.
struct BlockTopology {
    double first, last;
    std::vector<std::vector<int>> tracks;
    std::vector<Face> faces;
};

/// One analysed frame: its time and its colours.
struct FrameColours {
    double frame;
    std::shared_ptr<const ColourTree> colours;
};

/// Losses of the frames `which` (indices of `frames`, each inside a block). `gradient`, when not
/// null, receives sum over `which` of the derivative of lambda (R + E) + C + convexity D + S with
/// respect to the vertices (r, g, b, t). Frames are shared among `threads` threads; the sums are
/// taken in order, so the result does not depend on their number. Throws std::invalid_argument for
/// a frame that no block or track covers.
std::vector<FrameLoss> polytope_loss(const std::vector<Vec4>& vertices,
                                     const std::vector<BlockTopology>& blocks,
                                     const std::vector<FrameColours>& frames,
                                     const std::vector<int>& which, const LossWeights& weights,
                                     int threads, std::vector<Vec4>* gradient);

}  // namespace palette4d
