// The instruction set for recolouring, chosen at run time.
#pragma once

#include <vector>

namespace palette4d {

/// All sets give the same bits for the same colour: the same IEEE 754 operations in the same order,
/// none fused. They differ in speed only.
enum class InstructionSet {
    kBest,      ///< the fastest that this processor has
    kBaseline,  ///< what the architecture guarantees: SSE2 on x86-64, NEON on 64-bit ARM
    kAvx2,
    kAvx512,
};

/// The sets in this build that this processor supports, slowest first; never kBest.
const std::vector<InstructionSet>& instruction_sets();
/// "best", "baseline", "avx2", "avx512".
const char* name_of(InstructionSet set);
/// The set itself. kBest gives the last of instruction_sets(), or the one in the environment
/// variable PALETTE4D_INSTRUCTIONS (read once). Throws std::invalid_argument for a set that this
/// processor does not support.
InstructionSet resolved(InstructionSet set);

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
