// The reconstruction loss' inner loops: boxes and leaves of a ColourTree against the facets of a
// convex palette. Plain data and pointers only, as in mvc_kernels.hpp.
#pragma once

namespace palette4d {

/// An edge between two corners, with precomputed values for the closest point.
struct LossEdge {
    double from[3], along[3];
    double inverse_length2;  ///< 0 for an edge without length
};

/// A supporting triangle, with precomputed values for the closest point: its plane, the barycentric
/// coordinates of corners 1 and 2, and its edges. The coordinates are linear functions of the
/// colour; corner 0 has the remaining weight.
struct LossFacet {
    int at[3];
    double normal[3];  ///< unit, outwards
    bool high[3];      ///< per axis: whether a box's high side is farther outwards
    double offset;
    double slope[2][3];
    double start[2];
    LossEdge edges[3];
};

/// Results for the colours of a leaf.
struct LossLeaf {
    static constexpr int kSize = 16;
    alignas(64) double distance[kSize];  ///< from the palette, 0 for a colour inside
    alignas(64) double facet[kSize];  ///< the first facet that holds its perpendicular foot, or -1
    alignas(64) double share[2][kSize];  ///< barycentric coordinates of the foot, corners 1 and 2
    alignas(64) double edge[kSize];      ///< without such a facet: closest edge, as 3 facet + edge
    alignas(64) double along[kSize];     ///< position on that edge, 0 to 1
    alignas(64) double weighted[kSize];  ///< its part in R, times all pixels
    alignas(64) double far_weighted[kSize];  ///< its part in E, times all pixels
    alignas(64) double counted[kSize];       ///< its pixels, if they count as outside
    alignas(64) double pull[kSize];  ///< derivative of R + E by the distance, times all pixels
};

/// The cost of a distance d: d in R, d q / (1 + q / most) with q = far d^3 in E.
struct LossReach {
    double far, most;
    double slight;  ///< a distance up to this counts as inside
};

struct LossKernels {
    static constexpr int kBoxes = 8;

    /// Tests kBoxes boxes, given by their low and high sides, axis by axis. A box's bit is set when
    /// it reaches more than `flat` above one of the `count` facets in `which`.
    void (*reach)(const LossFacet* facets, const int* which, int count,
                  const double (*sides)[3][kBoxes], double flat, unsigned* reached);
    /// Sets `distance` to `along` for `size` colours (rounded up to whole registers) against the
    /// `count` facets in `which`. A colour is above a facet from `flat` on. The closest point of a
    /// convex body lies on a facet that the colour sees; a perpendicular foot on such a facet is
    /// the closest point. Returns whether some colour is outside, padding included.
    bool (*fall)(const LossFacet* facets, const int* which, int count,
                 const double* const* channels, int size, double flat, LossLeaf& leaf);
    /// Squared distances of a colour from kBoxes boxes; 0 inside.
    void (*from_boxes)(const double (*sides)[3][kBoxes], const double* colour, double* squared);
    /// The same from `size` colours, rounded up to whole registers.
    void (*from_colours)(const double* const* channels, int size, const double* colour,
                         double* squared);
    /// Sets `weighted` to `pull` from `distance`, for `size` colours with these pixel counts.
    void (*pull)(const double* counts, int size, const LossReach& reach, LossLeaf& leaf);

    /// One for each instruction set in this build.
    static const LossKernels& baseline();
    static const LossKernels& avx2();
    static const LossKernels& avx512();
};

}  // namespace palette4d
