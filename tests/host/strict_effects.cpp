// The image effect suite: clips, and images that must come back.
#include "strict_host.hpp"

namespace strict {
namespace {

OfxStatus properties(OfxImageEffectHandle effect, OfxPropertySetHandle* set) {
    const Call call("getPropertySet");
    if (call.refused() || !effect) return kOfxStatErrBadHandle;
    *set = &effect->properties;
    return kOfxStatOK;
}

OfxStatus param_set(OfxImageEffectHandle effect, OfxParamSetHandle* set) {
    const Call call("getParamSet");
    if (call.refused() || !effect) return kOfxStatErrBadHandle;
    *set = &effect->params;
    return kOfxStatOK;
}

OfxStatus define(OfxImageEffectHandle effect, const char* name, OfxPropertySetHandle* set) {
    const Call call("clipDefine");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!effect || !effect->descriptor || !name ||
        activity().action != kOfxImageEffectActionDescribeInContext) {
        host.fault("clipDefine: only for descriptors, while describing in a context");
        return kOfxStatErrBadHandle;
    }
    const std::string given = name;
    const bool paints = given == "Brush" && activity().context == kOfxImageEffectContextPaint;
    if (given != kOfxImageEffectSimpleSourceClipName && given != kOfxImageEffectOutputClipName &&
        !paints) {
        host.fault("clipDefine: this context has no clip " + given);
    }
    auto clip = std::make_unique<OfxImageClipStruct>(
        OfxImageClipStruct{given, OfxPropertySetStruct(kClipDescriptor)});
    clip->properties.put(kOfxPropType, std::string(kOfxTypeClip));
    clip->properties.put(kOfxPropName, given);
    if (set) *set = &clip->properties;
    effect->clips[given] = std::move(clip);
    return kOfxStatOK;
}

OfxStatus get_handle(OfxImageEffectHandle effect, const char* name, OfxImageClipHandle* clip,
                     OfxPropertySetHandle* set) {
    const Call call("clipGetHandle");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!effect || effect->descriptor || !name) {
        host.fault("clipGetHandle: not an instance, or no name");
        return kOfxStatErrBadHandle;
    }
    const auto found = effect->clips.find(name);
    if (found == effect->clips.end()) {
        if (!host.refused()) host.fault(std::string("clipGetHandle: no clip ") + name);
        return kOfxStatErrUnknown;
    }
    *clip = found->second.get();
    if (set) *set = &found->second->properties;
    return kOfxStatOK;
}

OfxStatus clip_properties(OfxImageClipHandle clip, OfxPropertySetHandle* set) {
    const Call call("clipGetPropertySet");
    if (call.refused() || !clip) return kOfxStatErrBadHandle;
    *set = &clip->properties;
    return kOfxStatOK;
}

std::string components(int channels) {
    return channels == 4   ? kOfxImageComponentRGBA
           : channels == 3 ? kOfxImageComponentRGB
                           : kOfxImageComponentAlpha;
}

constexpr const char* kBitDepths[] = {kOfxBitDepthByte, kOfxBitDepthShort, kOfxBitDepthHalf,
                                      kOfxBitDepthFloat};

void put_rect(OfxPropertySetStruct& set, const char* name, const OfxRectI& rect) {
    set.put_all(name, {rect.x1, rect.y1, rect.x2, rect.y2});
}

