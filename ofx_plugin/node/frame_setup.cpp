#include "frame_setup.hpp"

#include <cmath>
#include <exception>
#include <new>
#include <tuple>
#include <utility>

#include "colour_spaces.hpp"
#include "handle_params.hpp"
#include "host_time.hpp"
#include "model/handles.hpp"
#include "params.hpp"
#include "sidecar_cache.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {

namespace {

/// One more thing for the user to know.
void add_note(Look& look, const std::string& note) {
    if (!look.note.empty() && !note.empty()) look.note += "; ";
    look.note += note;
}

/// Prepares what the output asks for. Throws what slicing throws.
void prepare(Look& look, const Params& params, LoadedSidecar& loaded, double frame, OfxTime time,
             Interpolation interpolation) {
    Drawing& drawing = look.drawing;
    const OutputSettings& settings = drawing.settings;
    const Sidecar& sidecar = loaded.sidecar();
    look.passes = false;
    if (sidecar.conversion && !settings.in_palette_space) {
        // Shares its ownership: a sidecar may be read anew while this is drawn.
        drawing.conversion = {sidecar.conversion, &sidecar.conversion->steps};
    } else if (settings.scene_linear) {
        drawing.conversion = linear_picture(params, sidecar, time);
        if (!drawing.conversion) {
            look.passes = true;
            look.problem = "Picture is in: found a palette in '" + sidecar.clip.encoding +
                           "', expected sRGB, Rec.709 or another display encoding; choose Input "
                           "space and give the node its picture in that encoding";
            return;
        }
        if (drawing.conversion->identity()) drawing.conversion = nullptr;
    }
    if (settings.output == Output::kOutside) {
        drawing.recolourer = loaded.surface_at(frame);
        return;
    }
    if (settings.output == Output::kWeight) {
        const int handle = handle_at(params, sidecar, settings.weight_of, time);
        if (handle < 0) {
            look.passes = true;
            look.problem = "Weight of a handle: the sidecar has no handle " +
                           std::to_string(settings.weight_of) + ", expected one of its " +
                           std::to_string(handles_of(sidecar.polytope, sidecar.edits).size()) +
                           "; choose another number as Handle";
            return;
        }
        drawing.recolourer = loaded.weight_at(frame, handle);
        return;
    }
    EditsAt edits = edits_at(params, sidecar, time);
    add_note(look, edits.note);
    drawing.recolourer = loaded.recolourer_at(frame, edits.edits);
    if (drawing.recolourer->identity() || settings.strength == 0) drawing.recolourer = nullptr;
    if (drawing.recolourer &&
        (interpolation == Interpolation::kAlways ||
         (interpolation == Interpolation::kWithoutConversion && !drawing.conversion))) {
        try {
            drawing.lattice = loaded.lattice_at(frame, edits.edits);
        } catch (const std::bad_alloc&) {
            add_note(look, "there is no memory for a lattice: computed exactly");
        }
    }
    if (settings.output == Output::kPalette) {
        std::tie(drawing.original, drawing.edited) = loaded.palette_at(frame, edits.edits);
    } else {
        look.passes = !drawing.recolourer;
    }
}

}  // namespace

Look look_at(const Suites& suites, OfxImageEffectHandle effect, OfxTime time,
             Interpolation interpolation) {
    Look look;
    const Params params(suites, effect);
    const Chosen chosen = chosen_sidecar(params, time);
    if (!chosen.any) return look;
    const SidecarResult& result = chosen.result;
    const std::string& path = chosen.path;
    if (!result.loaded) {
        look.problem = result.problem;
        return look;
    }
    look.note = chosen.broken;
    look.drawing.settings = output_settings_at(params, time);
    OutputSettings& settings = look.drawing.settings;
    if (settings.passes()) return look;
    const Sidecar& sidecar = result.loaded->sidecar();
    if (settings.keep > 0 && settings.own_lightness) {
        settings.lightness = luminance_weights(encoding_of(sidecar, settings.in_palette_space));
    }
    const FrameAt at =
        frame_at(sidecar.clip, time_settings_at(params, time), host_clip(suites, effect), time);
    if (!std::isfinite(at.frame)) {
        look.problem = path +
                       ": the host's time and the node's parameters of time give no frame; "
                       "expected numbers";
        return look;
    }
    if (at.passes) return look;
    try {
        prepare(look, params, *result.loaded, at.frame, time, interpolation);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        look.passes = true;
        look.problem = path + ": " + words_of(time, at) + ": " + error.what();
    }
    return look;
}

}  // namespace palette4d::node
