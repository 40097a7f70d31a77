// Splits a number into the sum of two shorter ones.
#pragma once

namespace palette4d {

/// x rounded to T, and the remainder rounded to T.
template <class T>
inline void split(double x, T& high, T& low) {
    // volatile: when GCC 12 vectorises this, it drops the rounding to float, and the remainder is
    // 0.
    const volatile T rounded = static_cast<T>(x);
    high = rounded;
    low = static_cast<T>(x - static_cast<double>(high));
}

}  // namespace palette4d
