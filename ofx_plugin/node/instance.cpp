#include "instance.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "buttons.hpp"
#include "gpu/queue.hpp"
#include "handle_params.hpp"
#include "host_time.hpp"
#include "output_params.hpp"
#include "palette4d_command.hpp"
#include "params.hpp"
#include "sidecar_choice.hpp"
#include "status.hpp"

namespace palette4d::node {
namespace {

constexpr const char* kMessageId = "palette4d.sidecar";

// Instances by effect handle. The host's property kOfxPropInstanceData is no alternative: where a
// host refuses it, the record would be lost and the instance would not load.
struct Registry {
    std::mutex mutex;
    std::map<OfxImageEffectHandle, std::shared_ptr<Instance>> instances;
};

Registry& registry() {
    static Registry all;
    return all;
}

std::shared_ptr<Instance> find(OfxImageEffectHandle effect) {
    Registry& all = registry();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto found = all.instances.find(effect);
    return found == all.instances.end() ? nullptr : found->second;
}

/// Escapes the text for use as a format, since Natron misreads a format's arguments.
std::string as_format(const std::string& text) {
    std::string format;
    for (const char c : text) format += c == '%' ? "%%" : std::string(1, c);
    return format;
}

void show(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem,
          bool is_new) {
    const std::string format = as_format(without_controls(problem));
    // A host may offer version 2 of the suite with null functions.
    if (suites.message2 && suites.message2->setPersistentMessage) {
        suites.message2->setPersistentMessage(effect, kOfxMessageError, kMessageId, format.c_str());
    } else if (is_new && suites.message && suites.message->message) {
        suites.message->message(effect, kOfxMessageLog, kMessageId, format.c_str());
    } else if (is_new && suites.message2 && suites.message2->message) {
        suites.message2->message(effect, kOfxMessageLog, kMessageId, format.c_str());
    }
}

/// The host's label for the undo step of what the node sets after a change of `param`.
const char* step_after(const std::string& param) {
    if (param == kParamSidecar) return "Show the sidecar's handles";
    if (param == kParamResetHandles) return "Reset handles";
    if (param == kParamAnalyse) return "Analyse the clip";
    return param.rfind("handle", 0) == 0 ? "Use the handle" : "Follow the sidecar";
}

/// What *Status* says of a time of the host, and the sidecar's frame there.
struct ShownFrame {
    std::string words;
    std::optional<double> frame;
};

ShownFrame shown_frame(const Params& params, const Chosen& chosen, const HostClip& host,
                       OfxTime time) {
    ShownFrame shown;
    const Sidecar& sidecar = *chosen.sidecar();
    const FrameAt at = frame_at(sidecar.clip, time_settings_at(params, time), host, time);
    shown.words = words_of(time, at);
    if (!std::isfinite(at.frame)) return shown;
    shown.frame = std::clamp(at.frame, static_cast<double>(sidecar.clip.first),
                             static_cast<double>(sidecar.clip.last));
    return shown;
}

/// `pushed`: what a button did; `copy`: what became of the project's copy of the sidecar.
/// `gpu`: what drew the last picture.
void write_status(Params& params, Chosen chosen, const std::string& pushed, const std::string& copy,
                  const std::string& shown, const std::string& gpu) {
    std::string expects;
    if (const Sidecar* sidecar = chosen.sidecar()) {
        const bool in_palette_space = params.int_now(kParamPictureIn).value_or(0) == 1;
        expects = words_of_picture(*sidecar, linear_picture(params, *sidecar, 0)
                                                 ? "scene-linear light"
                                                 : encoding_of(*sidecar, in_palette_space));
    }
    const AnalysisState analysis = analysis_state(analysis_target(params, chosen));
    const std::string studio = studio_problem(studio_target(params, chosen));
    // The file that an analysis will write is not missing.
    if (analysis.running && !chosen.result.loaded) chosen.result.problem.clear();
    const std::string text = status_of(chosen, {pushed, studio, analysis.words},
                                       handles_in_use(params), {expects, copy, shown, gpu});
    if (params.string_now(kParamStatus) != text) params.note_string(kParamStatus, text);
}

}  // namespace

void create_instance(const Suites& suites, OfxImageEffectHandle effect) {
    {
        Registry& all = registry();
        const std::lock_guard<std::mutex> lock(all.mutex);
        // A host that never destroyed an instance may reuse its address, so always start fresh.
        all.instances[effect] = std::make_shared<Instance>();
    }
    const Params params(suites, effect);
    label_handles(params, chosen_sidecar(params));
}

void destroy_instance(OfxImageEffectHandle effect) {
    gpu::leave(effect);
    Registry& all = registry();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.instances.erase(effect);
}

void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args) {
    const std::string name = args.get_string(kOfxPropName).value_or("");
    const std::optional<std::string> reason = args.get_string(kOfxPropChangeReason);
    // The user cannot change the status, so the plugin itself set it.
    if (name == kParamStatus || reason == kOfxChangePluginEdited) return;
    // Hosts report the plugin's own changes from within the call, some without a reason. Without
    // this guard the updates would never end.
    thread_local bool updating = false;
    if (updating) return;
    struct Guard {
        bool& flag;
        explicit Guard(bool& f) : flag(f) { flag = true; }
        ~Guard() { flag = false; }
    } const guard(updating);
    // A colour that follows its keyframes is not an edit.
    const std::string param = reason == kOfxChangeUserEdited ? name : "";
    Params params(suites, effect);
    // Natron holds a mutex while paramEditEnd calls the plugin back, which then deadlocks.
    if (!suites.is_natron) params.one_undo_step(step_after(param));
    Chosen chosen = chosen_sidecar(params);
    std::string pushed;
    if (param == kParamReload) forget_failures();
    if (param == kParamAnalyse) pushed = push_analyse(params, chosen);
    const std::string copy = keep_files(params, chosen, param);
    // Not under the instance's lock: setting a parameter may make the host wait for a render.
    const std::shared_ptr<Instance> instance = find(effect);
    ShownHandles handles;
    std::optional<double> source_less_time;
    bool rendered = false;
    std::string gpu;
    if (instance) {
        const std::lock_guard<std::mutex> lock(instance->mutex);
        handles = instance->shown;
        rendered = instance->rendered;
        source_less_time = instance->source_less_time;
        gpu = instance->gpu;
    }
    notice_undone(params, handles);
    handle_changed(params, chosen, param, handles);
    label_handles(params, chosen);
    show_handles(params, chosen, handles);
    if (instance) {
        const std::lock_guard<std::mutex> lock(instance->mutex);
        instance->shown = handles;
    }
    // Before the first render, assume that media frame and time are equal, as on Resolve's pages.
    if (!rendered && !chosen.media.empty()) source_less_time = 0;
    ShownFrame shown;
    if (const auto time = args.get_double(kOfxPropTime); time && chosen.sidecar()) {
        std::optional<double> source_frame;
        if (source_less_time) source_frame = *time + *source_less_time;
        shown = shown_frame(params, chosen, host_clip(suites, effect, source_frame), *time);
    }
    if (param == kParamOpenInStudio) pushed = push_open_in_studio(params, chosen, shown.frame);
    write_status(params, std::move(chosen), pushed, copy, shown.words, gpu);
}

