// A shell script in the place of the Python that the node's buttons start.
#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "harness.hpp"

namespace test {

inline std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

/// Waits for what another process does; false after ten seconds.
template <typename Done>
bool soon(Done done) {
    for (int i = 0; i < 1000; ++i) {
        if (done()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

/// A script that serves as Python; its path.
inline std::string script(const std::string& body) {
    const std::string path =
        write("python", "#!/bin/sh\ncd '" + folder().u8string() + "'\n" + body);
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    return path;
}

/// The bundle with that program, as `palette4d install-plugin` installs it.
inline std::string installed(const std::string& program) {
    const std::filesystem::path copy = folder() / "OFX" / "Palette4D.ofx.bundle";
    std::filesystem::create_directories(copy.parent_path());
    std::filesystem::copy(bundle(), copy, std::filesystem::copy_options::recursive);
    std::filesystem::create_directories(copy / "Contents" / "Resources");
    std::ofstream(copy / "Contents" / "Resources" / "program") << program << "\n";
    return copy.u8string();
}

inline constexpr const char* kRecord = "printf '%s\\n' \"$@\" > new && mv new started\n";

/// Plays `palette4d analyze`: waits for the file `go`, whose last line says how it ends.
inline const char* const kAnalyse =
    "printf '%s\\n' \"$@\" > started\n"
    "shift 5; out=$3; progress=$6\n"
    "echo 'structure search: 3 of 40' > \"$progress\"\n"
    "while [ ! -e go ]; do sleep 0.01; done\n"
    "[ \"$(cat go)\" = done ] && cp box.json \"$out\"\n"
    "cat go >> \"$progress\"\n";

}  // namespace test
