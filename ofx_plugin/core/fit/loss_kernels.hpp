// The reconstruction loss' inner loops: boxes and leaves of a ColourTree against the facets of a
// convex palette. Plain data and pointers only, as in mvc_kernels.hpp.
#pragma once

namespace palette4d {

/// An edge between two corners, with precomputed values for the closest point.
struct LossEdge {
    int at[2];
    double from[3], along[3];
    double inverse_length2;  ///< 0 for an edge without length
};

/// A supporting triangle, with precomputed values for the closest point: its plane, and the
/// barycentric coordinates of corners 1 and 2. They are linear functions of the colour; corner 0
/// has the remaining weight.
struct LossFacet {
    int at[3];
    double normal[3];  ///< unit, outwards
    bool high[3];      ///< per axis: whether a box's high side is farther outwards
    double offset;
    double slope[2][3];
    double start[2];
};

/// Results for a few colours, lane by lane.
struct LossLeaf {
    static constexpr int kSize = 16;
    alignas(64) double distance[kSize];  ///< from the palette, 0 for a colour inside
    alignas(64) double facet[kSize];  ///< the first facet that holds its perpendicular foot, or -1
    alignas(64) double share[2][kSize];  ///< barycentric coordinates of the foot, corners 1 and 2
    alignas(64) double edge[kSize];      ///< its closest edge
    alignas(64) double along[kSize];     ///< position on that edge, 0 to 1
    alignas(64) double pull[kSize];      ///< derivative of R + E by the distance, times all pixels
    unsigned outside;                    ///< a bit for each colour outside
    unsigned beside;                     ///< those of them whose foot no facet holds
};

/// Sums over leaves, lane by lane: the order of additions is the same for every register width.
struct LossSums {
    alignas(64) double distance[LossLeaf::kSize];      ///< R, times all pixels
    alignas(64) double far_distance[LossLeaf::kSize];  ///< E, times all pixels
    alignas(64) double counted[LossLeaf::kSize];       ///< pixels that count as outside
    alignas(64) double most[LossLeaf::kSize];          ///< the largest distance
};

/// How the colours above a facet pull at it, in total and at corners 1 and 2, lane by lane. With
/// the normal, this gives their gradient.
struct LossLoad {
    alignas(64) double all[LossLeaf::kSize];
    alignas(64) double corner[2][LossLeaf::kSize];
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
    /// Sets `distance`, `facet`, `share` and the bits for `size` colours (rounded up to whole
    /// registers) against the `count` facets in `which`. A colour is above a facet from `flat` on;
    /// a perpendicular foot on such a facet is the closest point of a convex body. Colours beside
    /// all of them have the distance 0 so far.
    void (*fall)(const LossFacet* facets, const int* which, int count,
                 const double* const* channels, int size, double flat, LossLeaf& leaf);
    /// Sets `distance`, `edge` and `along` for `size` colours against `count` edges.
    void (*to_edges)(const LossEdge* edges, int count, const double* const* channels, int size,
                     LossLeaf& leaf);
    /// Sets `pull` from `distance`, for `size` colours with these pixel counts, 0 in other lanes,
    /// and adds to the sums.
    void (*pull)(const double* counts, int size, const LossReach& reach, LossLeaf& leaf,
                 LossSums& sums);
    /// Adds a leaf's `pull` to the loads of the `count` facets in `which`.
    void (*press)(const int* which, int count, const LossLeaf& leaf, LossLoad* loads);
    /// Squared distances of a colour from kBoxes boxes; 0 inside.
    void (*from_boxes)(const double (*sides)[3][kBoxes], const double* colour, double* squared);
    /// The same from `size` colours, rounded up to whole registers. Returns a bit for each that is
    /// at most `limit`.
    unsigned (*from_colours)(const double* const* channels, int size, const double* colour,
                             double limit, double* squared);

    /// One for each instruction set in this build.
    static const LossKernels& baseline();
    static const LossKernels& avx2();
    static const LossKernels& avx512();
};

}  // namespace palette4d
