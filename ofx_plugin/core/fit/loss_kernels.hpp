// The reconstruction loss' inner loops: boxes and leaves of a ColourTree against the facets of a
// convex palette. Plain data and pointers only, as block_kernels.hpp.
#pragma once

namespace palette4d {

/// From one corner to another, with what a closest point needs.
struct LossEdge {
    double from[3], along[3], length2;
};

/// A supporting triangle with what a closest point needs: its plane, the barycentric coordinates of
/// its corners 1 and 2 (corner 0 takes the rest) as linear functions of the colour, and its edges,
/// from each corner to the next.
struct LossFacet {
    int at[3];
    double normal[3];  ///< unit, outwards
    bool high[3];      ///< whether of a box the high side is farther outwards, axis by axis
    double offset;
    double slope[2][3];
    double start[2];
    LossEdge edges[3];
};

/// What became of a leaf's colours.
struct LossLeaf {
    static constexpr int kSize = 16;
    alignas(64) double distance[kSize];      ///< from the palette, 0 for a colour inside
    alignas(64) double facet[kSize];         ///< the first that it falls straight onto, or -1
    alignas(64) double share[2][kSize];      ///< barycentric coordinates there, corners 1 and 2
    alignas(64) double edge[kSize];          ///< where it falls onto none: 3 facet + edge, closest
    alignas(64) double along[kSize];         ///< where on that one, 0 to 1
    alignas(64) double weighted[kSize];      ///< its part in R, times all pixels
    alignas(64) double far_weighted[kSize];  ///< its part in E, times all pixels
    alignas(64) double counted[kSize];       ///< its pixels, where they count as outside
    alignas(64) double pull[kSize];          ///< how R + E grow with the distance, times all pixels
};

/// What a distance d counts for: d in R, d q / (1 + q / most) with q = far d^3 in E.
struct LossReach {
    double far, most;
    double slight;  ///< a distance that still counts as inside
};

struct LossKernels {
    static constexpr int kBoxes = 8;

    /// Which of kBoxes boxes, given by their low sides and their high ones, axis by axis, reach
    /// above the `count` facets that `which` names by more than `flat`: a bit a box.
    void (*reach)(const LossFacet* facets, const int* which, int count,
                  const double (*sides)[3][kBoxes], double flat, unsigned* reached);
    /// `distance` to `along` for the `size` colours (rounded up to whole registers) at the three
    /// `channels`, against the `count` facets that `which` names. A colour counts as above a facet
    /// from `flat` on. The closest point of a convex body lies on a facet that the colour sees;
    /// where the colour falls straight onto such a facet, that is it. Returns whether some colour
    /// is outside, of those rounded up to included.
    bool (*fall)(const LossFacet* facets, const int* which, int count,
                 const double* const* channels, int size, double flat, LossLeaf& leaf);
    /// `weighted` to `pull` from `distance`, for `size` colours of so many pixels each.
    void (*pull)(const double* counts, int size, const LossReach& reach, LossLeaf& leaf);

    /// One for each set of instructions that this build has.
    static const LossKernels& baseline();
    static const LossKernels& avx2();
    static const LossKernels& avx512();
};

}  // namespace palette4d
