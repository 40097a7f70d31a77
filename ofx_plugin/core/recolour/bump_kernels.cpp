// The kernels of bump_kernels.hpp, compiled for the vector width that lanes.hpp has here.
#include "recolour/bump_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using palette4d::BumpKernels;
using palette4d::BumpPlan;

template <class T>
using Channels = BumpKernels::Channels<T>;

/// sum += max(0, 1 - |v|^2 / radius^2)^3 by, for v = centre - colour. False when no lane moves.
template <class T>
PALETTE4D_INLINE bool add_one(const typename BumpPlan<T>::One& bump, const Lanes<T> (&v)[3],
                              Lanes<T> (&sum)[3]) {
    const Lanes<T> zero = all(T(0));
    const Lanes<T> within =
        all(T(1)) - (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) * all(bump.inverse_radius2);
    if (!any(within > zero)) return false;
    const Lanes<T> t = max(within, zero), weight = t * t * t;
    for (int c = 0; c < 3; ++c) sum[c] = sum[c] + weight * all(bump.by[c]);
    return true;
}

template <class T>
void add(const BumpPlan<T>& plan, Channels<const T> high, Channels<const T> low, Channels<T> moved,
         int count) {
    for (int at = 0; at < count; at += Lanes<T>::kCount) {
        Lanes<T> sum[3] = {all(T(0)), all(T(0)), all(T(0))};
        bool moves = false;
        for (int b = 0; b < plan.count; ++b) {
            const typename BumpPlan<T>::One& bump = plan.bumps[b];
            Lanes<T> v[3];
            for (int c = 0; c < 3; ++c) {
                v[c] = (all(bump.high[c]) - load(high[c] + at)) +
                       (all(bump.low[c]) - load(low[c] + at));
            }
            moves |= add_one(bump, v, sum);
        }
        if (!moves) continue;
        for (int c = 0; c < 3; ++c) store(moved[c] + at, load(moved[c] + at) + sum[c]);
    }
}

bool set(const BumpPlan<float>& plan, Channels<const float> colour, Channels<float> moved,
         int count) {
    bool moves = false;
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        Lanes<float> sum[3] = {all(0.0f), all(0.0f), all(0.0f)};
        for (int b = 0; b < plan.count; ++b) {
            const BumpPlan<float>::One& bump = plan.bumps[b];
            Lanes<float> v[3];
            for (int c = 0; c < 3; ++c) {
                v[c] = (all(bump.high[c]) - load(colour[c] + at)) + all(bump.low[c]);
            }
            moves |= add_one(bump, v, sum);
        }
        for (int c = 0; c < 3; ++c) store(moved[c] + at, sum[c]);
    }
    return moves;
}

constexpr BumpKernels kKernels = {&add<float>, &add<double>, &set};

}  // namespace

namespace palette4d {
const BumpKernels& BumpKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
