// The kernels for AVX2 (256 bits); compiled with -mavx2 where CMakeLists.txt finds it possible.
#include "block_kernels.hpp"

#if defined(__GNUC__) && defined(__AVX2__)

#define PALETTE4D_LANES_BYTES 32
#include "lanes.hpp"
//
#include "block_kernels.inl"
#include "loss_kernels.inl"
//
#include "lattice_kernels.inl"

PALETTE4D_KERNEL_SET

namespace palette4d {
const KernelSet* avx2_kernels() { return &kKernels; }
}  // namespace palette4d

#else

namespace palette4d {
const KernelSet* avx2_kernels() { return nullptr; }
}  // namespace palette4d

#endif
