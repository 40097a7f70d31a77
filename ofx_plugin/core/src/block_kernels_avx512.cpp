// The kernels for AVX-512 (512 bits); compiled with -mavx512f and -mavx512vl where that is
// possible.
#include "block_kernels.hpp"

#if defined(__GNUC__) && defined(__AVX512F__)

#if !defined(__clang__)
// GCC 12's own header: _mm512_min_pd and its like start from _mm512_undefined_pd() on purpose.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#define PALETTE4D_LANES_BYTES 64
#include "lanes.hpp"
//
#include "block_kernels.inl"
#include "loss_kernels.inl"
//
#include "lattice_kernels.inl"

PALETTE4D_KERNEL_SET

namespace palette4d {
const KernelSet* avx512_kernels() { return &kKernels; }
}  // namespace palette4d

#else

namespace palette4d {
const KernelSet* avx512_kernels() { return nullptr; }
}  // namespace palette4d

#endif
