// From an instruction set to its kernels.
#pragma once

#include "block_kernels.hpp"
#include "palette4d/instruction_set.hpp"

namespace palette4d {

/// The kernels of resolved(set).
const KernelSet& kernels_of(InstructionSet set);

}  // namespace palette4d
