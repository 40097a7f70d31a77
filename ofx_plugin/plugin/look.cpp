#include "look.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <utility>

#include "handles.hpp"
#include "params.hpp"
#include "sidecar_cache.hpp"

namespace palette4d::plugin {

double sidecar_frame(const ClipInfo& clip, OfxTime host_time, double frame_offset) {
    return static_cast<double>(clip.first) + host_time + frame_offset;
}

Look look_at(const Suites& suites, OfxImageEffectHandle effect, OfxTime time) {
    Look look;
    const Params params(suites, effect);
    const std::string path = params.string_at(kParamSidecar, time).value_or("");
    if (path.empty()) return look;
    // Not every host keeps a parameter inside its range.
    const double strength = params.double_at(kParamStrength, time).value_or(1);
    look.strength = strength > 0 ? std::min(strength, 1.0) : 0.0;
    const double offset = params.double_at(kParamFrameOffset, time).value_or(0);

    const SidecarResult result = load_sidecar(path);
    if (!result.loaded) {
        look.problem = result.problem;
        return look;
    }
    if (look.strength == 0) return look;
    const double frame = sidecar_frame(result.loaded->sidecar().clip, time, offset);
    if (!std::isfinite(frame)) {
        look.problem = path + ": the host's time and frameOffset give no frame; expected numbers";
        return look;
    }
    try {
        EditsAt edits = edits_at(params, result.loaded->sidecar(), time);
        look.note = std::move(edits.note);
        look.recolourer = result.loaded->recolourer_at(frame, edits.edits);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        look.problem = path + ": frame " + std::to_string(frame) + ": " + error.what();
        return look;
    }
    if (look.recolourer->identity()) look.recolourer = nullptr;
    return look;
}

}  // namespace palette4d::plugin
