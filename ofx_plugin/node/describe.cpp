#include "describe.hpp"

#include "colour_management.hpp"
#include "gpu_render.hpp"
#include "output_params.hpp"
#include "params.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {

bool define_clip(const Suites& suites, OfxImageEffectHandle effect, const char* name,
                 std::initializer_list<const char*> components, int other_frames) {
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->clipDefine ||
        suites.effect->clipDefine(effect, name, &handle) != kOfxStatOK) {
        return false;
    }
    const Properties clip(suites, handle);
    clip.set_strings(kOfxImageEffectPropSupportedComponents, components);
    clip.set_int(kOfxImageEffectPropSupportsTiles, 1);
    clip.set_int(kOfxImageEffectPropTemporalClipAccess, other_frames);
    return true;
}

std::optional<Properties> describe_effect(const Suites& suites, OfxImageEffectHandle effect,
                                          const About& about) {
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->getPropertySet ||
        suites.effect->getPropertySet(effect, &handle) != kOfxStatOK || !handle) {
        return std::nullopt;
    }
    // Properties that a host does not know or refuses keep the host's defaults.
    const Properties node(suites, handle);
    node.set_string(kOfxPropLabel, about.label);
    node.set_string(kOfxPropShortLabel, about.short_label);
    node.set_string(kOfxPropLongLabel, about.long_label);
    node.set_string(kOfxPropVersionLabel, PALETTE4D_VERSION);
    node.set_string(kOfxPropPluginDescription, about.description);
    node.set_string(kOfxImageEffectPluginPropGrouping, "Color");
    node.set_strings(kOfxImageEffectPropSupportedContexts, about.contexts);
    // Float before byte. The node renders short and half but does not ask for them: so hosts with
    // 16-bit pictures hand over float.
    node.set_strings(kOfxImageEffectPropSupportedPixelDepths,
                     {kOfxBitDepthFloat, kOfxBitDepthByte});

    node.set_string(kOfxImageEffectPluginRenderThreadSafety, kOfxImageEffectRenderFullySafe);
    node.set_int(kOfxImageEffectPluginPropSingleInstance, 0);
    node.set_int(kOfxImageEffectPluginPropHostFrameThreading, 0);
    node.set_int(kOfxImageEffectPropSupportsTiles, 1);
    node.set_int(kOfxImageEffectPropSupportsMultiResolution, 1);
    node.set_int(kOfxImageEffectPropTemporalClipAccess, about.other_frames);
    node.set_int(kOfxImageEffectPropSupportsMultipleClipDepths, 0);
    node.set_int(kOfxImageEffectPropSupportsMultipleClipPARs, 0);
    node.set_string(kOfxImageEffectPropCPURenderSupported, "true");
    return node;
}

OfxStatus describe(const Suites& suites, OfxImageEffectHandle effect) {
    const About about{
        "Palette4D",
        "Palette4D",
        "Palette4D time-varying palette",
        "Recolours a clip by the edits made to its time-varying colour palette.",
        {kOfxImageEffectContextFilter, kOfxImageEffectContextGeneral, kOfxImageEffectContextPaint},
        0};
    const std::optional<Properties> node = describe_effect(suites, effect, about);
    if (!node) return kOfxStatFailed;
    // A pixel's result depends on that pixel only, so a host may bake the node into a LUT, but for
    // the clean-up of picks: a render for a LUT leaves it out.
    node->set_string(kOfxImageEffectPropNoSpatialAwareness, "true");
    describe_gpu(*node);
    describe_colour(*node);
    return kOfxStatOK;
}

OfxStatus describe_in_context(const Suites& suites, OfxImageEffectHandle effect,
                              const Properties& in_args) {
    // RGBA first: hosts that support one layout take the first. Alpha clips pass through.
    const auto pictures = {kOfxImageComponentRGBA, kOfxImageComponentRGB, kOfxImageComponentAlpha};
    if (!define_clip(suites, effect, kOfxImageEffectSimpleSourceClipName, pictures) ||
        !define_clip(suites, effect, kOfxImageEffectOutputClipName, pictures)) {
        return kOfxStatFailed;
    }
    if (in_args.get_string(kOfxImageEffectPropContext) == kOfxImageEffectContextPaint &&
        !define_clip(suites, effect, kBrushClipName, {kOfxImageComponentAlpha})) {
        return kOfxStatFailed;
    }
    OfxParamSetHandle params = nullptr;
    if (!suites.effect->getParamSet || suites.effect->getParamSet(effect, &params) != kOfxStatOK ||
        !params) {
        return kOfxStatFailed;
    }
    define_params(suites, params);
    OfxPropertySetHandle handle = nullptr;
    if (suites.effect->getPropertySet &&
        suites.effect->getPropertySet(effect, &handle) == kOfxStatOK) {
        // Hosts call clip_preferences() again only when one of these parameters changes.
        Properties(suites, handle)
            .set_strings(kOfxImageEffectPropClipPreferencesSlaveParam,
                         {kParamSidecar, kParamClipFolder, kParamRevision, kParamPictureIn,
                          kParamOutput, kParamMatteIn});
    }
    return kOfxStatOK;
}

OfxStatus clip_preferences(const Suites& suites, OfxImageEffectHandle effect,
                           const Properties& out_args) {
    prefer_colour(suites, effect, out_args);
    prefer_alpha(suites, effect, out_args);
    return out_args.set_int(kOfxImageEffectFrameVarying, 1) ? kOfxStatOK : kOfxStatReplyDefault;
}

}  // namespace palette4d::node
