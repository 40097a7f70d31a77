// The bundle's three entry points and the dispatch of actions. No exception leaves this file.
#include <cstring>
#include <exception>
#include <memory>
#include <new>

#include "colour_management.hpp"
#include "describe.hpp"
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

OfxStatus dispatch(const char* action, OfxImageEffectHandle effect, OfxPropertySetHandle in_args,
                   OfxPropertySetHandle out_args) {
    const auto is = [action](const char* name) { return std::strcmp(action, name) == 0; };
    if (is(kOfxActionLoad)) return load_suites() ? kOfxStatOK : kOfxStatErrMissingHostFeature;
    if (is(kOfxActionUnload) || is(kOfxActionPurgeCaches)) {
        purge_sidecars();
        return kOfxStatOK;
    }
    const std::shared_ptr<const Suites> held = suites();
    if (!held) return kOfxStatErrMissingHostFeature;
    const Suites& host = *held;
    const Properties in(host, in_args);
    const Properties out(host, out_args);

    if (is(kOfxImageEffectActionRender)) return render(host, effect, in);
    if (is(kOfxImageEffectActionIsIdentity)) return is_identity(host, effect, in, out);
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

OfxStatus main_entry(const char* action, const void* handle, OfxPropertySetHandle in_args,
                     OfxPropertySetHandle out_args) {
    if (!action) return kOfxStatReplyDefault;
    // The standard passes effects as const pointers, but its suites take them as non-const.
    const auto effect = static_cast<OfxImageEffectHandle>(const_cast<void*>(handle));
    try {
        return dispatch(action, effect, in_args, out_args);
    } catch (const std::bad_alloc&) {
        return kOfxStatErrMemory;
    } catch (...) {
        return kOfxStatFailed;
    }
}

void remember_host(OfxHost* host) { set_host(host); }

// Raise the version when parameters change: hosts cache the description under it.
OfxPlugin g_plugin = {kOfxImageEffectPluginApi,
                      kOfxImageEffectPluginApiVersion,
                      "org.palette4d.Palette4D",
                      1,
                      3,
                      &remember_host,
                      &main_entry};

}  // namespace
}  // namespace palette4d::node

PALETTE4D_ENTRY int OfxGetNumberOfPlugins(void) { return 1; }

PALETTE4D_ENTRY OfxPlugin* OfxGetPlugin(int nth) {
    return nth == 0 ? &palette4d::node::g_plugin : nullptr;
}

PALETTE4D_ENTRY OfxStatus OfxSetHost(const OfxHost* host) {
    palette4d::node::set_host(host);
    return kOfxStatOK;
}