void note_source_frame(OfxImageEffectHandle effect, OfxTime time,
                       std::optional<double> source_frame) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    instance->rendered = true;
    instance->source_less_time.reset();
    if (source_frame) instance->source_less_time = *source_frame - time;
}

void note_gpu(OfxImageEffectHandle effect, const std::string& words) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    instance->gpu = words;
}

bool measures_gpu(OfxImageEffectHandle effect) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return false;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    // A driver's first frame takes longer than the next ones.
    constexpr unsigned kBegin = 3, kEach = 64;
    const unsigned frame = instance->gpu_frames++;
    return frame < kBegin || frame % kEach == 0;
}

void note_gpu_frame(OfxImageEffectHandle effect, const std::string& device,
                    const std::string& time) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    if (!time.empty()) instance->gpu_time = time;
    instance->gpu = "GPU: " + device;
    if (!instance->gpu_time.empty()) instance->gpu += ", " + instance->gpu_time + " a frame";
}

void report(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) {
        if (!problem.empty()) show(suites, effect, problem, true);
        return;
    }
    bool is_new = false;
    {
        const std::lock_guard<std::mutex> lock(instance->mutex);
        is_new = instance->message != problem;
        instance->message = problem;
    }
    // Not under the lock: a host may wait for its main thread, which may be in the node.
    if (!problem.empty()) {
        show(suites, effect, problem, is_new);
    } else if (is_new && suites.message2 && suites.message2->clearPersistentMessage) {
        suites.message2->clearPersistentMessage(effect);
    }
}

}  // namespace palette4d::node
