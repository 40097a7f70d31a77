#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

/// Reads bytes as a sidecar and uses it. What came of it, in few words: inputs with a new outcome
/// are worth keeping. Only what is documented is caught: anything else ends the program.
std::string outcome_of(const std::uint8_t* data, std::size_t size);
