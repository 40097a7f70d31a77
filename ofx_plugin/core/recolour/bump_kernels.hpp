// Adds the displacements of bumps to 64 colours, and applies holds, at a time. Plain data and
// pointers only, as in mvc_kernels.hpp.
#pragma once

namespace palette4d {

/// The bumps of one frame, rounded to T. Centres are split into two numbers, so that differences
/// are exact to the last place.
template <class T>
struct BumpPlan {
    struct One {
        T high[3], low[3];
        T inverse_radius2;
        T along[3];
        /// 1 / (half the bump's length)^2, or a little less: no colour beyond has any weight.
        T inverse_reach2;
        T by[3];
        T keep;  ///< above 0 for holds, which come last
    };
    const One* bumps;
    int count;
};

/// The kernels of one instruction set. They read and write `count` colours of 64, rounded up to
/// whole registers.
struct BumpKernels {
    static constexpr int kSize = 64;
    template <class T>
    using Channels = T (*)[kSize];

    /// Adds to `moved` what the bumps do at strength 1 to colours high + low; then holds scale it.
    void (*add_single)(const BumpPlan<float>& plan, Channels<const float> high,
                       Channels<const float> low, Channels<float> moved, int count);
    void (*add_twofold)(const BumpPlan<double>& plan, Channels<const double> high,
                        Channels<const double> low, Channels<double> moved, int count);
    /// Sets `moved` for colours of one number a channel; NaN and infinity do not move. Its fourth
    /// row is the holds' scale of what else moves the colours. False when it moves and scales none.
    bool (*set)(const BumpPlan<float>& plan, Channels<const float> colour, Channels<float> moved,
                int count);

    /// One for each instruction set in this build.
    static const BumpKernels& baseline();
    static const BumpKernels& avx2();
    static const BumpKernels& avx512();
};

}  // namespace palette4d
