// The kernels of pick_kernels.hpp, compiled for the vector width that lanes.hpp has here. The sums
// are those of with_picks().
#include "recolour/pick_kernels.hpp"

// Constants only: no function of another header may be compiled for this instruction set.
#include "model/matte.hpp"
#include "simd/lanes.hpp"

namespace {

using palette4d::MatteGrid;
using palette4d::PickKernels;
using palette4d::PickPlan;

template <class T>
using Channels = PickKernels::Channels<T>;

constexpr int kSize = PickKernels::kSize;

/// 64 colours, and what the mattes and the amounts of those are read from that a grid reaches.
template <class T>
struct Read {
    alignas(64) T display[3][kSize];
    alignas(64) T point[3][kSize];
    alignas(64) T chroma[2][kSize];
    alignas(64) T certain[kSize];   ///< how far chroma is above noise, 0..1
    alignas(64) T grey[kSize];      ///< 0..1
    alignas(64) T whole[3][kSize];  ///< the lower node around a point, by its numbers
    alignas(64) T part[3][kSize];   ///< of the way from there to the next ones
    bool placed[kSize];  ///< whether a register has all but the points; by its first lane
    // Of the grid that was read last:
    alignas(64) T inside[kSize];  ///< above 0 where it may change something
    alignas(64) int node[kSize];  ///< where its values around a colour are
};

/// NaN gives `low`.
template <class T>
PALETTE4D_INLINE Lanes<T> within(Lanes<T> x, T low, T high) {
    return min(max(x, all(low)), all(high));
}

/// Stores whole numbers below 2^24.
PALETTE4D_INLINE void store_index(int* to, Lanes<float> a) { store_whole(to, a); }
PALETTE4D_INLINE void store_index(int* to, Lanes<double> a) {
    for (int lane = 0; lane < Lanes<double>::kCount; ++lane) to[lane] = static_cast<int>(a.v[lane]);
}

/// The place among evenly spaced values, in whole steps and the part beyond. Not the last one, so
/// that there is a next.
template <class T>
PALETTE4D_INLINE Lanes<T> whole_steps(Lanes<T> at, int values, Lanes<T>& part) {
    const Lanes<T> inside = within(at, T(0), static_cast<T>(values - 1));
    const Lanes<T> whole = min(truncated(inside), all(static_cast<T>(values - 2)));
    part = inside - whole;
    return whole;
}

/// As DisplayCurve has it; NaN counts as the curve's start.
template <class T>
PALETTE4D_INLINE void display(const PickPlan<T>& plan, Channels<const T> colour, int count,
                              Read<T>& read) {
    constexpr int n = Lanes<T>::kCount;
    alignas(64) int index[kSize];
    alignas(64) T part[kSize], next[kSize];
    for (int c = 0; c < 3; ++c) {
        T* const to = read.display[c];
        for (int at = 0; at < count; at += n) {
            Lanes<T> rest;
            store_index(index + at, whole_steps((load(colour[c] + at) - all(plan.display_from)) *
                                                    all(plan.display_scale),
                                                plan.display_count, rest));
            store(part + at, rest);
        }
        for (int at = 0; at < count; at += n) {
            for (int i = at; i < at + n; ++i) {
                to[i] = plan.display[index[i]];
                next[i] = plan.display[index[i] + 1];
            }
        }
        for (int at = 0; at < count; at += n) {
            const Lanes<T> low = load(to + at);
            store(to + at, low + load(part + at) * (load(next + at) - low));
        }
    }
}

template <class T>
PALETTE4D_INLINE void read_points(Channels<const T> shown, int count, Read<T>& read) {
    for (int at = 0; at < count; at += Lanes<T>::kCount) {
        const Lanes<T> r = load(shown[0] + at), g = load(shown[1] + at), b = load(shown[2] + at);
        const Lanes<T> red = all(static_cast<T>(palette4d::kRedAxis)) * ((r - g) + (r - b));
        const Lanes<T> green = all(static_cast<T>(palette4d::kGreenAxis)) * (g - b);
        const Lanes<T> light = max(max(r, g), max(b, all(T(0))));
        const Lanes<T> scale = all(T(1)) / (light + all(static_cast<T>(palette4d::kDark)));
        store(read.chroma[0] + at, red);
        store(read.chroma[1] + at, green);
        store(read.point[0] + at, red * scale);
        store(read.point[1] + at, green * scale);
        store(read.point[2] + at, light);
        read.placed[at] = false;
    }
}

/// Finds the nodes around the colours from `at` on, and what amounts need.
template <class T>
PALETTE4D_INLINE void place(Channels<const T> shown, int at, Read<T>& read) {
    if (read.placed[at]) return;
    read.placed[at] = true;
    const T most = static_cast<T>(MatteGrid::kMost);
    const T per_saturation = static_cast<T>(MatteGrid::kPerSaturation);
    for (int c = 0; c < 3; ++c) {
        const Lanes<T> x = load(read.point[c] + at);
        Lanes<T> part;
        const Lanes<T> steps = c == 2 ? x * all(static_cast<T>(MatteGrid::kPerLightness))
                                      : (x + all(most)) * all(per_saturation);
        const int nodes = c == 2 ? MatteGrid::kLightnesses : MatteGrid::kSaturations;
        store(read.whole[c] + at, whole_steps(steps, nodes, part));
        store(read.part[c] + at, part);
    }
    const Lanes<T> red = load(read.chroma[0] + at), green = load(read.chroma[1] + at);
    constexpr double kNoise = palette4d::kChromaNoise;
    const Lanes<T> t =
        min((red * red + green * green) * all(static_cast<T>(1 / (kNoise * kNoise))), all(T(1)));
    store(read.certain + at, t * t * (all(T(3)) - all(T(2)) * t));
    const Lanes<T> sum = load(shown[0] + at) + load(shown[1] + at) + load(shown[2] + at);
    store(read.grey + at, within(sum * all(static_cast<T>(1.0 / 3)), T(0), T(1)));
}

/// The values of colours `lane`, `lane` + 4, ... between the two nodes of the first axis.
template <int lane>
PALETTE4D_INLINE Lanes<float> read_fours(const PickPlan<float>::Grid& grid, const int* node,
                                         Lanes<float> part) {
    const Lanes<float> low = load_fours(grid.values, node + lane),
                       high = load_fours(grid.values + grid.plane, node + lane);
    return low + shuffled<lane, lane, lane, lane>(part, part) * (high - low);
}
/// The four values around colours, between the two nodes of the first axis: of the lower lightness
/// the two along the second axis, then those of the higher one.
PALETTE4D_INLINE void read_grid(const PickPlan<float>::Grid& grid, const int* node,
                                Lanes<float> part, Lanes<float> (&around)[4]) {
    const Lanes<float> a = read_fours<0>(grid, node, part), b = read_fours<1>(grid, node, part),
                       c = read_fours<2>(grid, node, part), d = read_fours<3>(grid, node, part);
    const Lanes<float> dark_ab = shuffled<0, 1, 0, 1>(a, b), dark_cd = shuffled<0, 1, 0, 1>(c, d),
                       light_ab = shuffled<2, 3, 2, 3>(a, b), light_cd = shuffled<2, 3, 2, 3>(c, d);
    around[0] = shuffled<0, 2, 0, 2>(dark_ab, dark_cd);
    around[1] = shuffled<1, 3, 1, 3>(dark_ab, dark_cd);
    around[2] = shuffled<0, 2, 0, 2>(light_ab, light_cd);
    around[3] = shuffled<1, 3, 1, 3>(light_ab, light_cd);
}
PALETTE4D_INLINE void read_grid(const PickPlan<double>::Grid& grid, const int* node,
                                Lanes<double> part, Lanes<double> (&around)[4]) {
    constexpr int kLine = MatteGrid::kLightnesses;
    for (int k = 0; k < 4; ++k) {
        for (int lane = 0; lane < Lanes<double>::kCount; ++lane) {
            const float* const from = grid.values + node[lane] + (k >> 1) + (k & 1) * kLine;
            const double low = static_cast<double>(from[0]),
                         high = static_cast<double>(from[grid.plane]);
            around[k].v[lane] = low + part.v[lane] * (high - low);
        }
    }
}

/// The values of the grid that was read, at the colours from `at` on; `idle` where it is not.
template <class T>
PALETTE4D_INLINE Lanes<T> value_at(const typename PickPlan<T>::Grid& grid, const Read<T>& read,
                                   int at, T idle) {
    Lanes<T> around[4];
    read_grid(grid, read.node + at, load(read.part[0] + at), around);
    const Lanes<T> part_v = load(read.part[1] + at);
    const Lanes<T> dark = around[0] + part_v * (around[1] - around[0]),
                   light = around[2] + part_v * (around[3] - around[2]);
    const Lanes<T> value = dark + load(read.part[2] + at) * (light - dark);
    return select(load(read.inside + at) > all(T(0)), value, all(idle));
}

/// Reads a grid where it may change something: around registers of colours, whose first lanes it
/// sets and counts.
template <class T>
PALETTE4D_INLINE int reach(const typename PickPlan<T>::Grid& grid, Channels<const T> shown,
                           int count, Read<T>& read, int (&reached)[kSize]) {
    constexpr int n = Lanes<T>::kCount;
    int found = 0;
    for (int at = 0; at < count; at += n) {
        LaneMask<T> inside = load(read.point[0] + at) >= all(grid.low[0]);
        inside = inside & (load(read.point[0] + at) <= all(grid.high[0]));
        for (int c = 1; c < 3; ++c) {
            const Lanes<T> x = load(read.point[c] + at);
            inside = inside & (x >= all(grid.low[c])) & (x <= all(grid.high[c]));
        }
        if (!any(inside)) continue;
        reached[found++] = at;
        place<T>(shown, at, read);
        const Lanes<T> node = load(read.whole[0] + at) * all(grid.step[0]) +
                              load(read.whole[1] + at) * all(grid.step[1]) +
                              load(read.whole[2] + at) * all(grid.step[2]) - all(grid.base);
        store_index(read.node + at, select(inside, node, all(T(0))));
        store(read.inside + at, select(inside, all(T(1)), all(T(0))));
    }
    return found;
}

/// What a window leaves of a pick at the places from `at` on, as FrameWindow::at() has it.
template <class T>
PALETTE4D_INLINE Lanes<T> window_at(const typename PickPlan<T>::Window& window,
                                    Channels<const T> place, int at) {
    const Lanes<T> zero = all(T(0));
    Lanes<T> away = zero;
    for (int c = 0; c < 2; ++c) {
        const Lanes<T> x = load(place[c] + at);
        const Lanes<T> beyond =
            max(max(all(window.low[c]) - x, x - all(window.high[c])), zero) * all(window.scale);
        away = away + beyond * beyond;
    }
    const Lanes<T> left = all(T(1)) - min(away, all(T(1)));
    return all(window.outside) + all(window.inside) * (left * left);
}

/// Adds to `sum` what a pick does to the colours from `at` on. Where several picks share a colour,
/// its sum is weighted, and `weights` has the sum of the weights. `shares`, if it is not null, gets
/// the share.
template <bool alone, class T>
PALETTE4D_INLINE void add_pick(const typename PickPlan<T>::One& pick, const Read<T>& read,
                               Channels<const T> place, int at, Channels<T> sum, T* shares,
                               T* weights) {
    const Lanes<T> one = all(T(1)), least = all(static_cast<T>(palette4d::kLeastLight));
    const Lanes<T> hue = max(all(pick.along[0]) * load(read.chroma[0] + at) +
                                 all(pick.along[1]) * load(read.chroma[1] + at),
                             all(T(0))) *
                         load(read.certain + at);
    const Lanes<T> grey = load(read.grey + at);
    const Lanes<T> light =
        min((grey + least) * all(pick.dark), min((one - grey + least) * all(pick.bright), one));
    Lanes<T> amount = hue + all(pick.plain) * light;
    amount = select(amount > one, all(T(2)) - one / amount, amount);
    Lanes<T> matte = value_at<T>(pick.matte, read, at, T(0));
    if (place) matte = matte * window_at<T>(pick.window, place, at);
    Lanes<T> share = matte * amount;
    Lanes<T> dark = matte * max(amount - (grey + least) * all(pick.shade), all(T(0)));
    if (!alone) {
        const Lanes<T> u = load(read.point[0] + at) - all(pick.at[0]),
                       v = load(read.point[1] + at) - all(pick.at[1]),
                       l = all(static_cast<T>(palette4d::kLightnessWeight)) *
                           (load(read.point[2] + at) - all(pick.at[2]));
        const Lanes<T> weight =
            matte * all(pick.strength) /
            (u * u + v * v + l * l + all(static_cast<T>(palette4d::kNearestPick)));
        store(weights + at, load(weights + at) + weight);
        share = share * weight;
        dark = dark * weight;
    }
    dark = dark * all(pick.light);
    for (int c = 0; c < 3; ++c) {
        store(sum[c] + at, load(sum[c] + at) + (share * all(pick.change[c]) - dark));
    }
    if (shares) store(shares + at, load(shares + at) + share);
}

template <class T>
PALETTE4D_INLINE void clear(Channels<T> rows, int row_count, int count) {
    for (int c = 0; c < row_count; ++c) {
        for (int at = 0; at < count; at += Lanes<T>::kCount) store(rows[c] + at, all(T(0)));
    }
}

/// Adds what the picks do to `moved`, and with `shares` their share to its fourth row. False when
/// they do nothing.
template <bool shares, class T>
PALETTE4D_INLINE bool add_picks(const PickPlan<T>& plan, Channels<const T> shown,
                                Channels<const T> place, int count, Read<T>& read,
                                Channels<T> moved) {
    constexpr int n = Lanes<T>::kCount;
    int reached[kSize];
    if (plan.count == 1) {
        const int found = reach<T>(plan.picks[0].matte, shown, count, read, reached);
        for (int i = 0; i < found; ++i) {
            add_pick<true, T>(plan.picks[0], read, place, reached[i], moved,
                              shares ? moved[3] : nullptr, nullptr);
        }
        return found > 0;
    }
    alignas(64) T sum[5][kSize];  // channels, shares, weights
    clear<T>(sum, 5, count);
    bool some = false;
    for (int k = 0; k < plan.count; ++k) {
        const typename PickPlan<T>::One& pick = plan.picks[k];
        const int found = reach<T>(pick.matte, shown, count, read, reached);
        for (int i = 0; i < found; ++i) {
            add_pick<false, T>(pick, read, place, reached[i], sum, shares ? sum[3] : nullptr,
                               sum[4]);
        }
        some |= found > 0;
    }
    if (!some) return false;
    for (int at = 0; at < count; at += n) {
        const Lanes<T> scale = all(T(1)) / max(load(sum[4] + at), all(static_cast<T>(1e-30)));
        for (int c = 0; c < (shares ? 4 : 3); ++c) {
            store(moved[c] + at, load(moved[c] + at) + load(sum[c] + at) * scale);
        }
    }
    return true;
}

template <class T>
PALETTE4D_INLINE Channels<const T> read_colours(const PickPlan<T>& plan, Channels<const T> colour,
                                                int count, Read<T>& read) {
    Channels<const T> shown = colour;
    if (plan.display) {
        display<T>(plan, colour, count, read);
        shown = read.display;
    }
    read_points<T>(shown, count, read);
    return shown;
}

template <class T>
void add(const PickPlan<T>& plan, Channels<const T> colour, Channels<const T> place,
         Channels<T> moved, int count) {
    Read<T> read;
    Channels<const T> shown = read_colours<T>(plan, colour, count, read);
    if (plan.left.values) {
        int reached[kSize];
        const int found = reach<T>(plan.left, shown, count, read, reached);
        for (int i = 0; i < found; ++i) {
            const Lanes<T> left = value_at(plan.left, read, reached[i], T(1));
            for (int c = 0; c < 3; ++c) {
                store(moved[c] + reached[i], left * load(moved[c] + reached[i]));
            }
        }
    }
    add_picks<false, T>(plan, shown, place, count, read, moved);
}

bool set(const PickPlan<float>& plan, Channels<const float> colour, Channels<const float> place,
         Channels<float> moved, int count) {
    Read<float> read;
    Channels<const float> shown = read_colours<float>(plan, colour, count, read);
    const Lanes<float> zero = all(0.0f);
    clear<float>(moved, 4, count);
    const bool some = add_picks<true, float>(plan, shown, place, count, read, moved);
    for (int at = 0; some && at < count; at += Lanes<float>::kCount) {
        // NaN where a channel is not finite: 0 times infinity is NaN.
        const Lanes<float> finite =
            zero * load(colour[0] + at) + zero * load(colour[1] + at) + zero * load(colour[2] + at);
        for (int c = 0; c < 4; ++c) {
            store(moved[c] + at, select(finite >= zero, load(moved[c] + at), zero));
        }
    }
    return some;
}

constexpr PickKernels kKernels = {&add<float>, &add<double>, &set};

}  // namespace

namespace palette4d {
const PickKernels& PickKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
