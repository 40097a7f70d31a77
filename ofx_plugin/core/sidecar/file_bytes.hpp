// Reads files that other programs replace meanwhile, whatever they put there.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace palette4d {

/// The path as calls of the system take it: on Windows a long one gets the prefix without which
/// 260 characters are the most. Not for people to read.
std::filesystem::path reachable(const std::filesystem::path& path);

/// The bytes of a regular file, at most `most`; empty where it cannot be read. Never waits,
/// whatever the file is. Programs may replace or remove it meanwhile, also on Windows.
std::optional<std::string> bytes_of(const std::filesystem::path& file, std::size_t most);

}  // namespace palette4d
