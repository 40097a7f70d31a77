// The one rule for the names of sidecars: which sidecar belongs to a media file.
#pragma once

#include <cstddef>
#include <string>

namespace palette4d {

/// What follows a clip's name in the name of its sidecar.
inline constexpr const char* kSidecarEnding = ".p4d.json";

/// Whether a file's name, in UTF-8 and without folders, has the extension of an image.
bool is_still(const std::string& file_name);

/// Where the frame number at the end of a name without extension begins, or its mark: 1001, -0003,
/// ####, @@@@, %04d, $F4, 1001-1100#, [1001-1100]; npos without one. A minus is a sign at the start
/// and after another separator: "sh010-0010" is frame 10. The 2 of "plate_v2" is a version, not a
/// frame.
std::size_t number_start(const std::string& stem);

/// A media file's name without its extension and, for an image, without its frame number:
/// `shot.mov`, `shot.1001.exr` and `shot.####.exr` are all of `shot`.
std::string clip_name(const std::string& file_name);

/// The longest name of a shot or a series, in bytes: with frame number and extensions it fits any
/// disk.
inline constexpr std::size_t kLongestName = 120;

/// A name (UTF-8) that is safe in files and in OpenColorIO. Letters of all languages, digits and
/// . _ - stay. Each run of other ASCII characters, spaces and invisible characters becomes _.
std::string file_safe(const std::string& name, std::size_t longest = kLongestName);

}  // namespace palette4d
