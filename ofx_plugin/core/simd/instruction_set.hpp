// The processor's instructions that recolouring uses, chosen when the program runs.
#pragma once

#include <vector>

namespace palette4d {

/// All give the same bits for the same colour: the same operations in the same order, each rounded
/// as IEEE 754 says and none fused. They differ in speed only.
enum class InstructionSet {
    kBest,      ///< the fastest that this processor has
    kBaseline,  ///< what the architecture guarantees: SSE2 on x86-64, NEON on 64-bit ARM
    kAvx2,
    kAvx512,
};

/// What this program was built with and this processor has, slowest first; never kBest.
const std::vector<InstructionSet>& instruction_sets();
/// "best", "baseline", "avx2", "avx512".
const char* name_of(InstructionSet set);
/// The set itself, or for kBest the last of instruction_sets(), unless the environment variable
/// PALETTE4D_INSTRUCTIONS names another of them (read once). Throws std::invalid_argument for a set
/// that this processor does not have.
InstructionSet resolved(InstructionSet set);

}  // namespace palette4d
