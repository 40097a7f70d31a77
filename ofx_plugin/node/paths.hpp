// Finds sidecar files. Depends on the core's rule for their names only, not on OpenFX.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "sidecar/file_bytes.hpp"

namespace palette4d::node {

/// Folders in which the node searches sidecars, separated as in PATH.
inline constexpr const char* kSearchPath = "PALETTE4D_PATH";
/// The longest path in a project, in bytes: eight times what Linux allows. Longer ones are no
/// paths.
inline constexpr std::size_t kLongestPath = 32768;

/// The path that a host gives in UTF-8. On Windows bytes that are no UTF-8 become U+FFFD.
std::filesystem::path native(const std::string& utf8);

/// The path (UTF-8) with a leading ~ and $NAME, ${NAME} and %NAME% replaced from the environment.
/// Unknown names stay as they are.
std::string expanded(const std::string& path);

/// The file for a path: the file itself; a relative path is searched in `folder`, PALETTE4D_PATH
/// and the working folder. Else a file with its name in `folder` or PALETTE4D_PATH. Accepts pasted
/// paths, with blanks, quotes or as a file:// URL, and a project folder that the host prefixed.
/// `folder` is expanded too and may be empty. Empty when there is no such file.
std::optional<std::string> find_file(const std::string& path, const std::string& folder);

/// The path as find_file() reads it, without blanks, quotes and prefixes.
std::string meant(const std::string& path);

/// The sidecar of a media file by its name: `shot.mov` and `shot.1001.exr` have `shot.p4d.json`.
/// Searched beside the media, in `folder` and in PALETTE4D_PATH. Empty when there is none.
std::optional<std::string> find_beside(const std::string& media, const std::string& folder);

/// Where the sidecar of a clip's name belongs: beside the clip.
std::string sidecar_beside(const std::string& clip);

/// A media file as palette4d names clips: the number of a still (or a range, `[1-9]`) becomes one #
/// for each digit.
std::string clip_spec(const std::string& media);

/// The number of a sequence's first frame, from that frame's path or a range (`[1-9]`); empty for a
/// movie.
std::optional<double> first_number(const std::string& media);

/// Whether a media file and a sidecar's clip have the same name, apart from frame numbers and
/// extensions.
bool same_clip(const std::string& media, const std::string& source);

/// Why find_file() found nothing, and what to do; empty where the path exists but is not a file.
std::string words_of_missing(const std::string& path);

/// The folder of a sidecar's source clip; empty where there is none.
std::string clip_folder(const std::string& path, const std::string& source);

}  // namespace palette4d::node
