// The parameters that select the sidecar, and the project's copy of it.
#pragma once

#include <string>

#include "param_define.hpp"
#include "params.hpp"
#include "sidecar_cache.hpp"

namespace palette4d::node {

inline constexpr const char* kParamVersion = "version";
inline constexpr const char* kParamClipFolder = "clipFolder";
inline constexpr const char* kParamFindByName = "findByName";
inline constexpr const char* kParamReload = "reload";
inline constexpr const char* kParamEmbed = "embed";
inline constexpr const char* kParamEmbedded = "embedded";
inline constexpr const char* kParamRevision = "revision";

void define_file_params(ParamDefiner& define);

struct Chosen {
    bool any = false;  ///< the user chose a sidecar, or the clip's name found one
    SidecarResult result;
    std::string version;    ///< the version that is used; empty: the active edits
    std::string path;       ///< where it is, or where it was expected
    bool embedded = false;  ///< the project's copy is used, since the file cannot be read
    std::string broken;     ///< what is wrong with the file, if there is one
    std::string media;      ///< the clip's file, in hosts that report it

    /// Null when there is none, when it cannot be read, or when it lacks the version.
    const Sidecar* sidecar() const { return result.loaded ? &result.loaded->sidecar() : nullptr; }
};
/// The sidecar and the version of its edits that the parameters select, in any action.
Chosen chosen_sidecar(const Params& params);

/// For instance changes only. Updates the project's copy, the clip's folder and the revision, whose
/// change tells the host to discard cached frames. `param` is what the user changed. Returns the
/// status line about the copy. Replaces `chosen` when that copy was removed or the user reloads.
std::string keep_files(const Params& params, Chosen& chosen, const std::string& param);

}  // namespace palette4d::node
