#include "frame_setup.hpp"

#include <cmath>
#include <exception>
#include <new>
#include <tuple>
#include <utility>

#include "convert/colour_spaces.hpp"
#include "handle_params.hpp"
#include "host_time.hpp"
#include "model/handles.hpp"
#include "output_params.hpp"
#include "palette4d_command.hpp"
#include "params.hpp"
#include "sidecar_cache.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {

namespace {

/// Appends a note for the user.
void add_note(FrameSetup& setup, const std::string& note) {
    if (!setup.note.empty() && !note.empty()) setup.note += "; ";
    setup.note += note;
}

/// The index of the pick p<number>, or -1.
int pick_at(const Sidecar& sidecar, int number) {
    const std::vector<Pick>& picks = sidecar.edits.picks;
    const std::string id = "p" + std::to_string(number);
    for (std::size_t i = 0; i < picks.size(); ++i) {
        if (picks[i].id == id) return static_cast<int>(i);
    }
    return -1;
}

/// "one of p1, p2"
std::string ids_of(const std::vector<Pick>& picks) {
    if (picks.empty()) return "a sidecar with picks";
    std::string ids;
    for (const Pick& pick : picks) ids += (ids.empty() ? "one of " : ", ") + pick.id;
    return ids;
}

/// Prepares the chosen output. Throws what slicing throws.
void prepare(FrameSetup& setup, const Params& params, const OutputSettings& settings,
             LoadedSidecar& loaded, double frame, OfxTime time) {
    Drawing& drawing = setup.drawing;
    drawing.options = settings;
    const Sidecar& sidecar = loaded.sidecar();
    setup.passes = false;
    if (sidecar.conversion && !settings.in_palette_space) {
        // Shares ownership: the sidecar may be reloaded during the render.
        drawing.conversion = {sidecar.conversion, &sidecar.conversion->steps};
    } else if (settings.scene_linear) {
        drawing.conversion = linear_picture(params, sidecar, time);
        if (!drawing.conversion) {
            setup.passes = true;
            setup.problem = "Input colour space: found a palette in '" + sidecar.clip.encoding +
                            "', expected sRGB, Rec.709 or another display encoding; choose Input "
                            "space and give the node its picture in that encoding";
            return;
        }
        if (drawing.conversion->identity()) drawing.conversion = nullptr;
    }
    if (settings.output == Output::kOutside) {
        drawing.reader = loaded.surface_at(frame);
        return;
    }
    if (settings.output == Output::kWeight) {
        const int handle = handle_at(params, sidecar, settings.weight_of, time);
        if (handle < 0) {
            setup.passes = true;
            setup.problem = "Weight of a handle: the sidecar has no handle " +
                            std::to_string(settings.weight_of) + ", expected one of its " +
                            std::to_string(handles_of(sidecar.polytope, sidecar.edits).size()) +
                            "; choose another number as Handle";
            return;
        }
        drawing.reader = loaded.weight_at(frame, handle);
        return;
    }
    if (settings.output == Output::kPick) {
        const int pick = pick_at(sidecar, settings.pick);
        if (pick < 0) {
            setup.passes = true;
            setup.problem = "Matte of a pick: the sidecar has no pick p" +
                            std::to_string(settings.pick) + ", expected " +
                            ids_of(sidecar.edits.picks) + "; choose another number as Pick";
            return;
        }
        drawing.reader = loaded.pick_at(frame, pick);
        return;
    }
    EditsAt edits = edits_at(params, sidecar, time);
    add_note(setup, edits.note);
    const std::shared_ptr<const Recolourer> edit = loaded.recolourer_at(frame, edits.edits);
    if (edit->moves() && settings.strength != 0) {
        drawing.edit = edit;
    }
    if (settings.output == Output::kPalette) {
        std::tie(drawing.original, drawing.edited) = loaded.palette_at(frame, edits.edits);
    } else {
        setup.passes = !drawing.edit;
    }
}

}  // namespace

FrameSetup frame_setup_at(const Suites& suites, OfxImageEffectHandle effect, OfxTime time,
                          std::optional<double> source_frame) {
    FrameSetup setup;
    const Params params(suites, effect);
    const Chosen chosen = chosen_sidecar(params);
    if (!chosen.any) return setup;
    const SidecarResult& result = chosen.result;
    const std::string& path = chosen.path;
    if (!result.loaded) {
        const AnalysisState analysis = analysis_state(path);
        setup.problem = analysis.words.empty() ? result.problem : analysis.words;
        return setup;
    }
    setup.note = chosen.broken;
    OutputSettings settings = output_settings_at(params, time);
    if (settings.passes()) return setup;
    const Sidecar& sidecar = result.loaded->sidecar();
    if (settings.keep > 0 && settings.own_lightness) {
        settings.lightness = luminance_weights(encoding_of(sidecar, settings.in_palette_space));
    }
    const FrameAt at = frame_at(sidecar.clip, time_settings_at(params, time),
                                host_clip(suites, effect, source_frame), time);
    if (!std::isfinite(at.frame)) {
        setup.problem = path +
                        ": found no frame: the host's time or a parameter in Time is not a finite "
                        "number; check these parameters";
        return setup;
    }
    if (at.passes) return setup;
    try {
        prepare(setup, params, settings, *result.loaded, at.frame, time);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        setup.passes = true;
        setup.problem = path + ": " + words_of(time, at) + ": " + error.what();
    }
    return setup;
}

}  // namespace palette4d::node
