// Eq. 2 and related measures: how far a frame's colours lie outside a palette's hull.
#pragma once

#include <vector>

#include "fit/loss_kernels.hpp"
#include "fit/palette_hull.hpp"
#include "fit/palette_loss.hpp"

namespace palette4d {

/// Memory that is reused from one reconstruction to the next.
struct ReconstructionScratch {
    std::vector<int> facets;        // one list per level of the tree
    std::vector<unsigned> reached;  // one list per level too
    std::vector<LossLoad> loads;    // one per facet
};

/// Sets R, E, outside and max_distance of `loss`, with `reach` and `slight` of the weights.
/// `gradient`, unless null, receives the derivatives of R + E. `hull` must be built from `palette`.
void measure_reconstruction(const ColourTree& colours, const std::vector<Vec3>& palette,
                            const PaletteHull& hull, const LossWeights& weights,
                            const LossKernels& kernels, ReconstructionScratch& scratch,
                            FrameLoss& loss, std::vector<Vec3>* gradient);

}  // namespace palette4d
