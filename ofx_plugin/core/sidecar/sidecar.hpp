// The sidecar file: reading and full validation. The only writer is Python's analysis/sidecar.py.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "convert/colour_conversion.hpp"
#include "model/edits.hpp"
#include "model/polytope.hpp"
#include "model/sidecar_error.hpp"

namespace palette4d {

struct ClipInfo {
    std::string name;
    std::string source;
    std::int64_t first = 0, last = 0, step = 1;  ///< frame numbers, last - first divisible by step
    std::int64_t rate_num = 24, rate_den = 1;    ///< frames per second
    std::int64_t width = 0, height = 0;
    std::string encoding;  ///< of every colour of the palette
};

/// From the code values of the clip to those of the palette.
struct ClipConversion {
    std::string input_space;  ///< of the clip's files, the name that the config has for it
    std::string config;       ///< the OpenColorIO config that both names are of
    double error = 0;         ///< the largest difference that was measured from OpenColorIO
    ColourConversion steps;
};

struct Sidecar {
    ClipInfo clip;
    Polytope polytope;
    Edits edits;
    /// Null where the palette is in the clip's own numbers.
    std::shared_ptr<const ClipConversion> conversion;
};

inline constexpr int kSidecarVersion = 1;
inline constexpr std::uint64_t kMaxSidecarBytes = 64u << 20;

/// Reads and validates a file (UTF-8 path). Throws SidecarError; never trusts a count or an index.
Sidecar read_sidecar(const std::string& path);
/// The same for text already in memory; `name` stands in for the file in errors.
Sidecar parse_sidecar(const std::string& text, const std::string& name);
/// The member "steps" of a sidecar's conversion alone.
ColourConversion parse_conversion(const std::string& text, const std::string& name);

}  // namespace palette4d
