// Adds the displacements of picks to 64 colours, and applies holds, at a time. Plain data and
// pointers only, as in mvc_kernels.hpp.
#pragma once

namespace palette4d {

/// Least squared distance of a colour from a pick, where several picks share it.
constexpr double kNearestPick = 1e-6;

/// Picks with what each colour needs to be computed; T as the kernels have it.
template <class T>
struct PickPlan {
    /// A MatteGrid. In single precision only the part that may change something is there, so that
    /// it lies in few pages of memory. Each node then has two values side by side, its own and that
    /// of the next node along the second axis: two reads give the eight values around a colour.
    struct Grid {
        const float* values;  ///< null: no grid
        T low[3], high[3];    ///< bounds of the points where the grid may change something
        T step[3], base;      ///< node (u, v, l) is at step . (u, v, l) - base
        int plane;            ///< step[0]
    };
    /// The part of the picture that a pick changes; far away in all directions where it is all.
    struct Window {
        T low[2], high[2];  ///< of a box, in pixels of the clip
        T scale;            ///< 1 / the feather
        T outside, inside;  ///< 0 and 1, or 1 and -1: what is far away, and what the box adds
    };
    struct One {
        Grid matte;
        Window window;
        T at[3];         ///< the picked colour's point
        T along[2];      ///< the amount of its chroma in a colour is along . chroma
        T plain;         ///< the part of the amount that is read from lightness, 0..1
        T dark, bright;  ///< 1 / (the picked colour's lightness, and what it is below 1; each plus
                         ///< kLeastLight)
        T strength;
        T change[3];  ///< of a colour with amount 1
        T light;      ///< the part of it that is the same in all channels; 0: none counts as light
        T shade;  ///< the amount of light in a colour is its lightness plus kLeastLight, times this
    };
    const One* picks;
    int count;
    Grid left;         ///< what holds leave of the palette's changes; without values: all
    const T* display;  ///< a DisplayCurve's values; null where there is none
    int display_count;
    T display_from;
    T display_scale;  ///< values per code value

    bool empty() const { return count == 0 && !left.values; }
};

/// The kernels of one instruction set. They read and write `count` colours of 64, rounded up to
/// whole registers.
struct PickKernels {
    static constexpr int kSize = 64;
    template <class T>
    using Channels = T (*)[kSize];

    /// Sets `moved`, which has what the palette does to `colour` at strength 1, to what holds leave
    /// of it and what picks add. `place` has where the pixels are, x and y in pixels of the clip;
    /// null: windows do not count.
    void (*add_single)(const PickPlan<float>& plan, Channels<const float> colour,
                       Channels<const float> place, Channels<float> moved, int count);
    void (*add_twofold)(const PickPlan<double>& plan, Channels<const double> colour,
                        Channels<const double> place, Channels<double> moved, int count);
    /// Sets `moved` to what picks do; NaN and infinity do not move. Its fourth row is the share of
    /// their changes that is done: a matte times an amount, the mean where several picks share a
    /// colour. False when no colour moves.
    bool (*set)(const PickPlan<float>& plan, Channels<const float> colour,
                Channels<const float> place, Channels<float> moved, int count);

    /// One for each instruction set in this build.
    static const PickKernels& baseline();
    static const PickKernels& avx2();
    static const PickKernels& avx512();
};

}  // namespace palette4d
