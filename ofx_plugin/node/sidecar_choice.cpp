#include "sidecar_choice.hpp"

#include <cstdlib>
#include <utility>

#include "buttons.hpp"
#include "paths.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {
namespace {

bool differs(const Params& params, const char* name, const std::string& text) {
    const auto now = params.string_now(name);
    return now && *now != text;
}

/// Sets one of the hidden parameters, which have no undo.
void note_text(const Params& params, const char* name, const std::string& text) {
    if (differs(params, name, text)) params.note_string(name, text);
}

/// A host caches frames by parameter values, so the revision names the content or the failure. A
/// counter makes each value unique: the host may hold a frame cached under the old value after the
/// file changed.
void note_revision(const Params& params, const Chosen& chosen, bool reloaded) {
    const std::string before = params.string_now(kParamRevision).value_or("");
    const std::size_t sign = before.find('#');
    std::string state;
    if (chosen.result.loaded) {
        state = chosen.result.loaded->revision();
    } else if (chosen.any) {
        state = "failed-" + revision_of(chosen.result.problem);
    }
    if (!reloaded && state == before.substr(0, sign)) return;
    const long count =
        sign == std::string::npos ? 0 : std::strtol(before.c_str() + sign + 1, nullptr, 10);
    note_text(params, kParamRevision, state + "#" + std::to_string(count + 1));
}

/// The sidecar with the clip's name, or the project's copy if that has the name too. A node pasted
/// to another clip still has the first clip's copy.
void find_by_name(Chosen& chosen, const std::string& folder, const std::string& copy) {
    if (const auto found = find_beside(chosen.media, folder)) {
        chosen.any = true;
        chosen.path = *found;
        chosen.result = load_sidecar(chosen.path);
        if (chosen.result.loaded) return;
    }
    if (copy.empty()) return;
    SidecarResult kept = load_sidecar_text(copy, chosen.media + " (the project's copy)");
    if (!kept.loaded || !same_clip(chosen.media, kept.loaded->sidecar().clip.source)) return;
    chosen.any = chosen.embedded = true;
    chosen.broken = std::move(chosen.result.problem);
    chosen.path = chosen.media;
    chosen.result = std::move(kept);
}

/// Goes over to the version that the user chose.
void choose_version(Chosen& chosen, const std::string& name) {
    if (name.empty() || !chosen.result.loaded) return;
    std::shared_ptr<LoadedSidecar> version = chosen.result.loaded->version(name);
    if (!version) {
        std::string names;
        for (const NamedVersion& one : chosen.sidecar()->versions) {
            names += (names.empty() ? "'" : ", '") + one.name + "'";
        }
        chosen.result.problem = chosen.path + ": found no version '" + name + "', expected " +
                                (names.empty() ? "none, since this sidecar has no versions"
                                               : "nothing or one of " + names) +
                                "; change Version";
    }
    chosen.result.loaded = std::move(version);
    chosen.version = name;
}

Chosen chosen_file(const Params& params) {
    const auto text = [&](const char* name) {
        return params.string_at(name, Params::kAnyTime).value_or("");
    };
    Chosen chosen;
    const std::string given = text(kParamSidecar), copy = text(kParamEmbedded);
    const std::string folder = text(kParamClipFolder);
    chosen.media = params.media();
    for (const std::string* path :
         {&given, &folder, static_cast<const std::string*>(&chosen.media)}) {
        if (path->size() <= kLongestPath) continue;
        chosen.any = true;
        chosen.result.problem = "found a path of " + std::to_string(path->size()) +
                                " bytes in this node, expected at most " +
                                std::to_string(kLongestPath) + "; choose the file again";
        return chosen;
    }
    if (given.empty()) {
        const int by_name = params.int_at(kParamFindByName, Params::kAnyTime).value_or(1);
        if (by_name == 0 || chosen.media.empty()) return chosen;
        find_by_name(chosen, folder, copy);
        return chosen;
    }
    chosen.any = true;
    const auto found = find_file(given, folder);
    if (found) {
        chosen.path = *found;
        chosen.result = load_sidecar(chosen.path);
        if (chosen.result.loaded) return chosen;
    }
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
    // Loads it anyway, for its error message.
    chosen.path = expanded(meant(given));
    chosen.result = load_sidecar(chosen.path);
    const std::string missing = words_of_missing(given);
    if (!chosen.result.loaded && !missing.empty()) {
        chosen.result.problem = chosen.path + ": " + missing;
    }
    return chosen;
}

}  // namespace

