// The losses of a whole 4D skew polytope (eq. 8 without its weights), frame by frame. The gradient
// for the 4D vertices follows from the chain rule through the slicing of eq. 6.
#pragma once

#include <memory>
#include <vector>

#include "fit/palette_loss.hpp"

namespace palette4d {

/// (r, g, b, t), where t is a frame number.
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

/// Losses of the frames `which` (indices into `frames`, each inside a block). `gradient`, unless
/// null, receives the sum over these frames of the derivative of lambda (R + E) + C + convexity D +
/// S by (r, g, b, t). `threads` threads share the frames; sums are made in order, so the result
/// does not depend on their number. Throws std::invalid_argument for a frame that no block or track
/// covers.
std::vector<FrameLoss> polytope_loss(const std::vector<Vec4>& vertices,
                                     const std::vector<BlockTopology>& blocks,
                                     const std::vector<FrameColours>& frames,
                                     const std::vector<int>& which, const LossWeights& weights,
                                     int threads, std::vector<Vec4>* gradient);

}  // namespace palette4d
