// Comparisons of colours, for the tests of this room.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "model/polytope.hpp"

namespace colours {

inline bool same_bits(const palette4d::Vec3& a, const palette4d::Vec3& b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

inline double apart(const palette4d::Vec3& a, const palette4d::Vec3& b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

}  // namespace colours
