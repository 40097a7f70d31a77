// The losses of a whole 4D skew polytope: frame by frame (eq. 8 without its weights), and of its
// edges in time (eq. 11). The gradient of a frame's loss for the 4D vertices follows from the chain
// rule through the slicing of eq. 6.
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

/// An edge in time: a vertex, a later one, and its weight (1 in the paper).
struct TimeEdge {
    int from, to;
    double weight;
};

/// K of eq. 11, the mean over the edges of their change of colour by their length in time; `length`
/// is the clip's, in frames. 0 without edges. `gradient`, unless null, receives its derivative by
/// (r, g, b, t). Edges without extent in time count as zero; a valid polytope has none. Throws
/// std::invalid_argument for an edge between vertices that do not exist.
double smoothness(const std::vector<Vec4>& vertices, const std::vector<TimeEdge>& edges,
                  double length, std::vector<Vec4>* gradient);

}  // namespace palette4d
