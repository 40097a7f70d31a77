// Eq. 2 and what goes with it: how far a frame's colours lie outside a palette's hull.
#pragma once

#include <vector>

#include "fit/loss_kernels.hpp"
#include "fit/palette_hull.hpp"
#include "fit/palette_loss.hpp"

namespace palette4d {

/// Memory that one reconstruction after the other can use, so that none has to be found anew.
struct ReconstructionScratch {
    /// How the colours above a facet pull at it, in all and on its corners 1 and 2: together with
    /// the normal, their gradient.
    struct Load {
        double all = 0;
        double corner[2] = {0, 0};
    };

    std::vector<int> facets;        // a list a level of the tree
    std::vector<unsigned> reached;  // likewise
    std::vector<Load> loads;        // one a facet
};

/// Sets R, E, outside and max_distance of `loss`, with E's `reach` as in LossWeights; `gradient`,
/// when not null, becomes the derivatives of R + E. `hull` is that of `palette`.
void measure_reconstruction(const ColourTree& colours, const std::vector<Vec3>& palette,
                            const PaletteHull& hull, double reach, const LossKernels& kernels,
                            ReconstructionScratch& scratch, FrameLoss& loss,
                            std::vector<Vec3>* gradient);

}  // namespace palette4d
