// The kernels in plain C++, for any compiler and processor.
#include "block_kernels.hpp"

#define PALETTE4D_LANES_PORTABLE
#include "lanes.hpp"
//
#include "block_kernels.inl"
#include "loss_kernels.inl"
//
#include "lattice_kernels.inl"

PALETTE4D_KERNEL_SET

namespace palette4d {
const KernelSet* portable_kernels() { return &kKernels; }
}  // namespace palette4d
