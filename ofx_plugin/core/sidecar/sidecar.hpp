// Reads, fully validates and writes sidecars.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "model/edits.hpp"
#include "model/polytope.hpp"
#include "model/sidecar_error.hpp"

namespace palette4d {

struct ClipInfo {
    std::string name;
    std::string source;
    std::int64_t first = 0, last = 0, step = 1;  ///< frame numbers; step divides last - first
    std::int64_t rate_num = 24, rate_den = 1;    ///< frames per second
    std::int64_t width = 0, height = 0;
    std::string encoding;  ///< of all palette colours
};

/// From the clip's code values to the palette's.
struct ClipConversion {
    std::string input_space;  ///< the encoding of the clip's files, by its name in the config
    std::string config;       ///< the OpenColorIO config of both names
    double error = 0;         ///< largest measured difference from OpenColorIO
    ColourConversion steps;
};

/// How an edit plays the shot, in the node's parameters: the member "extra.edit", which the
/// analysis of an edit writes. Speed 0 is a freeze frame.
struct PlayInEdit {
    double speed = 1, in_point = 0;
    bool reverse = false;
};

/// Edits that the user keeps under a name.
struct NamedVersion {
    std::string name;
    Edits edits;
};

/// What all picks of a file share.
struct PickMattes {
    struct Grid {
        std::string text;
        std::shared_ptr<const Matte> matte;
    };
    std::unordered_map<std::string, Grid> grids;  ///< by their ids
    std::shared_ptr<const DisplayCurve> display;
};

struct Sidecar {
    ClipInfo clip;
    Polytope polytope;
    Edits edits;  ///< the active ones
    std::vector<NamedVersion> versions;
    PickMattes mattes;
    /// Null where the palette is in the clip's own code values.
    std::shared_ptr<const ClipConversion> conversion;
    /// Where an edit plays the shot at another speed than the media's.
    std::optional<PlayInEdit> play;
};

inline constexpr int kSidecarVersion = 2;
inline constexpr std::uint64_t kMaxSidecarBytes = 64u << 20;

/// Reads and validates a file (UTF-8 path). Throws SidecarError; checks every count and index.
Sidecar read_sidecar(const std::string& path);
/// The same for text in memory; `name` replaces the file name in errors.
Sidecar parse_sidecar(const std::string& text, const std::string& name);
/// Parses only the member "steps" of a sidecar's conversion.
ColourConversion parse_conversion(const std::string& text, const std::string& name);

}  // namespace palette4d
