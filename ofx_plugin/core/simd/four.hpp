// Four floats in a vector on any processor: a node of a Lattice, or a colour plus one value. In an
// unnamed namespace, like lanes.hpp and for its reasons.
#pragma once

#include <cstring>

namespace {

typedef float Four __attribute__((vector_size(16)));
inline Four all_four(float x) { return x - Four{}; }
inline Four max(Four a, Four b) { return a > b ? a : b; }
/// a where x is below 0, else b.
inline Four where_negative(Four x, Four a, Four b) { return x < 0.0f ? a : b; }
/// a where x is 0, else b.
inline Four where_zero(Four x, Four a, Four b) { return x != 0.0f ? b : a; }

inline Four abs(Four a) { return max(a, -1.0f * a); }

inline Four load_four(const float* from) {
    Four r;
    std::memcpy(&r, from, sizeof r);
    return r;
}

inline void store_four(float* to, Four a) { std::memcpy(to, &a, sizeof a); }

}  // namespace
