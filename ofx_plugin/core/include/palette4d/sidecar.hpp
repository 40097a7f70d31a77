// The sidecar file: reading and full validation. The only writer is Python's analysis/sidecar.py.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "palette4d/colour_conversion.hpp"
#include "palette4d/edits.hpp"
#include "palette4d/polytope.hpp"

namespace palette4d {

/// Raised for every unusable sidecar. what() is "FILE: POINTER: found X, expected Y".
class SidecarError : public std::runtime_error {
public:
    SidecarError(std::string file, std::string pointer, std::string found, std::string expected);
    const std::string& file() const { return file_; }
    const std::string& pointer() const { return pointer_; }  ///< JSON pointer (RFC 6901)
    const std::string& found() const { return found_; }
    const std::string& expected() const { return expected_; }

private:
    std::string file_, pointer_, found_, expected_;
};

struct ClipInfo {
    std::string name;
    std::string source;
    std::int64_t first = 0, last = 0, step = 1;  ///< frame numbers, last - first divisible by step
    std::int64_t rate_num = 24, rate_den = 1;    ///< frames per second
    std::int64_t width = 0, height = 0;
    std::string encoding;  ///< of every colour of the palette
};

/// How the clip's numbers become those of the palette (version 2).
struct ClipConversion {
    std::string input_space;  ///< of the clip's files, the name that the config has for it
    std::string config;       ///< the OpenColorIO config that both names are of
    double error = 0;         ///< the largest difference that was measured from OpenColorIO
    ColourConversion steps;
};

struct Sidecar {
    int version = 0;
    ClipInfo clip;
    Polytope polytope;
    Edits edits;
    /// Null where the palette is in the clip's own numbers.
    std::shared_ptr<const ClipConversion> conversion;
};

inline constexpr int kSidecarVersion = 2;
inline constexpr std::uint64_t kMaxSidecarBytes = 64u << 20;

/// Reads and validates a file (UTF-8 path). Throws SidecarError; never trusts a count or an index.
Sidecar read_sidecar(const std::string& path);
/// The same for text already in memory; `name` stands in for the file in errors.
Sidecar parse_sidecar(const std::string& text, const std::string& name);
/// The member "steps" of a sidecar's conversion alone.
ColourConversion parse_conversion(const std::string& text, const std::string& name);

}  // namespace palette4d
