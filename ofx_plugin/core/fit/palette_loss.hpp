// The losses of one frame (section 3): reconstruction (eq. 2) and compactness (eq. 3), with their
// gradients with respect to the palette's colours.
#pragma once

#include <vector>

#include "fit/colour_tree.hpp"
#include "model/polytope.hpp"
#include "simd/instruction_set.hpp"

namespace palette4d {

struct LossWeights {
    double lambda = 50;     ///< of eq. 4
    double k = 50;          ///< pixels that a vertex is compared with in eq. 3
    double convexity = 0;   ///< weight of the concavity D below; 0 in every reported figure
    double separation = 0;  ///< distance to keep between palette colours (S below); 0 likewise
    double reach = 0;       ///< where a pixel outside costs twice (E below); 0: never, likewise
    double slight = 1e-6;   ///< a pixel up to this far outside does not count as outside
};

/// One frame's losses. R and C are as in the paper. D is the concavity of the triangle mesh: the
/// sum over its edges of six times the volume by which the two faces fold inwards. S is the sum
/// over pairs of colours nearer than s, at distance d, of (s - d)^2 / 2s. s is the separation,
/// limited to a quarter of the extent of the frame's colours. E is the mean over the pixels of d q
/// / (1 + q / 8) with q = (d / reach)^3, where d is their distance outside. E adds weight to rare
/// colours far outside, which hardly count in R, the mean of d.
struct FrameLoss {
    double R = 0;
    double C = 0;
    double D = 0;
    double S = 0;
    double E = 0;
    double outside = 0;       ///< share of pixels outside, by more than `slight`
    double max_distance = 0;  ///< largest distance of a pixel outside
};

/// The body is the convex hull of the n palette colours, as in eq. 2; fewer than four colours and
/// flat ones work too. `faces` (may be empty) are for D only. `gradient`, unless null, receives the
/// n derivatives of lambda (R + E) + C + convexity D + S. It treats v_N of eq. 3 as constant, which
/// holds almost everywhere. All instruction sets give the same bits.
FrameLoss palette_loss(const ColourTree& colours, const std::vector<Vec3>& palette,
                       const std::vector<Face>& faces, const LossWeights& weights,
                       std::vector<Vec3>* gradient,
                       InstructionSet instructions = InstructionSet::kBest);

}  // namespace palette4d
