// The parameters of the node's output: the recoloured picture, or a matte made from the palette.
#pragma once

#include <memory>
#include <string>

#include "convert/colour_conversion.hpp"
#include "output/drawing.hpp"
#include "param_define.hpp"
#include "params.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// Its options are those of Output, in order.
inline constexpr const char* kParamOutput = "output";
inline constexpr const char* kParamWeightOf = "weightOf";
inline constexpr const char* kParamPick = "pick";
inline constexpr const char* kParamMatteIn = "matteIn";
inline constexpr const char* kParamOutsideReach = "outsideReach";
inline constexpr const char* kParamKeepLightness = "keepLightness";
inline constexpr const char* kParamLightnessOf = "lightnessOf";
inline constexpr const char* kParamCleanUp = "cleanUp";
inline constexpr const char* kParamMix = "mix";
inline constexpr const char* kParamPictureIn = "pictureIn";

void define_output_params(ParamDefiner& define);

struct OutputSettings : DrawingOptions {
    int weight_of = 1;          ///< a slot, counted from 1; beyond the last slot the nth handle
    int pick = 1;               ///< the number of a pick's id
    bool own_lightness = true;  ///< weights follow the sidecar's encoding, not the user's choice
    bool in_palette_space = false;  ///< the picture is already in the palette's code values
    bool scene_linear = false;      ///< the picture and the host's colours are scene-linear
};
OutputSettings output_settings_at(const Params& params, OfxTime time);
/// Clip preferences for a matte in alpha: an alpha channel, and an output that is not opaque even
/// where the source is.
void prefer_alpha(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args);

/// The conversion from scene-linear to the palette's code values, where *Input colour space*
/// selects it and the sidecar has no conversion. Else null, also where the encoding has no known
/// curve.
std::shared_ptr<const ColourConversion> linear_picture(const Params& params, const Sidecar& sidecar,
                                                       OfxTime time);
/// The encoding of the node's picture: the sidecar's input space, or the palette's if chosen.
const std::string& encoding_of(const Sidecar& sidecar, bool in_palette_space);

}  // namespace palette4d::node
