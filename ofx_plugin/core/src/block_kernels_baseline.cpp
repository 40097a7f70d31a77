// The kernels for what every processor of the architecture has (SSE2 on x86-64, NEON on 64-bit
// ARM).
#include "block_kernels.hpp"

#if defined(__GNUC__)

#define PALETTE4D_LANES_BYTES 16
#include "lanes.hpp"
//
#include "block_kernels.inl"
#include "loss_kernels.inl"
//
#include "lattice_kernels.inl"

PALETTE4D_KERNEL_SET

namespace palette4d {
const KernelSet* baseline_kernels() { return &kKernels; }
}  // namespace palette4d

#else

namespace palette4d {
const KernelSet* baseline_kernels() { return nullptr; }
}  // namespace palette4d

#endif
