#include "instance.hpp"

#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "handle_params.hpp"
#include "host_time.hpp"
#include "params.hpp"
#include "sidecar_choice.hpp"
#include "speed_mode.hpp"
#include "status.hpp"

namespace palette4d::node {
namespace {

constexpr const char* kMessageId = "palette4d.sidecar";

// Kept by handle and not in the host's property kOfxPropInstanceData, which a host may refuse: a
// record that cannot be had back would be lost, and its instance would not load.
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

void show(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem) {
    // A host may offer the suite with holes in it: version 2 without its new functions.
    if (suites.message2 && suites.message2->setPersistentMessage) {
        suites.message2->setPersistentMessage(effect, kOfxMessageError, kMessageId, "%s",
                                              problem.c_str());
    } else if (suites.message && suites.message->message) {
        suites.message->message(effect, kOfxMessageLog, kMessageId, "%s", problem.c_str());
    } else if (suites.message2 && suites.message2->message) {
        suites.message2->message(effect, kOfxMessageLog, kMessageId, "%s", problem.c_str());
    }
}

/// The time that the host shows: `time`, or what it last said.
std::optional<OfxTime> last_time(OfxImageEffectHandle effect, std::optional<OfxTime> time) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return time;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    if (time) instance->time = time;
    return instance->time;
}

/// What an instance was told, and what holds from now on.
std::optional<bool> set_told(OfxImageEffectHandle effect, std::optional<bool> told) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) return std::nullopt;
    const std::lock_guard<std::mutex> lock(instance->mutex);
    return std::exchange(instance->told, told);
}

/// What a host calls the step that undoes what the node has set after a change of `param`.
const char* step_after(const std::string& param) {
    if (param == kParamSidecar) return "Show the sidecar's handles";
    if (param == kParamResetHandles) return "Reset handles";
    return param.rfind("handle", 0) == 0 ? "Use the handle" : "Follow the sidecar";
}

/// A change, as kOfxActionInstanceChanged tells it, or its End where that told nothing.
void follow_change(const Suites& suites, OfxImageEffectHandle effect, const Properties& args,
                   bool one_step) {
    const std::optional<std::string> name = args.get_string(kOfxPropName);
    const std::optional<std::string> reason = args.get_string(kOfxPropChangeReason);
    // The user cannot change the status: the plugin hears of its own setting.
    if (name && *name == kParamStatus) return;
    if (reason && *reason == kOfxChangePluginEdited) return;
    // A colour that follows its keyframes is not an edit.
    const bool by_user = reason && *reason == kOfxChangeUserEdited;
    update_instance(suites, effect, by_user ? name.value_or("") : "", args.get_double(kOfxPropTime),
                    one_step);
    if (set_told(effect, std::nullopt)) set_told(effect, true);
}

}  // namespace

void create_instance(const Suites& suites, OfxImageEffectHandle effect) {
    {
        Registry& all = registry();
        const std::lock_guard<std::mutex> lock(all.mutex);
        // A host that never destroyed an instance may use its address again: begin afresh.
        all.instances[effect] = std::make_shared<Instance>();
    }
    update_instance(suites, effect);
}

void destroy_instance(OfxImageEffectHandle effect) {
    Registry& all = registry();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.instances.erase(effect);
}

void update_instance(const Suites& suites, OfxImageEffectHandle effect, const std::string& param,
                     std::optional<OfxTime> time, bool one_step) {
    // A host tells of a new value from within the call that sets it. Hosts that do so without
    // saying what changed, and do not give back what they were given, would go round for ever.
    thread_local bool updating = false;
    if (updating) return;
    struct Guard {
        bool& flag;
        explicit Guard(bool& f) : flag(f) { flag = true; }
        ~Guard() { flag = false; }
    } const guard(updating);
    Params params(suites, effect);
    if (one_step) params.one_undo_step(step_after(param));
    Chosen chosen = chosen_sidecar(params, std::nullopt);
    const std::string copy = keep_files(params, chosen, param);
    const Sidecar* sidecar = chosen.result.loaded ? &chosen.result.loaded->sidecar() : nullptr;
    // Not under the instance's lock: setting a parameter may have the host wait for a render.
    const std::shared_ptr<Instance> instance = find(effect);
    ShownHandles shown_handles;
    if (instance) {
        const std::lock_guard<std::mutex> lock(instance->mutex);
        shown_handles = instance->shown;
    }
    notice_undone(params, shown_handles);
    if (!param.empty()) handle_changed(params, sidecar, param, shown_handles);
    if (chosen.any) {
        show_handles(params, sidecar, shown_handles);
    } else {
        show_no_handles(params);
    }
    if (instance) {
        const std::lock_guard<std::mutex> lock(instance->mutex);
        instance->shown = shown_handles;
    }
    std::string shown;
    time = last_time(effect, time);
    if (sidecar && time) {
        const TimeSettings settings = time_settings_at(params, *time);
        const FrameAt at = frame_at(sidecar->clip, settings, host_clip(suites, effect), *time);
        shown = words_of(*time, at);
        if (mode_at(params, *time) != Mode::kExact && std::isfinite(at.frame)) {
            const auto lattice = chosen.result.loaded->ready_lattice_at(
                at.frame, edits_at(params, *sidecar, *time).edits);
            if (lattice && lattice->largest_error() > 0) shown += "; " + words_of(*lattice);
        }
    }
    const std::string text = status_of(chosen, handles_in_use(params), copy, shown);
    if (params.string_now(kParamStatus) != text) params.note_string(kParamStatus, text);
}

void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args) {
    follow_change(suites, effect, args, true);
}

void changes_begin(OfxImageEffectHandle effect, const Properties& args) {
    if (args.get_string(kOfxPropChangeReason) != kOfxChangePluginEdited) set_told(effect, false);
}

void changes_end(const Suites& suites, OfxImageEffectHandle effect, const Properties& args) {
    // The plugin's own settings are told within the telling of what made it set them.
    if (args.get_string(kOfxPropChangeReason) == kOfxChangePluginEdited) return;
    if (set_told(effect, std::nullopt) != true) follow_change(suites, effect, args, false);
}

void report(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem) {
    const std::shared_ptr<Instance> instance = find(effect);
    if (!instance) {
        if (!problem.empty()) show(suites, effect, problem);
        return;
    }
    const std::lock_guard<std::mutex> lock(instance->mutex);
    if (instance->message == problem) return;
    instance->message = problem;
    if (!problem.empty()) {
        show(suites, effect, problem);
    } else if (suites.message2 && suites.message2->clearPersistentMessage) {
        suites.message2->clearPersistentMessage(effect);
    }
}

}  // namespace palette4d::node
