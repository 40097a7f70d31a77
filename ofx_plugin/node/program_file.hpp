// The file in the bundle that says which Python runs palette4d; `palette4d install-plugin` writes
// it. Depends neither on OpenFX nor on the core.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace palette4d::node {

inline constexpr std::size_t kMaxProgramBytes = 4096;

/// An absolute path (UTF-8), or a sentence that says why there is none.
struct ProgramPath {
    std::string path;
    std::string problem;
};

/// The path in the file's text, which is one line. Accepts any bytes; does not look at the disk.
ProgramPath parse_program(const std::string& text);

/// Reads the file. It must be a regular file of the user or of root, not writable for all, of at
/// most kMaxProgramBytes; its path must be an executable file. Only the user and root may change
/// the program and the folders on the way to it. Never waits, whatever the file is.
ProgramPath read_program(const std::filesystem::path& file);

}  // namespace palette4d::node
