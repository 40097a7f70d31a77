// Vector arithmetic for the kernels: several pixels at a time.
//
// Uses GCC's and Clang's vector types, with intrinsics on x86. The build defines the register width
// PALETTE4D_LANES_BYTES and compiles each kernel source once for each instruction set. Everything
// is inlined, in an unnamed namespace: sources compiled for different processors must not share a
// function. All widths give the same bits: only selections and operations that IEEE 754 rounds
// correctly (+ - * / sqrt), never fused.
#pragma once

#include <cmath>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#define PALETTE4D_LANES_X86
#endif
#if defined(__AVX512F__) && !defined(__clang__)
// False alarms in GCC 12's header: _mm512_min_pd and others use _mm512_undefined_pd() on purpose.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wuninitialized"
#endif

#define PALETTE4D_INLINE inline __attribute__((always_inline))

namespace {

template <class T>
struct IntegerOf;
template <>
struct IntegerOf<float> {
    using Type = int;
};
template <>
struct IntegerOf<double> {
    using Type = long long;
};

template <class T>
struct Lanes {
    static constexpr int kCount = PALETTE4D_LANES_BYTES / static_cast<int>(sizeof(T));
    typedef T Vector __attribute__((vector_size(PALETTE4D_LANES_BYTES)));
    typedef typename IntegerOf<T>::Type Integers
        __attribute__((vector_size(PALETTE4D_LANES_BYTES)));
    Vector v;
};
template <class T>
struct LaneMask {
    typename Lanes<T>::Integers v;
};

#define PALETTE4D_OPERATOR(Result, Operand, op)                          \
    template <class T>                                                   \
    PALETTE4D_INLINE Result<T> operator op(Operand<T> a, Operand<T> b) { \
        return {a.v op b.v};                                             \
    }
PALETTE4D_OPERATOR(Lanes, Lanes, +)
PALETTE4D_OPERATOR(Lanes, Lanes, -)
PALETTE4D_OPERATOR(Lanes, Lanes, *)
PALETTE4D_OPERATOR(Lanes, Lanes, /)
PALETTE4D_OPERATOR(LaneMask, Lanes, <)
PALETTE4D_OPERATOR(LaneMask, Lanes, <=)
PALETTE4D_OPERATOR(LaneMask, Lanes, >)
PALETTE4D_OPERATOR(LaneMask, Lanes, >=)
PALETTE4D_OPERATOR(LaneMask, LaneMask, &)
PALETTE4D_OPERATOR(LaneMask, LaneMask, |)
#undef PALETTE4D_OPERATOR

template <class T>
PALETTE4D_INLINE Lanes<T> all(T value) {
    return {value - typename Lanes<T>::Vector{}};
}
template <class T>
PALETTE4D_INLINE Lanes<T> load(const T* from) {
    Lanes<T> r;
    std::memcpy(&r.v, from, sizeof r.v);
    return r;
}
template <class T>
PALETTE4D_INLINE void store(T* to, Lanes<T> a) {
    std::memcpy(to, &a.v, sizeof a.v);
}
/// Rounds towards zero; values below 2^24 only.
template <class T>
PALETTE4D_INLINE Lanes<T> truncated(Lanes<T> a) {
    using Whole = typename Lanes<T>::Integers;
    return {
        __builtin_convertvector(__builtin_convertvector(a.v, Whole), typename Lanes<T>::Vector)};
}
#if PALETTE4D_LANES_BYTES == 64
PALETTE4D_INLINE Lanes<float> truncated(Lanes<float> a) {
    return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_ZERO)};
}
#elif PALETTE4D_LANES_BYTES == 32
PALETTE4D_INLINE Lanes<float> truncated(Lanes<float> a) {
    return {_mm256_round_ps(a.v, _MM_FROUND_TO_ZERO)};
}
#endif
PALETTE4D_INLINE void store_whole(int* to, Lanes<float> a) {
    const auto whole = __builtin_convertvector(a.v, Lanes<float>::Integers);
    std::memcpy(to, &whole, sizeof whole);
}
template <class T>
PALETTE4D_INLINE Lanes<T> select(LaneMask<T> m, Lanes<T> a, Lanes<T> b) {
    return {m.v ? a.v : b.v};
}
template <class T>
PALETTE4D_INLINE Lanes<T> abs(Lanes<T> a) {
    using Vector = typename Lanes<T>::Vector;
    using Integers = typename Lanes<T>::Integers;
    using Integer = typename IntegerOf<T>::Type;
    constexpr auto kAllButTheSign = static_cast<Integer>((1ull << (8 * sizeof(T) - 1)) - 1);
    return {(Vector)((Integers)a.v & kAllButTheSign)};
}

#if defined(PALETTE4D_LANES_X86)

