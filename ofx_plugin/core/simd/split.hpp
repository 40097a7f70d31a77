// A number as the sum of two shorter ones.
#pragma once

namespace palette4d {

/// x rounded to T, and what that leaves over, rounded to T.
template <class T>
inline void split(double x, T& high, T& low) {
    // volatile: where it vectorises this, GCC 12 takes a double rounded to float and back for the
    // double itself, and nothing is left over.
    const volatile T rounded = static_cast<T>(x);
    high = rounded;
    low = static_cast<T>(x - static_cast<double>(high));
}

}  // namespace palette4d
