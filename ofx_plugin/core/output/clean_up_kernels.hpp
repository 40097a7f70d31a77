// The arithmetic of clean_up.hpp, for many pixels or cells at a time. Plain data and pointers only,
// as in mvc_kernels.hpp.
#pragma once

#include <cstddef>

namespace palette4d {

/// The filter sees this many cells on each side of a cell.
constexpr int kCleanUpReach = 2;
constexpr int kCleanUpRows = 2 * kCleanUpReach + 1;
/// Least variance, squared code values, that counts as an edge. Larger: the result is blurred.
/// Smaller: noise and codec blocks return.
constexpr double kCleanUpNoise = 4e-4;
/// Filtered shares below this one fade out, to 0. Larger: soft edges become harder. Smaller:
/// between two picks noise turns a colour on and off.
constexpr float kCleanUpFaint = 0.1f;
/// Above any share: a matte times an amount of a colour (pick_space.hpp).
constexpr float kCleanUpMost = 2;

/// What is summed over a cell, in this order: pixels, the guide (3), its products (6: rr, rg, rb,
/// gg, gb, bb), the displacement and the share of PickKernels::set (4), and their products with the
/// guide (12, the guide's channel first).
constexpr int kCleanUpMoved = 4, kCleanUpGuideSums = 10;
constexpr int kCleanUpSums = kCleanUpGuideSums + 4 * kCleanUpMoved;
/// The displacement and the share as linear functions of the guide: 12 slopes (as above), 4
/// constants.
constexpr int kCleanUpTerms = 4 * kCleanUpMoved;

/// The kernels of one instruction set. Each plane of a row has kCleanUpReach columns of zeros on
/// both sides. `plane` is the distance from one plane to the next.
struct CleanUpKernels {
    static constexpr int kSize = 64;
    using Channels = float (*)[kSize];
    using ConstChannels = const float (*)[kSize];

    /// Divides colours by `alpha`, if it is not null. Sets `counts` to 1 where alpha and the colour
    /// are finite, else to 0, and the colour with it.
    void (*check)(Channels colour, const float* alpha, float* counts);
    /// Sets `guide` to colours within -1..2: as they are within 0..1, else nearer to it. Functions
    /// that are fitted beside a highlight would go far astray at it.
    void (*limit)(ConstChannels colour, Channels guide);
    /// Sets `moved` to 0 where `counts` is 0. False when the displacement is 0 everywhere.
    bool (*keep)(const float* counts, Channels moved);
    /// Adds pixels to the sums of the first `columns` of `cells` cells. Slot k * cells + c has
    /// pixel k of cell c, of `width` pixels in each. `counts` is 1 for a pixel that counts; others
    /// have zeros in `guide` and `moved`. A null `moved` has zeros.
    void (*add)(ConstChannels guide, ConstChannels moved, const float* counts, int columns,
                int cells, int width, double* sums, std::ptrdiff_t plane);
    /// Fits columns [from, to): kCleanUpTerms planes, from kCleanUpRows rows of sums.
    void (*fit)(const double* const* rows, std::ptrdiff_t plane, int from, int to, double* terms);
    /// Means of fitted rows, whose last plane is their weight, for columns [from, to). The result's
    /// planes have no zeros at their sides.
    void (*smooth)(const double* const* rows, std::ptrdiff_t plane, int from, int to, float* terms,
                   std::ptrdiff_t terms_plane);
    /// Applies linear functions between `cells` + 1 nodes to pixels in the slots of add().
    struct Nodes {
        const float *low, *high;  ///< terms in the rows of nodes below and above, plane after plane
        std::ptrdiff_t plane;
        float part;          ///< of the way from low to high
        const float* parts;  ///< of the way from node to node, for each pixel of a cell
        int cells, width;
    };
    /// Sets `change` to filtered * (the functions at the guide) + own * `moved`: 0 where `counts`
    /// is. The functions are scaled as their share is to be within 0..kCleanUpMost: fitted to a red
    /// thing, they would move a white one beside it the other way.
    void (*apply)(const Nodes& nodes, ConstChannels guide, ConstChannels moved, const float* counts,
                  float filtered, float own, Channels change);

    /// One for each instruction set in this build.
    static const CleanUpKernels& baseline();
    static const CleanUpKernels& avx2();
    static const CleanUpKernels& avx512();
};

}  // namespace palette4d
