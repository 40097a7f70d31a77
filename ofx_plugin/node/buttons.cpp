#include "buttons.hpp"

#include <filesystem>

#include "palette4d_command.hpp"
#include "paths.hpp"

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;

std::string text_of(const Params& params, const char* name) {
    return params.string_at(name, Params::kAnyTime).value_or("");
}

/// The clip as palette4d names it; empty if unknown. The user's choice comes first.
std::string clip_of(const Params& params, const Chosen& chosen) {
    const std::string given = expanded(meant(text_of(params, kParamClipFile)));
    if (!given.empty()) return clip_spec(given);
    if (!chosen.media.empty()) return clip_spec(chosen.media);
    const Sidecar* sidecar = chosen.sidecar();
    if (!sidecar || chosen.embedded || sidecar->clip.source.empty()) return "";
    return (native(chosen.path).parent_path() / native(sidecar->clip.source)).u8string();
}

}  // namespace

void define_buttons(ParamDefiner& define) {
    define
        .text({kParamClipFile, "Clip's file",
               "The clip that Analyse reads: a movie, or any image of a sequence. Empty: the file "
               "that the host reports (DaVinci Resolve), or that of the sidecar."},
              kOfxParamStringIsFilePath)
        .set_int(kOfxParamPropStringFilePathExists, 1);
    define
        .button({kParamAnalyse, "Analyse",
                 "Finds the clip's palette in the background and writes it to Sidecar; without a "
                 "name there, beside the clip. Status shows the progress. Push again to cancel."})
        .set_int(kOfxParamPropLayoutHint, kOfxParamPropLayoutHintNoNewLine);
    define
        .button({kParamOpenInStudio, "Open in Studio",
                 "Opens the sidecar in the window of palette4d, at this frame. The node shows "
                 "what is saved there. Without a sidecar, opens the clip."})
        .set_int(kOfxParamPropLayoutHint, kOfxParamPropLayoutHintNoNewLine);
}

std::string analysis_target(const Params& params, const Chosen& chosen) {
    const std::string given = expanded(meant(text_of(params, kParamSidecar)));
    if (given.empty() && chosen.any && !chosen.embedded) return chosen.path;
    const fs::path clip = native(clip_of(params, chosen));
    if (given.empty()) return clip.empty() ? "" : sidecar_beside(clip.u8string());
    if (chosen.result.loaded && !chosen.embedded) return chosen.path;
    const fs::path path = native(given);
    return path.is_absolute() || clip.empty() ? given : (clip.parent_path() / path).u8string();
}

std::string studio_target(const Params& params, const Chosen& chosen) {
    if (chosen.embedded) return "";
    return chosen.result.loaded ? chosen.path : clip_of(params, chosen);
}

std::string push_analyse(const Params& params, Chosen& chosen) {
    const std::string target = analysis_target(params, chosen);
    if (cancel_analysis(target)) return "cancelled the analysis";
    const std::string clip = clip_of(params, chosen);
    if (clip.empty()) {
        return "Analyse: the host does not report the clip's file; choose it as Clip's file, or "
               "add the effect Palette4D Analyse, which asks the host for the frames";
    }
    const std::string problem = start_analysis(clip, target);
    if (!problem.empty()) return "Analyse: " + problem;
    // A sidecar of the clip's name is found without a path, also where the grade is copied to.
    const std::string given = text_of(params, kParamSidecar);
    const bool by_name = given.empty() && !chosen.media.empty() &&
                         text_of(params, kParamClipFile).empty() &&
                         params.int_now(kParamFindByName).value_or(1) != 0;
    if (!by_name && !native(expanded(meant(given))).is_absolute()) {
        params.set_string(kParamSidecar, target);
        chosen = chosen_sidecar(params);
    }
    return "";
}

std::string push_open_in_studio(const Params& params, const Chosen& chosen,
                                std::optional<double> frame) {
    if (chosen.embedded) {
        return "Open in Studio: only the project's copy of the sidecar is here; bring back a "
               "file that can be read first";
    }
    const std::string path = studio_target(params, chosen);
    if (path.empty()) {
        return std::string("Open in Studio: ") +
               (chosen.any ? "this sidecar cannot be opened; choose another, or the clip as "
                             "Clip's file"
                           : "choose a sidecar, or the clip as Clip's file");
    }
    const std::string problem = open_in_studio(path, chosen.result.loaded ? frame : std::nullopt);
    if (!problem.empty()) return "Open in Studio: " + problem;
    return "opening " + path + " in Studio; if no window appears, push Reload: Status says why";
}

}  // namespace palette4d::node
