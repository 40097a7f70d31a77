// What the node puts out: the recoloured picture, or what a palette tells about one, as a matte.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "param_define.hpp"
#include "params.hpp"
#include "pixels.hpp"
#include "recolour/recolour.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// The options of kParamOutput, in order.
enum class Output { kRecoloured, kWeight, kPalette, kOutside };
inline constexpr const char* kParamOutput = "output";
inline constexpr const char* kParamWeightOf = "weightOf";
inline constexpr const char* kParamMatteIn = "matteIn";
inline constexpr const char* kParamOutsideReach = "outsideReach";
inline constexpr const char* kParamKeepLightness = "keepLightness";
inline constexpr const char* kParamLightnessOf = "lightnessOf";
inline constexpr const char* kParamMix = "mix";
inline constexpr const char* kParamPictureIn = "pictureIn";

void define_output_params(ParamDefiner& define);

struct OutputSettings {
    Output output = Output::kRecoloured;
    int weight_of = 1;              ///< a slot of the handles, counted from 1; beyond them a handle
    bool in_alpha = false;          ///< mattes multiply alpha instead of being a grey picture
    double reach = 0.05;            ///< distance from the palette at which a colour is all outside
    double strength = 1;            ///< 0 to 1
    double keep = 0;                ///< of the source's lightness, 0 to 1
    bool own_lightness = true;      ///< weighed as the sidecar's picture is, and not by a choice
    Vec3 lightness{0, 0, 0};        ///< weights of red, green and blue; they sum to 1
    double mix = 1;                 ///< 0 the source, 1 what is put out
    bool in_palette_space = false;  ///< the picture has the palette's numbers already
    bool scene_linear = false;      ///< the picture and the host's colours are linear light

    /// The source comes out, whatever else is set.
    bool passes() const { return mix == 0 || (output == Output::kRecoloured && strength == 0); }
    bool is_matte() const { return output == Output::kWeight || output == Output::kOutside; }
};
OutputSettings output_settings_at(const Params& params, OfxTime time);
/// Tells a host that asks for preferences what a matte in alpha needs: a channel to stand in, and
/// that the output is not opaque even where the source is.
void prefer_alpha(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args);

/// From scene-linear numbers to the palette's, where *Picture is in* says so and the sidecar has no
/// conversion of its own; else null, also for a palette whose encoding has no known curve.
std::shared_ptr<const ColourConversion> linear_picture(const Params& params, const Sidecar& sidecar,
                                                       OfxTime time);
/// What the node's picture is in: the sidecar's input, or with the choice its palette's space.
const std::string& encoding_of(const Sidecar& sidecar, bool in_palette_space);

/// What is drawn, all of it read only: threads share it.
struct Drawing {
    OutputSettings settings;
    /// The edit, exact or interpolated; null where the picture keeps its colours.
    std::shared_ptr<const ColourMap> edit;
    /// For mattes: weight_reader() or surface_reader().
    std::shared_ptr<const Recolourer> reader;
    /// From the picture's numbers to the palette's; null where they are the same.
    std::shared_ptr<const ColourConversion> conversion;
    /// For Output::kPalette: the slice's colours before and after the edit, and the whole picture,
    /// at whose foot they stand.
    std::vector<Vec3> original, edited;
    OfxRectI picture{};
    /// Where the result shows, by its alpha or its only channel; null: everywhere.
    const Image* mask = nullptr;
};

/// Draws what `in` covers of `area`; the rest becomes transparent black. Both images have the same
/// format, of three or four channels.
void draw(const Image& in, const Image& out, const OfxRectI& area, const Drawing& drawing);

}  // namespace palette4d::node
