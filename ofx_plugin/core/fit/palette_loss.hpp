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
    double k = 50;          ///< pixels a vertex is compared with in eq. 3
    double convexity = 0;   ///< weight of the concavity D below; 0 in every figure reported
    double separation = 0;  ///< how far apart colours should stay (S below); 0 likewise
    double reach = 0;       ///< where a pixel outside counts twice (E below); 0: nowhere, likewise
};

/// What one frame contributes. R, C as in the paper; D is the concavity of the triangle mesh: the
/// sum over its edges of six times the volume by which the two faces fold inwards (0 when convex).
/// S is the sum over pairs of colours nearer than s, at distance d, of (s - d)^2 / 2s: a distance,
/// as R and C are; s is the separation, at most a quarter of the extent of the frame's own colours.
/// E is the mean over the pixels of d q / (1 + q / 8), q = (d / reach)^3, d their distance outside:
/// what is rare but far outside weighs hardly anything in R, the mean of d.
struct FrameLoss {
    double R = 0;
    double C = 0;
    double D = 0;
    double S = 0;
    double E = 0;
    double outside = 0;       ///< share of pixels outside, by more than 1e-6
    double max_distance = 0;  ///< of a pixel outside
};

/// The body is the convex hull of the n palette colours, as in eq. 2; fewer than four colours, or
/// flat ones, are handled. `faces` (may be empty) serve D only. `gradient`, when not null, receives
/// the n derivatives of lambda (R + E) + C + convexity D + S; v_N of eq. 3 counts as constant (it
/// is, almost everywhere, on a finite set of pixels). All instruction sets give the same bits.
FrameLoss palette_loss(const ColourTree& colours, const std::vector<Vec3>& palette,
                       const std::vector<Face>& faces, const LossWeights& weights,
                       std::vector<Vec3>* gradient,
                       InstructionSet instructions = InstructionSet::kBest);

}  // namespace palette4d
