// The parameters that say which sidecar, and the copy that a project carries.
#pragma once

#include <optional>
#include <string>

#include "param_define.hpp"
#include "params.hpp"
#include "sidecar_cache.hpp"

namespace palette4d::node {

inline constexpr const char* kParamClipFolder = "clipFolder";
inline constexpr const char* kParamFindByName = "findByName";
inline constexpr const char* kParamReload = "reload";
inline constexpr const char* kParamEmbed = "embed";
inline constexpr const char* kParamEmbedded = "embedded";
inline constexpr const char* kParamRevision = "revision";

void define_file_params(ParamDefiner& define);

struct Chosen {
    bool any = false;  ///< a sidecar was asked for, or found by the clip's name
    SidecarResult result;
    std::string path;       ///< where it was found, or where it was expected
    bool embedded = false;  ///< it is the project's copy, since there is no file that can be read
    std::string broken;     ///< what is wrong with that file, where there is one
    std::string media;      ///< the clip's file, in a host that tells it

    /// Null where there is none, or none that can be read.
    const Sidecar* sidecar() const { return result.loaded ? &result.loaded->sidecar() : nullptr; }
};
/// The sidecar that the parameters name; with a time in the way that is allowed while rendering.
Chosen chosen_sidecar(const Params& params, std::optional<OfxTime> time);

/// For instance changes only: keeps the project's copy and the clip's folder up to date, and the
/// revision, by which a host knows that the frames in its cache are old. `param` is what the user
/// changed. Returns what the status says of the copy; replaces `chosen` where that copy has gone,
/// and where the user reloads.
std::string keep_files(const Params& params, Chosen& chosen, const std::string& param);

}  // namespace palette4d::node
