#include "sidecar_choice.hpp"

#include <utility>

#include "paths.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {
namespace {

bool differs(const Params& params, const char* name, const std::string& text) {
    const auto now = params.string_now(name);
    return now && *now != text;
}

/// For the hidden ones, which cannot be undone.
void note_text(const Params& params, const char* name, const std::string& text) {
    if (differs(params, name, text)) params.note_string(name, text);
}

}  // namespace

void define_file_params(ParamDefiner& define) {
    define
        .text({kParamSidecar, "Sidecar",
               "The file that 'palette4d analyze' made of the clip: its palette and the edits of "
               "it. The path may begin with ~ and name environment variables. The file is read "
               "again whenever it changes."},
              kOfxParamStringIsFilePath)
        .set_int(kOfxParamPropStringFilePathExists, 1);
    define
        .text({kParamClipFolder, "Clip's folder",
               "The folder that a relative path of the sidecar starts from, and in which one that "
               "is not where its path says is looked for by its name. Filled in when a sidecar is "
               "chosen, where its clip is found."},
              kOfxParamStringIsDirectoryPath)
        .set_int(kOfxParamPropStringFilePathExists, 0);
    define.button({kParamReload, "Reload", "Looks at the sidecar's file again, now."});
    define.flag({kParamEmbed, "Embed",
                 "Keeps a copy of the sidecar in the project, for use where there is no file, or "
                 "one that cannot be read."},
                false);
    for (const char* name : {kParamEmbedded, kParamRevision}) {
        const Properties hidden = define.text(
            {name, name == kParamEmbedded ? "Embedded sidecar" : "Revision", "Kept by the node."},
            name == kParamEmbedded ? kOfxParamStringIsMultiLine : kOfxParamStringIsSingleLine);
        hidden.set_int(kOfxParamPropSecret, 1);
        hidden.set_int(kOfxParamPropCanUndo, 0);
    }
}

Chosen chosen_sidecar(const Params& params, std::optional<OfxTime> time) {
    const auto text = [&](const char* name) {
        return (time ? params.string_at(name, *time) : params.string_now(name)).value_or("");
    };
    Chosen chosen;
    const std::string given = text(kParamSidecar);
    chosen.any = !given.empty();
    if (!chosen.any) return chosen;
    const auto found = find_file(given, text(kParamClipFolder));
    if (found) {
        chosen.path = *found;
        chosen.result = load_sidecar(chosen.path);
        if (chosen.result.loaded) return chosen;
    }
    const std::string copy = text(kParamEmbedded);
    if (!copy.empty()) {
        SidecarResult kept = load_sidecar_text(copy, given + " (the project's copy)");
        if (kept.loaded || !found) {
            chosen.embedded = true;
            chosen.broken = std::move(chosen.result.problem);
            chosen.path = given;
            chosen.result = std::move(kept);
            return chosen;
        }
    }
    if (found) return chosen;
    // It says what is wrong.
    chosen.path = expanded(given);
    chosen.result = load_sidecar(chosen.path);
    const std::string missing = words_of_missing(given);
    if (!chosen.result.loaded && !missing.empty()) {
        chosen.result.problem = chosen.path + ": " + missing;
    }
    return chosen;
}

std::string keep_files(const Params& params, Chosen& chosen, const std::string& param) {
    const LoadedSidecar* loaded = chosen.result.loaded.get();
    if (loaded) note_text(params, kParamRevision, loaded->revision());
    if (loaded && !chosen.embedded && param == kParamSidecar) {
        const std::string folder = clip_folder(chosen.path, loaded->sidecar().clip.source);
        if (!folder.empty() && differs(params, kParamClipFolder, folder)) {
            params.set_string(kParamClipFolder, folder);
        }
    }
    if (params.int_now(kParamEmbed).value_or(0) == 0) {
        note_text(params, kParamEmbedded, "");
        if (chosen.embedded) chosen = chosen_sidecar(params, std::nullopt);
        return "";
    }
    if (chosen.embedded) {
        return "the project's copy, since " +
               (chosen.broken.empty() ? "there is no file" : chosen.broken);
    }
    if (!loaded) return "";
    const std::optional<std::string> file = sidecar_text(chosen.path);
    if (!file) return "";
    note_text(params, kParamEmbedded, *file);
    return params.string_now(kParamEmbedded) == file ? "a copy is in the project"
                                                     : "the host does not keep a copy of it";
}

}  // namespace palette4d::node
