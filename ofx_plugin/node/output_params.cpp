#include "output_params.hpp"

#include <algorithm>
#include <cmath>

#include "convert/colour_spaces.hpp"

namespace palette4d::node {
namespace {

/// The spaces of kParamLightnessOf, after its first option.
constexpr const char* kLightnessOf[] = {"Rec.709", "Rec.2020", "P3-D65", "ACEScg", "Rec.601"};

double clamped(const std::optional<double>& value, double initial, double low, double high) {
    const double given = value.value_or(initial);
    return std::isfinite(given) ? std::clamp(given, low, high) : initial;
}

Output output_of(const std::optional<int>& choice) {
    const int number = choice.value_or(0);
    return number > 0 && number <= static_cast<int>(Output::kPick) ? static_cast<Output>(number)
                                                                   : Output::kRecoloured;
}

}  // namespace

void define_output_params(ParamDefiner& define) {
    define.begin_group("outputs", "Output");
    define.choice({kParamOutput, "Output",
                   "Recoloured: the graded picture. Weight of a handle: a soft key that follows "
                   "one palette colour through time. Palette: the graded picture with this frame's "
                   "palette at the bottom, original colours above and new colours below. Outside: "
                   "a matte of the colours outside the palette. Matte of a pick: what a pick or "
                   "hold takes."},
                  {"Recoloured", "Weight of a handle", "Palette", "Outside", "Matte of a pick"});
    define.integer({kParamWeightOf, "Handle",
                    "The handle for Weight of a handle: 2 is the handle of Use 2 below."},
                   {1, 1, 100000, 1, 32});
    define.integer({kParamPick, "Pick", "The pick or hold for Matte of a pick: 1 is p1."},
                   {1, 1, 100000, 1, 32});
    define.choice(
        {kParamMatteIn, "Matte in",
         "Picture: outputs the matte (Weight of a handle, Outside or Matte of a pick) as a grey "
         "picture. Alpha: keeps the picture's colours and multiplies its alpha (1 if opaque) by "
         "the matte."},
        {"Picture", "Alpha"});
    define.number(
        {kParamOutsideReach, "Outside at",
         "The distance from the palette at which Outside is white. Nearer colours are grey."},
        {0.05, 0.0001, 100, 0.001, 1}, 0.01, 4, false);
    define.number({kParamKeepLightness, "Keep lightness",
                   "How much of the source's lightness the graded picture keeps: 0 none, 1 all. At "
                   "1 only hue and saturation change."},
                  {0, 0, 1, 0, 1}, 0.01, 3, true);
    define.choice({kParamLightnessOf, "Lightness of",
                   "The colour space whose luminance weights define lightness. Auto: the sidecar's "
                   "colour space, or Rec.709 if the node does not know that space."},
                  {"Auto", "Rec.709", "Rec.2020", "P3", "ACES AP1", "Rec.601"});
    define.choice({kParamPictureIn, "Input colour space",
                   "The node's input colour space. Input space: the analysed clip's code values. "
                   "Palette space: the palette's code values, such as ACEScct, for hosts that "
                   "convert themselves. Without a conversion in the sidecar both are the same. "
                   "Scene-linear: linear light, for a palette in sRGB, Rec.709 or another display "
                   "encoding. The handles' colours are then linear too."},
                  {"Input space", "Palette space", "Scene-linear"});
    define.number({kParamCleanUp, "Clean up",
                   "How much of the change by picks follows the picture's edges: removes codec "
                   "blocks, soft chroma and rims. 0 none, 1 all."},
                  {1, 0, 1, 0, 1}, 0.01, 3, true);
    define.number({kParamMix, "Mix", "Blends from the source (0) to the output (1)."},
                  {1, 0, 1, 0, 1}, 0.01, 3, true);
    define.end_group();
}

OutputSettings output_settings_at(const Params& params, OfxTime time) {
    OutputSettings settings;
    settings.output = output_of(params.int_at(kParamOutput, time));
    settings.weight_of = params.int_at(kParamWeightOf, time).value_or(1);
    settings.pick = params.int_at(kParamPick, time).value_or(1);
    settings.in_alpha = params.int_at(kParamMatteIn, time).value_or(0) == 1;
    // Some hosts do not keep a parameter inside its range.
    settings.reach = clamped(params.double_at(kParamOutsideReach, time), 0.05, 1e-4, 100);
    settings.strength = clamped(params.double_at(kParamStrength, time), 1, 0, 1);
    settings.keep = clamped(params.double_at(kParamKeepLightness, time), 0, 0, 1);
    const int of = params.int_at(kParamLightnessOf, time).value_or(0);
    constexpr int spaces = static_cast<int>(std::size(kLightnessOf));
    settings.own_lightness = of < 1 || of > spaces;
    if (!settings.own_lightness && settings.keep > 0) {
        settings.lightness = luminance_weights(kLightnessOf[of - 1]);
    }
    settings.in_palette_space = params.int_at(kParamPictureIn, time).value_or(0) == 1;
    settings.scene_linear = params.int_at(kParamPictureIn, time).value_or(0) == 2;
    settings.clean_up = clamped(params.double_at(kParamCleanUp, time), 1, 0, 1);
    settings.mix = clamped(params.double_at(kParamMix, time), 1, 0, 1);
    return settings;
}

std::shared_ptr<const ColourConversion> linear_picture(const Params& params, const Sidecar& sidecar,
                                                       OfxTime time) {
    if (sidecar.conversion || params.int_at(kParamPictureIn, time).value_or(0) != 2) return nullptr;
    return from_linear(sidecar.clip.encoding);
}

const std::string& encoding_of(const Sidecar& sidecar, bool in_palette_space) {
    return sidecar.conversion && !in_palette_space ? sidecar.conversion->input_space
                                                   : sidecar.clip.encoding;
}

void prefer_alpha(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args) {
    const Params params(suites, effect);
    OutputSettings settings;
    settings.output = output_of(params.int_at(kParamOutput, Params::kAnyTime));
    if (!settings.is_matte() || params.int_at(kParamMatteIn, Params::kAnyTime).value_or(0) != 1)
        return;
    OfxImageClipHandle clip = nullptr;
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->clipGetHandle ||
        suites.effect->clipGetHandle(effect, kOfxImageEffectSimpleSourceClipName, &clip, &handle) !=
            kOfxStatOK) {
        return;
    }
    const Properties source(suites, handle);
    // An alpha-only clip has no colours for a matte.
    if (source.get_string(kOfxImageEffectPropComponents) == kOfxImageComponentAlpha) return;
    for (const char* name : {kOfxImageEffectSimpleSourceClipName, kOfxImageEffectOutputClipName}) {
        const std::string components = std::string("OfxImageClipPropComponents_") + name;
        out_args.set_string(components.c_str(), kOfxImageComponentRGBA);
    }
    if (source.get_string(kOfxImageEffectPropPreMultiplication) == kOfxImageOpaque) {
        out_args.set_string(kOfxImageEffectPropPreMultiplication, kOfxImageUnPreMultiplied);
    }
}

}  // namespace palette4d::node
