// The reconstruction loss' inner loop: the colours of a leaf of a ColourTree against the facets of
// a convex palette. Plain data and pointers only, as block_kernels.hpp.
#pragma once

namespace palette4d {

/// A supporting triangle with what a closest point needs: its plane, and the barycentric
/// coordinates of its corners 1 and 2 (corner 0 takes the rest) as linear functions of the colour.
struct LossFacet {
    int at[3];
    double normal[3];  ///< unit, outwards
    bool high[3];      ///< whether of a box the high side is farther outwards, axis by axis
    double offset;
    double slope[2][3];
    double start[2];
};

/// What became of a leaf's colours.
struct LossLeaf {
    static constexpr int kSize = 16;
    alignas(64) double highest[kSize];   ///< above any of the facets, 0 for a colour inside
    alignas(64) double facet[kSize];     ///< the first of them that it falls straight onto, or -1
    alignas(64) double height[kSize];    ///< above that one
    alignas(64) double share[2][kSize];  ///< barycentric coordinates there, corners 1 and 2
};

struct LossKernels {
    /// The kSize colours at the three `channels`, against the `count` facets that `which` names. A
    /// colour counts as above a facet from `flat` on. Each colour's result depends on it alone.
    void (*fall)(const LossFacet* facets, const int* which, int count,
                 const double* const* channels, double flat, LossLeaf& leaf);
};

}  // namespace palette4d
