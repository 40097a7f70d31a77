#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

/// Reads bytes as a target does, and uses what it read. What came of it, in few words: inputs with
/// a new outcome are worth keeping. Only what is documented is caught: anything else ends the
/// program.
std::string outcome_of(const std::uint8_t* data, std::size_t size);

/// Which check it was: what was expected, without its numbers and names.
inline std::string kind_of(const std::string& expected) {
    std::string kind;
    for (const char c : expected.substr(0, 24)) {
        if (c == '"') break;
        if (c < '0' || c > '9') kind += c;
    }
    return kind;
}

#if defined(PALETTE4D_LIBFUZZER)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    outcome_of(data, size);
    return 0;
}
#endif
