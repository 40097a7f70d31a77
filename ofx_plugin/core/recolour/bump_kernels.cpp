// The kernels of bump_kernels.hpp, compiled for the vector width that lanes.hpp has here.
#include "recolour/bump_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using palette4d::BumpKernels;
using palette4d::BumpPlan;

template <class T>
using Channels = BumpKernels::Channels<T>;

template <class T>
PALETTE4D_INLINE Lanes<T> square(const Lanes<T> (&v)[3]) {
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

/// 1 - (|v|^2 - (along . v)^2) / radius^2 for v = centre - colour.
template <class T>
PALETTE4D_INLINE Lanes<T> within(const typename BumpPlan<T>::One& bump, const Lanes<T> (&v)[3]) {
    const Lanes<T> along =
        v[0] * all(bump.along[0]) + v[1] * all(bump.along[1]) + v[2] * all(bump.along[2]);
    return all(T(1)) - (square<T>(v) - along * along) * all(bump.inverse_radius2);
}

/// Adds to `moved` bump by bump, and scales its `rows` by holds. `low` may be null. False when no
/// colour is within a bump.
template <int rows, class T>
PALETTE4D_INLINE bool add_all(const BumpPlan<T>& plan, Channels<const T> high,
                              Channels<const T> low, Channels<T> moved, int count) {
    constexpr int n = Lanes<T>::kCount;
    const Lanes<T> zero = all(T(0));
    const auto away = [&](const typename BumpPlan<T>::One& bump, int c, Lanes<T> colour,
                          Lanes<T> rest) __attribute__((always_inline)) {
        return (all(bump.high[c]) - colour) + (all(bump.low[c]) - rest);
    };
    // The box of each lane's colours: colours in a picture's row are alike, and most bumps are far
    // from all of them. Rounding is monotonic, so that no colour is nearer to a centre than its box
    // is. A box with NaN counts as near to all.
    Lanes<T> least[3], most[3], least_rest[3], most_rest[3];
    for (int c = 0; c < 3; ++c) {
        least[c] = most[c] = load(high[c]);
        least_rest[c] = most_rest[c] = low ? load(low[c]) : zero;
        for (int at = n; at < count; at += n) {
            least[c] = min(load(high[c] + at), least[c]);
            most[c] = max(load(high[c] + at), most[c]);
            if (!low) continue;
            least_rest[c] = min(load(low[c] + at), least_rest[c]);
            most_rest[c] = max(load(low[c] + at), most_rest[c]);
        }
    }
    bool moves = false;
    for (int b = 0; b < plan.count; ++b) {
        const typename BumpPlan<T>::One& bump = plan.bumps[b];
        Lanes<T> v[3];
        for (int c = 0; c < 3; ++c) {
            const Lanes<T> above = away(bump, c, most[c], most_rest[c]),
                           below = zero - away(bump, c, least[c], least_rest[c]);
            v[c] = max(max(above, below), zero);
        }
        if (!any(all(T(1)) - square<T>(v) * all(bump.inverse_reach2) > zero)) continue;
        for (int at = 0; at < count; at += n) {
            for (int c = 0; c < 3; ++c) {
                v[c] = away(bump, c, load(high[c] + at), low ? load(low[c] + at) : zero);
            }
            const Lanes<T> t = max(within(bump, v), zero), weight = t * t * t;
            if (bump.keep > 0) {
                const Lanes<T> rest = all(T(1)) - weight;
                const Lanes<T> scale =
                    all(T(1)) - (all(T(1)) - rest * rest * rest) * all(bump.keep);
                for (int c = 0; c < rows; ++c) store(moved[c] + at, load(moved[c] + at) * scale);
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                store(moved[c] + at, load(moved[c] + at) + weight * all(bump.by[c]));
            }
        }
        moves = true;
    }
    return moves;
}

template <class T>
void add(const BumpPlan<T>& plan, Channels<const T> high, Channels<const T> low, Channels<T> moved,
         int count) {
    add_all<3>(plan, high, low, moved, count);
}

bool set(const BumpPlan<float>& plan, Channels<const float> colour, Channels<float> moved,
         int count) {
    for (int c = 0; c < 3; ++c) {
        for (int at = 0; at < count; at += Lanes<float>::kCount) store(moved[c] + at, all(0.0f));
    }
    for (int at = 0; at < count; at += Lanes<float>::kCount) store(moved[3] + at, all(1.0f));
    return add_all<4, float>(plan, colour, nullptr, moved, count);
}

constexpr BumpKernels kKernels = {&add<float>, &add<double>, &set};

}  // namespace

namespace palette4d {
const BumpKernels& BumpKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
