// The one rule for alpha, of the core and of Python. All is inlined: kernels for different
// processors must not share a function.
#pragma once

#include <limits>

namespace palette4d {

/// Pixels with less alpha are invisible in 8 bits: the analysis leaves them out.
inline constexpr float kLeastAlpha = 1.0f / 255;

/// Whether a premultiplied pixel has a colour: alpha is finite and not 0. It may be negative or
/// tiny. Recolouring lets other pixels pass, and the analysis leaves them out.
template <class T>
inline __attribute__((always_inline)) bool divides(T alpha) {
    return alpha != 0 && 0 * alpha == 0;  // 0 times infinity is NaN
}

/// A channel of a premultiplied pixel, divided by the pixel's alpha; NaN where it divides nothing.
template <class T>
inline __attribute__((always_inline)) T straight(T channel, T alpha) {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    return channel / (divides(alpha) ? alpha : kNone);
}

}  // namespace palette4d
