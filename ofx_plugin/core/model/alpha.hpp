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
    return (alpha != 0) & (0 * alpha == 0);  // 0 times infinity is NaN; no branch
}

/// What its channels are divided by; NaN where alpha divides nothing.
template <class T>
inline __attribute__((always_inline)) T divisor(T alpha) {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    return divides(alpha) ? alpha : kNone;
}

/// A channel of a premultiplied pixel, divided by the pixel's alpha.
template <class T>
inline __attribute__((always_inline)) T straight(T channel, T alpha) {
    return channel / divisor(alpha);
}

}  // namespace palette4d
