// Where a sidecar is. Sees neither OpenFX nor the core.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace palette4d::node {

/// Folders in which sidecars are looked for, separated as in PATH.
inline constexpr const char* kSearchPath = "PALETTE4D_PATH";

/// The path (UTF-8) with a leading ~ and $NAME, ${NAME} and %NAME% replaced by what the environment
/// has; a name that it does not have is left as it is.
std::string expanded(const std::string& path);

/// The file that a path means: itself; a relative one in `folder`, in the folders of PALETTE4D_PATH
/// or in the working folder; else a file of its name in `folder` or in those of PALETTE4D_PATH.
/// Either may be pasted: with blanks around it, in quotes, as a file:// URL; and a host may have
/// put its project's folder before it. `folder` is expanded too and may be empty. Empty when there
/// is no such file.
std::optional<std::string> find_file(const std::string& path, const std::string& folder);

/// The path without what find_file() overlooks.
std::string meant(const std::string& path);

/// The sidecar of a media file, by its name: `shot.mov` and `shot.1001.exr` have `shot.p4d.json`,
/// beside them, in `folder` or in the folders of PALETTE4D_PATH. Empty when there is none.
std::optional<std::string> find_beside(const std::string& media, const std::string& folder);

/// The number of a sequence's first frame by the path of that frame, or of them all (`[1-9]`);
/// empty for a movie.
std::optional<double> first_number(const std::string& media);

/// Whether a media file and a clip that a sidecar names are of one name, but for frame numbers and
/// endings.
bool same_clip(const std::string& media, const std::string& source);

/// Why find_file() found nothing, and what to do; empty where something else than a file is there.
std::string words_of_missing(const std::string& path);

/// The folder of a clip, as the sidecar at `path` names its source; empty where there is none.
std::string clip_folder(const std::string& path, const std::string& source);

}  // namespace palette4d::node
