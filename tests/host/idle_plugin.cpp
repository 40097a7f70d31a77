// An OpenFX effect that hands its source through and keeps nothing: what a host itself takes for a
// node, to measure ours against.
#include <cstddef>
#include <cstring>
#include <initializer_list>

#include "ofxImageEffect.h"

namespace {

const OfxPropertySuiteV1* g_properties;
const OfxImageEffectSuiteV1* g_effects;
OfxHost* g_host;

void describe(OfxImageEffectHandle effect) {
    OfxPropertySetHandle set;
    g_effects->getPropertySet(effect, &set);
    g_properties->propSetString(set, kOfxPropLabel, 0, "Idle");
    g_properties->propSetString(set, kOfxImageEffectPropSupportedContexts, 0,
                                kOfxImageEffectContextFilter);
    g_properties->propSetString(set, kOfxImageEffectPropSupportedPixelDepths, 0, kOfxBitDepthFloat);
    g_properties->propSetString(set, kOfxImageEffectPropSupportedPixelDepths, 1, kOfxBitDepthByte);
    g_properties->propSetString(set, kOfxImageEffectPluginRenderThreadSafety, 0,
                                kOfxImageEffectRenderFullySafe);
}

void describe_in_context(OfxImageEffectHandle effect) {
    for (const char* name : {kOfxImageEffectSimpleSourceClipName, kOfxImageEffectOutputClipName}) {
        OfxPropertySetHandle set;
        g_effects->clipDefine(effect, name, &set);
        g_properties->propSetString(set, kOfxImageEffectPropSupportedComponents, 0,
                                    kOfxImageComponentRGBA);
    }
}

struct Picture {
    OfxPropertySetHandle set = nullptr;
    char* data = nullptr;
    int bounds[4] = {}, stride = 0;
    Picture(OfxImageEffectHandle effect, const char* name, double time) {
        OfxImageClipHandle clip;
        OfxPropertySetHandle clip_set;
        g_effects->clipGetHandle(effect, name, &clip, &clip_set);
        if (g_effects->clipGetImage(clip, time, nullptr, &set) != kOfxStatOK) return;
        void* pixels = nullptr;
        g_properties->propGetPointer(set, kOfxImagePropData, 0, &pixels);
        data = static_cast<char*>(pixels);
        for (int i = 0; i < 4; ++i) {
            g_properties->propGetInt(set, kOfxImagePropBounds, i, &bounds[i]);
        }
        g_properties->propGetInt(set, kOfxImagePropRowBytes, 0, &stride);
    }
    ~Picture() {
        if (set) g_effects->clipReleaseImage(set);
    }
};

OfxStatus render(OfxImageEffectHandle effect, OfxPropertySetHandle in_args) {
    double time = 0;
    g_properties->propGetDouble(in_args, kOfxPropTime, 0, &time);
    const Picture from(effect, kOfxImageEffectSimpleSourceClipName, time);
    const Picture to(effect, kOfxImageEffectOutputClipName, time);
    if (!from.data || !to.data) return kOfxStatFailed;
    const int row = from.stride < 0 ? -from.stride : from.stride;
    for (int y = 0; y < to.bounds[3] - to.bounds[1]; ++y) {
        std::memcpy(to.data + static_cast<std::ptrdiff_t>(y) * to.stride,
                    from.data + static_cast<std::ptrdiff_t>(y) * from.stride,
                    static_cast<std::size_t>(row));
    }
    return kOfxStatOK;
}

OfxStatus main_entry(const char* action, const void* handle, OfxPropertySetHandle in_args,
                     OfxPropertySetHandle) {
    const auto effect = static_cast<OfxImageEffectHandle>(const_cast<void*>(handle));
    if (std::strcmp(action, kOfxActionLoad) == 0) {
        g_properties = static_cast<const OfxPropertySuiteV1*>(
            g_host->fetchSuite(g_host->host, kOfxPropertySuite, 1));
        g_effects = static_cast<const OfxImageEffectSuiteV1*>(
            g_host->fetchSuite(g_host->host, kOfxImageEffectSuite, 1));
    } else if (std::strcmp(action, kOfxActionDescribe) == 0) {
        describe(effect);
    } else if (std::strcmp(action, kOfxImageEffectActionDescribeInContext) == 0) {
        describe_in_context(effect);
    } else if (std::strcmp(action, kOfxImageEffectActionRender) == 0) {
        return render(effect, in_args);
    }
    return kOfxStatOK;
}

void set_host(OfxHost* host) { g_host = host; }

OfxPlugin g_plugin = {kOfxImageEffectPluginApi,
                      kOfxImageEffectPluginApiVersion,
                      "org.palette4d.tests.Idle",
                      1,
                      0,
                      &set_host,
                      &main_entry};

}  // namespace

#if defined(_WIN32)
#define ENTRY extern "C" __declspec(dllexport)
#else
#define ENTRY extern "C" __attribute__((visibility("default")))
#endif
ENTRY int OfxGetNumberOfPlugins(void) { return 1; }
ENTRY OfxPlugin* OfxGetPlugin(int nth) { return nth == 0 ? &g_plugin : nullptr; }
ENTRY OfxStatus OfxSetHost(const OfxHost*) { return kOfxStatOK; }