void define_file_params(ParamDefiner& define) {
    define
        .text({kParamSidecar, "Sidecar",
               "The file that 'palette4d analyze' wrote for the clip: its palette and the edits. "
               "The path may start with ~ and contain environment variables. The node reloads the "
               "file whenever it changes."},
              kOfxParamStringIsFilePath)
        .set_int(kOfxParamPropStringFilePathExists, 1);
    define.text({kParamVersion, "Version",
                 "The name of a version that 'palette4d edit' saved in the sidecar. Empty: the "
                 "sidecar's active edits."},
                kOfxParamStringIsSingleLine);
    define
        .text({kParamClipFolder, "Clip's folder",
               "A relative path of the sidecar starts here. A sidecar that is not where its path "
               "says is searched here by its name. The node fills this in when you choose a "
               "sidecar whose clip it finds."},
              kOfxParamStringIsDirectoryPath)
        .set_int(kOfxParamPropStringFilePathExists, 0);
    define.flag({kParamFindByName, "Find by clip's name",
                 "While Sidecar is empty, the node uses the sidecar that has the clip's name: for "
                 "shot.mov it searches shot.p4d.json beside the clip, in Clip's folder and in "
                 "PALETTE4D_PATH. Works in hosts that report the clip's file: DaVinci Resolve."},
                true);
    define_buttons(define);
    define.button({kParamReload, "Reload",
                   "Reloads the sidecar's file and makes the host render its frames again."});
    define.flag({kParamEmbed, "Embed",
                 "Keeps a copy of the sidecar in the project. The node uses the copy while the "
                 "file is missing or cannot be read."},
                false);
    for (const char* name : {kParamEmbedded, kParamRevision}) {
        const Properties hidden = define.text(
            {name, name == kParamEmbedded ? "Embedded sidecar" : "Revision",
             "The node sets this value."},
            name == kParamEmbedded ? kOfxParamStringIsMultiLine : kOfxParamStringIsSingleLine);
        hidden.set_int(kOfxParamPropSecret, 1);
        hidden.set_int(kOfxParamPropCanUndo, 0);
    }
}

Chosen chosen_sidecar(const Params& params) {
    Chosen chosen = chosen_file(params);
    choose_version(chosen, params.string_at(kParamVersion, Params::kAnyTime).value_or(""));
    return chosen;
}

std::string keep_files(const Params& params, Chosen& chosen, const std::string& param) {
    if (param == kParamReload) {
        purge_sidecars();
        chosen = chosen_sidecar(params);
    }
    note_revision(params, chosen, param == kParamReload);
    const LoadedSidecar* loaded = chosen.result.loaded.get();
    if (loaded && !chosen.embedded && param == kParamSidecar) {
        const std::string folder = clip_folder(chosen.path, loaded->sidecar().clip.source);
        if (!folder.empty() && differs(params, kParamClipFolder, folder)) {
            params.set_string(kParamClipFolder, folder);
        }
    }
    if (params.int_now(kParamEmbed).value_or(0) == 0) {
        note_text(params, kParamEmbedded, "");
        if (chosen.embedded) {
            chosen = chosen_sidecar(params);
            note_revision(params, chosen, false);
        }
        return "";
    }
    if (chosen.embedded) {
        return "the project's copy, because " +
               (chosen.broken.empty() ? "there is no file" : chosen.broken);
    }
    if (!loaded) return "";
    // What was loaded, not what a program writes there now.
    const std::optional<std::string> file = sidecar_text(chosen.path);
    if (!file || revision_of(*file) != loaded->revision()) return "";
    note_text(params, kParamEmbedded, *file);
    return params.string_now(kParamEmbedded) == file
               ? "a copy is in the project"
               : "the host did not store a copy in the project";
}

}  // namespace palette4d::node