#if PALETTE4D_LANES_BYTES == 16
#define PALETTE4D_X86(name) _mm_##name
#elif PALETTE4D_LANES_BYTES == 32
#define PALETTE4D_X86(name) _mm256_##name
#else
#define PALETTE4D_X86(name) _mm512_##name
#endif
#define PALETTE4D_FUNCTIONS(T, suffix)                                                         \
    PALETTE4D_INLINE Lanes<T> sqrt(Lanes<T> a) { return {PALETTE4D_X86(sqrt_##suffix)(a.v)}; } \
    PALETTE4D_INLINE Lanes<T> min(Lanes<T> a, Lanes<T> b) {                                    \
        return {PALETTE4D_X86(min_##suffix)(a.v, b.v)};                                        \
    }                                                                                          \
    PALETTE4D_INLINE Lanes<T> max(Lanes<T> a, Lanes<T> b) {                                    \
        return {PALETTE4D_X86(max_##suffix)(a.v, b.v)};                                        \
    }
PALETTE4D_FUNCTIONS(float, ps)
PALETTE4D_FUNCTIONS(double, pd)
#undef PALETTE4D_FUNCTIONS
/// In each four lanes: i and j of a, k and l of b.
template <int i, int j, int k, int l>
PALETTE4D_INLINE Lanes<float> shuffled(Lanes<float> a, Lanes<float> b) {
    return {PALETTE4D_X86(shuffle_ps)(a.v, b.v, i | j << 2 | k << 4 | l << 6)};
}
/// Four values each from places[0], places[4], ... on.
PALETTE4D_INLINE Lanes<float> load_fours(const float* from, const int* places) {
    const auto four = [&](int i) { return _mm_loadu_ps(from + static_cast<unsigned>(places[i])); };
#if PALETTE4D_LANES_BYTES == 16
    return {four(0)};
#elif PALETTE4D_LANES_BYTES == 32
    return {_mm256_insertf128_ps(_mm256_castps128_ps256(four(0)), four(4), 1)};
#else
    __m512 found = _mm512_castps128_ps512(four(0));
    found = _mm512_insertf32x4(found, four(4), 1);
    found = _mm512_insertf32x4(found, four(8), 2);
    return {_mm512_insertf32x4(found, four(12), 3)};
#endif
}
template <class T>
PALETTE4D_INLINE bool any(LaneMask<T> m) {
#if PALETTE4D_LANES_BYTES == 16
    return _mm_movemask_epi8((__m128i)m.v) != 0;
#elif PALETTE4D_LANES_BYTES == 32
    return _mm256_movemask_ps((__m256)m.v) != 0;
#else
    return _mm512_test_epi32_mask((__m512i)m.v, (__m512i)m.v) != 0;
#endif
}
/// One bit per lane, the first lane lowest.
PALETTE4D_INLINE unsigned bits(LaneMask<double> m) {
#if PALETTE4D_LANES_BYTES == 16
    return static_cast<unsigned>(_mm_movemask_pd((__m128d)m.v));
#elif PALETTE4D_LANES_BYTES == 32
    return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m.v));
#else
    return _mm512_movepi64_mask((__m512i)m.v);
#endif
}
#undef PALETTE4D_X86

#else

template <class T>
PALETTE4D_INLINE Lanes<T> sqrt(Lanes<T> a) {
    Lanes<T> r;
    for (int lane = 0; lane < Lanes<T>::kCount; ++lane) r.v[lane] = std::sqrt(a.v[lane]);
    return r;
}
template <class T>
PALETTE4D_INLINE Lanes<T> min(Lanes<T> a, Lanes<T> b) {
    return select(a < b, a, b);
}
template <class T>
PALETTE4D_INLINE Lanes<T> max(Lanes<T> a, Lanes<T> b) {
    return select(a > b, a, b);
}
template <int i, int j, int k, int l>
PALETTE4D_INLINE Lanes<float> shuffled(Lanes<float> a, Lanes<float> b) {
    return {Lanes<float>::Vector{a.v[i], a.v[j], b.v[k], b.v[l]}};
}
PALETTE4D_INLINE Lanes<float> load_fours(const float* from, const int* places) {
    return load(from + places[0]);
}
template <class T>
PALETTE4D_INLINE bool any(LaneMask<T> m) {
    bool found = false;
    for (int lane = 0; lane < Lanes<T>::kCount; ++lane) found |= m.v[lane] != 0;
    return found;
}
/// One bit per lane, the first lane lowest.
PALETTE4D_INLINE unsigned bits(LaneMask<double> m) {
    unsigned found = 0;
    for (int lane = 0; lane < Lanes<double>::kCount; ++lane) {
        found |= static_cast<unsigned>(m.v[lane] != 0) << lane;
    }
    return found;
}

#endif

}  // namespace
