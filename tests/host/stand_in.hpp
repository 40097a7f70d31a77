// A copy of the test program itself, in the place of the Python that the node's buttons start.
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

inline const char* const kFinished = R"({"finished": true})"
                                     "\n";

/// The bundle with that program, as `palette4d install-plugin` installs it.
inline std::string installed(const std::filesystem::path& program) {
    const std::filesystem::path copy = folder() / "OFX" / "Palette4D.ofx.bundle";
    std::filesystem::create_directories(copy.parent_path());
    std::filesystem::copy(std::filesystem::u8path(bundle()), copy,
                          std::filesystem::copy_options::recursive);
    std::filesystem::create_directories(copy / "Contents" / "Resources");
    std::ofstream(copy / "Contents" / "Resources" / "program") << program.u8string() << "\n";
    return copy.u8string();
}

/// A bundle whose program notes its arguments in the file `started`. As `palette4d analyze` it then
/// waits for the file `go`, which is its last event: `kFinished`, after copying box.json to the
/// sidecar, or an error. Where there is a file `fails`, it fails with that on standard error.
inline std::string installed() {
    const std::filesystem::path copy = folder() / ("python" + own_file().extension().u8string());
    std::filesystem::copy_file(own_file(), copy);
    return installed(copy);
}

}  // namespace test
