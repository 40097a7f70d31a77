// The bundle's three entry points and the dispatch of actions. No exception leaves this file.
#include <cstring>
#include <exception>
#include <memory>
#include <new>

#include "analyse_effect.hpp"
#include "colour_management.hpp"
#include "describe.hpp"
#include "gpu/queue.hpp"
#include "host.hpp"
#include "instance.hpp"
#include "render.hpp"
#include "sidecar_cache.hpp"

#if defined(_WIN32)
#define PALETTE4D_ENTRY extern "C" __declspec(dllexport)
#else
#define PALETTE4D_ENTRY extern "C" __attribute__((visibility("default")))
#endif

namespace palette4d::node {
namespace {

OfxStatus grade_action(const Suites& host, const char* action, OfxImageEffectHandle effect,
                       const Properties& in, const Properties& out) {
    const auto is = [action](const char* name) { return std::strcmp(action, name) == 0; };
    if (is(kOfxImageEffectActionRender)) return render(host, effect, in);
    if (is(kOfxImageEffectActionIsIdentity)) return is_identity(host, effect, in, out);
    if (is(kOfxImageEffectActionGetRegionsOfInterest)) {
        return regions_of_interest(host, effect, in, out);
    }
    if (is(kOfxImageEffectActionGetClipPreferences)) {
        return clip_preferences(host, effect, out);
    }
    if (is(kOfxImageEffectActionGetOutputColourspace)) return output_colour(out);
    if (is(kOfxActionDescribe)) return describe(host, effect);
    if (is(kOfxImageEffectActionDescribeInContext)) return describe_in_context(host, effect, in);
    if (is(kOfxActionCreateInstance)) {
        create_instance(host, effect);
        return kOfxStatOK;
    }
    if (is(kOfxActionDestroyInstance)) {
        destroy_instance(effect);
        return kOfxStatOK;
    }
    if (is(kOfxActionInstanceChanged)) {
        instance_changed(host, effect, in);
        return kOfxStatOK;
    }
    return kOfxStatReplyDefault;
}

using Action = OfxStatus (*)(const Suites& host, const char* action, OfxImageEffectHandle effect,
                             const Properties& in, const Properties& out);

template <Action act>
OfxStatus dispatch(const char* action, OfxImageEffectHandle effect, OfxPropertySetHandle in_args,
                   OfxPropertySetHandle out_args) {
    const auto is = [action](const char* name) { return std::strcmp(action, name) == 0; };
    if (is(kOfxActionLoad)) return load_suites() ? kOfxStatOK : kOfxStatErrMissingHostFeature;
    if (is(kOfxActionUnload) || is(kOfxActionPurgeCaches)) {
        purge_sidecars();
        gpu::purge();
        return kOfxStatOK;
    }
    const std::shared_ptr<const Suites> host = suites();
    if (!host) return kOfxStatErrMissingHostFeature;
    return act(*host, action, effect, Properties(*host, in_args), Properties(*host, out_args));
}

template <Action act>
OfxStatus main_entry(const char* action, const void* handle, OfxPropertySetHandle in_args,
                     OfxPropertySetHandle out_args) {
    if (!action) return kOfxStatReplyDefault;
    // The standard passes effects as const pointers, but its suites take them as non-const.
    const auto effect = static_cast<OfxImageEffectHandle>(const_cast<void*>(handle));
    try {
        return dispatch<act>(action, effect, in_args, out_args);
    } catch (const std::bad_alloc&) {
        return kOfxStatErrMemory;
    } catch (...) {
        return kOfxStatFailed;
    }
}

void remember_host(OfxHost* host) { set_host(host); }

// Raise a version when its parameters change: hosts cache the description under it.
OfxPlugin g_plugins[] = {
    {kOfxImageEffectPluginApi, kOfxImageEffectPluginApiVersion, "org.palette4d.Palette4D", 1, 7,
     &remember_host, &main_entry<&grade_action>},
    {kOfxImageEffectPluginApi, kOfxImageEffectPluginApiVersion, "org.palette4d.Analyse", 1, 0,
     &remember_host, &main_entry<&analyse_action>}};
constexpr int kPlugins = sizeof g_plugins / sizeof *g_plugins;

}  // namespace
}  // namespace palette4d::node

PALETTE4D_ENTRY int OfxGetNumberOfPlugins(void) { return palette4d::node::kPlugins; }

PALETTE4D_ENTRY OfxPlugin* OfxGetPlugin(int nth) {
    using namespace palette4d::node;
    return nth >= 0 && nth < kPlugins ? &g_plugins[nth] : nullptr;
}

PALETTE4D_ENTRY OfxStatus OfxSetHost(const OfxHost* host) {
    palette4d::node::set_host(host);
    return kOfxStatOK;
}
