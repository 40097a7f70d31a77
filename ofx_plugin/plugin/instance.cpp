#include "instance.hpp"

#include <cstring>
#include <map>
#include <optional>
#include <sstream>

#include "params.hpp"
#include "sidecar_cache.hpp"

namespace palette4d::plugin {
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

std::string counted(std::size_t count, const char* one, const char* many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string describe(const Sidecar& sidecar) {
    std::size_t edits = sidecar.edits.stops.size();
    for (const std::optional<Vec3>& rgb : sidecar.edits.vertex_rgb) edits += rgb.has_value();
    const ClipInfo& clip = sidecar.clip;
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << clip.name << ": frames " << clip.first << "-" << clip.last << " at "
         << static_cast<double>(clip.rate_num) / static_cast<double>(clip.rate_den) << " fps, "
         << counted(sidecar.polytope.vertices().size(), "palette vertex", "palette vertices")
         << ", " << counted(edits, "edit", "edits");
    return text.str();
}

std::string status_of(const std::string& path) {
    if (path.empty()) return "No sidecar chosen";
    const SidecarResult result = load_sidecar(path);
    return result.loaded ? describe(result.loaded->sidecar()) : result.problem;
}

}  // namespace

void create_instance(const Suites& suites, OfxImageEffectHandle effect) {
    {
        Registry& all = registry();
        const std::lock_guard<std::mutex> lock(all.mutex);
        // A host that never destroyed an instance may use its address again: begin afresh.
        all.instances[effect] = std::make_shared<Instance>();
    }
    update_status(suites, effect);
}

void destroy_instance(OfxImageEffectHandle effect) {
    Registry& all = registry();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.instances.erase(effect);
}

void update_status(const Suites& suites, OfxImageEffectHandle effect) {
    // A host tells of the new status from within the call that sets it. Hosts that do so without
    // saying what changed, and do not give back the text they were given, would go round for ever.
    thread_local bool updating = false;
    if (updating) return;
    struct Guard {
        bool& flag;
        explicit Guard(bool& f) : flag(f) { flag = true; }
        ~Guard() { flag = false; }
    } const guard(updating);
    const Params params(suites, effect);
    const std::string text = status_of(params.string_now(kParamSidecar).value_or(""));
    if (params.string_now(kParamStatus) != text) params.set_string(kParamStatus, text);
}

void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args) {
    const std::optional<std::string> name = args.get_string(kOfxPropName);
    const std::optional<std::string> reason = args.get_string(kOfxPropChangeReason);
    // The plugin itself sets nothing but the status.
    if (name && *name == kParamStatus) return;
    if (reason && *reason == kOfxChangePluginEdited) return;
    update_status(suites, effect);
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

}  // namespace palette4d::plugin
