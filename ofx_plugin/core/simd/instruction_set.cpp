#include "simd/instruction_set.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace palette4d {
namespace {

/// Whether this build has the kernels and the processor has the instructions.
bool usable(InstructionSet set) {
    switch (set) {
        case InstructionSet::kBaseline:
            return true;
            // __builtin_cpu_supports also asks whether the operating system saves the registers.
#if defined(PALETTE4D_HAS_avx2)
        case InstructionSet::kAvx2:
            return __builtin_cpu_supports("avx2");
#endif
#if defined(PALETTE4D_HAS_avx512)
        case InstructionSet::kAvx512:
            return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                   __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
#endif
        default:
            return false;
    }
}

InstructionSet best() {
    const std::vector<InstructionSet>& sets = instruction_sets();
    if (const char* wanted = std::getenv("PALETTE4D_INSTRUCTIONS")) {
        for (const InstructionSet set : sets) {
            if (std::string(wanted) == name_of(set)) return set;
        }
    }
    return sets.back();
}

}  // namespace

const std::vector<InstructionSet>& instruction_sets() {
    static const std::vector<InstructionSet> sets = [] {
        std::vector<InstructionSet> found;
        for (const InstructionSet set :
             {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
            if (usable(set)) found.push_back(set);
        }
        return found;
    }();
    return sets;
}

const char* name_of(InstructionSet set) {
    static constexpr const char* kNames[] = {"best", "baseline", "avx2", "avx512"};
    return kNames[static_cast<int>(set)];
}

InstructionSet resolved(InstructionSet set) {
    if (set == InstructionSet::kBest) {
        static const InstructionSet found = best();
        return found;
    }
    const std::vector<InstructionSet>& sets = instruction_sets();
    if (std::find(sets.begin(), sets.end(), set) == sets.end()) {
        std::string names;
        for (const InstructionSet one : sets) {
            names += std::string(names.empty() ? "" : ", ") + name_of(one);
        }
        throw std::invalid_argument(std::string("instruction set ") + name_of(set) +
                                    ": this processor or build does not have it; expected one of " +
                                    names);
    }
    return set;
}

}  // namespace palette4d