OfxStatus get_image(OfxImageClipHandle clip, OfxTime time, const OfxRectD*,
                    OfxPropertySetHandle* image) {
    const Call call("clipGetImage");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    Activity& now = activity();
    if (!clip || !image || !now.images) {
        host.fault("clipGetImage: not while rendering, or without a clip");
        return kOfxStatErrBadHandle;
    }
    if (time != now.time && clip->properties.number(kTemporal) == 0) {
        host.fault("clipGetImage: another time's, without temporal access to " + clip->name);
        return kOfxStatFailed;
    }
    const bool is_output = clip->name == kOfxImageEffectOutputClipName;
    if (now.frames && is_output) {
        host.fault("clipGetImage: there is no output beside a render");
        return kOfxStatFailed;
    }
    const Picture* picture = now.frames  ? (*now.frames)(time)
                             : is_output ? now.output
                             : clip->name == kOfxImageEffectSimpleSourceClipName ? now.source
                                                                                 : now.brush;
    *image = nullptr;
    if (!picture) return kOfxStatFailed;  // "assume the image was black and transparent"
    const Layout& layout = picture->layout();
    auto set = std::make_unique<OfxPropertySetStruct>(kImage);
    set->put(kOfxPropType, std::string(kOfxTypeImage));
    set->put(kOfxImagePropData, now.devices
                                    ? now.devices->at(picture)
                                    : static_cast<void*>(const_cast<unsigned char*>(
                                          picture->at(layout.bounds.x1, layout.bounds.y1))));
    put_rect(*set, kOfxImagePropBounds, layout.bounds);
    put_rect(*set, kOfxImagePropRegionOfDefinition, layout.definition.value_or(layout.bounds));
    set->put(kOfxImagePropRowBytes, static_cast<int>(picture->row_bytes()));
    set->put(kOfxImageEffectPropPixelDepth,
             std::string(kBitDepths[static_cast<int>(layout.depth)]));
    set->put(kOfxImageEffectPropComponents, components(layout.channels));
    set->put(kOfxImageEffectPropPreMultiplication, layout.premultiplication);
    set->put(kOfxImagePropField, std::string(kOfxImageFieldNone));
    set->put(kOfxImagePropPixelAspectRatio, 1.0);
    set->put_all(kOfxImageEffectPropRenderScale, {layout.scale, layout.scale});
    set->put(kOfxImagePropUniqueIdentifier, std::string("picture"));
    *image = set.get();
    now.images->insert(set.release());
    return kOfxStatOK;
}

OfxStatus release_image(OfxPropertySetHandle image) {
    // Given back even where the call is said to have failed: the leak would not be the plugin's.
    const Call call("clipReleaseImage");
    Activity& now = activity();
    if (!now.images || !now.images->erase(image)) {
        Host::get().fault("clipReleaseImage: not an image of this render, or twice");
        return kOfxStatErrBadHandle;
    }
    delete image;
    return call.refused() ? kOfxStatFailed : kOfxStatOK;
}

OfxStatus region(OfxImageClipHandle clip, OfxTime, OfxRectD* bounds) {
    const Call call("clipGetRegionOfDefinition");
    if (call.refused() || !clip) return kOfxStatFailed;
    *bounds = {0, 0, 16, 16};
    return kOfxStatOK;
}

int abort(OfxImageEffectHandle effect) {
    const Call call("abort", true);
    if (!effect || effect->descriptor) {
        Host::get().fault("abort: not an instance");
        return 0;
    }
    const int polls = effect->abort_polls.fetch_add(1);
    const int after = effect->abort_after.load();
    return after >= 0 && polls >= after;
}

OfxStatus memory_alloc(OfxImageEffectHandle, size_t, OfxImageMemoryHandle*) {
    Host::get().fault("imageMemoryAlloc: not expected of this plugin");
    return kOfxStatErrMemory;
}
OfxStatus memory_free(OfxImageMemoryHandle) { return kOfxStatErrBadHandle; }
OfxStatus memory_lock(OfxImageMemoryHandle, void**) { return kOfxStatErrBadHandle; }
OfxStatus memory_unlock(OfxImageMemoryHandle) { return kOfxStatErrBadHandle; }

const OfxImageEffectSuiteV1 kEffectSuite = {
    properties, param_set, define,       get_handle,  clip_properties, get_image,    release_image,
    region,     abort,     memory_alloc, memory_free, memory_lock,     memory_unlock};

}  // namespace

SuiteTable effect_suite() {
    using S = OfxImageEffectSuiteV1;
    return {&kEffectSuite,
            sizeof kEffectSuite,
            {{"getPropertySet", offsetof(S, getPropertySet)},
             {"getParamSet", offsetof(S, getParamSet)},
             {"clipDefine", offsetof(S, clipDefine)},
             {"clipGetHandle", offsetof(S, clipGetHandle)},
             {"clipGetImage", offsetof(S, clipGetImage)},
             {"clipReleaseImage", offsetof(S, clipReleaseImage)},
             {"abort", offsetof(S, abort)}}};
}

}  // namespace strict
