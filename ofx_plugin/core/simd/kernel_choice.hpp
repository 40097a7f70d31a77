// Selects the kernels for an instruction set.
#pragma once

#include "simd/instruction_set.hpp"

namespace palette4d {

/// The kernels of resolved(set). CMakeLists.txt defines the sets in this build.
template <class Kernels>
const Kernels& kernels_of(InstructionSet set) {
    switch (resolved(set)) {
#if defined(PALETTE4D_HAS_avx2)
        case InstructionSet::kAvx2:
            return Kernels::avx2();
#endif
#if defined(PALETTE4D_HAS_avx512)
        case InstructionSet::kAvx512:
            return Kernels::avx512();
#endif
        default:
            return Kernels::baseline();
    }
}

}  // namespace palette4d
