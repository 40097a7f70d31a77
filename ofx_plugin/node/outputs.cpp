#include "outputs.hpp"

#include <algorithm>
#include <cmath>

#include "colour_spaces.hpp"

namespace palette4d::node {
namespace {

// Floats in one chunk of rows, source and result: small enough for the second-level cache.
constexpr std::size_t kChunkFloats = 32768;
/// Colours this near to the palette's surface count as inside: the surface is no more precise.
constexpr double kAtSurface = 1e-3;
/// Above this, a float has too few digits for the weight added to the colour.
constexpr float kLarge = 256;
constexpr int kStripPart = 8;  ///< the strip's height is 1/8 of the picture's

/// The spaces of kParamLightnessOf, after its first option.
constexpr const char* kLightnessOf[] = {"Rec.709", "Rec.2020", "P3-D65", "ACEScg"};
constexpr Vec3 kRec601 = {0.299, 0.587, 0.114};  // luma weights of ITU-R BT.601

double clamped(const std::optional<double>& value, double initial, double low, double high) {
    const double given = value.value_or(initial);
    return std::isfinite(given) ? std::clamp(given, low, high) : initial;
}

Output output_of(const std::optional<int>& choice) {
    const int number = choice.value_or(0);
    return number > 0 && number <= static_cast<int>(Output::kOutside) ? static_cast<Output>(number)
                                                                      : Output::kRecoloured;
}

double dot(const Vec3& weights, const float* rgb) {
    return weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2];
}

bool finite(const float* rgb) {
    return std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]);
}

/// Whether a channel is infinite and none is NaN: infinities count as outside, NaNs do not.
bool infinite(const float* rgb) {
    const auto is_infinite = [](float c) { return std::isinf(c); };
    return std::none_of(rgb, rgb + 3, [](float c) { return std::isnan(c); }) &&
           std::any_of(rgb, rgb + 3, is_infinite);
}

/// Rows of float pixels.
struct Rows {
    const float* source;
    float* result;
    std::size_t pixels;
    std::size_t channels;
    bool premultiplied;
};

/// Restores the source's lightness by adding the same amount to each channel. Differences between
/// channels, and with them hue, stay as edited.
void keep_lightness(const Rows& rows, const OutputSettings& settings) {
    for (std::size_t i = 0; i < rows.pixels; ++i) {
        const float* from = rows.source + i * rows.channels;
        float* to = rows.result + i * rows.channels;
        if (!finite(to)) continue;
        const double lost =
            settings.keep * (dot(settings.lightness, from) - dot(settings.lightness, to));
        if (lost == 0) continue;
        for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(to[c] + lost);
    }
}

/// `mask` multiplies `mix` for each pixel; an empty mask counts as 1.
void mix_in_source(const Rows& rows, double mix, const std::vector<float>& mask) {
    for (std::size_t i = 0; i < rows.pixels * rows.channels; ++i) {
        const float from = rows.source[i];
        float& to = rows.result[i];
        if (from == to) continue;
        const double share = mask.empty() ? mix : mix * mask[i / rows.channels];
        to = std::isfinite(from) && std::isfinite(to)
                 ? static_cast<float>(from + share * (static_cast<double>(to) - from))
                 : from;
    }
}

/// Unpremultiplied colours in the palette's code values: (pixels, 3); NaN where alpha is 0.
std::vector<float> straight_colours(const Rows& rows, const ColourConversion* conversion) {
    std::vector<float> straight(rows.pixels * 3);
    for (std::size_t i = 0; i < rows.pixels; ++i) {
        const float* from = rows.source + i * rows.channels;
        const Vec3 seen = straight_colour(from, rows.premultiplied);
        float* colour = &straight[i * 3];
        for (std::size_t c = 0; c < 3; ++c) {
            const bool transparent = rows.premultiplied && from[3] == 0;
            colour[c] = transparent ? std::nanf("") : static_cast<float>(seen[c]);
        }
        if (!conversion || !finite(colour)) continue;
        const Vec3 converted = conversion->to_palette({colour[0], colour[1], colour[2]});
        for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<float>(converted[c]);
    }
    return straight;
}

/// The weight of one colour; `read` is the colour plus the weight. The smallest channel is the most
/// precise one; where it is large too, double precision is used.
double weight_of(const float* colour, const float* read, const Recolourer& reader) {
    const auto smaller = [](float a, float b) { return std::abs(a) < std::abs(b); };
    const std::ptrdiff_t c = std::min_element(colour, colour + 3, smaller) - colour;
    if (std::abs(colour[c]) < kLarge) return static_cast<double>(read[c]) - colour[c];
    const Vec3 exact = reader.displaced({colour[0], colour[1], colour[2]}, 1);
    return exact[static_cast<std::size_t>(c)] - colour[c];
}

/// The matte of one colour, 0 to 1; `read` is the colour plus what the reader adds.
double matte_of(const float* colour, const float* read, const Drawing& drawing) {
    const OutputSettings& settings = drawing.settings;
    if (settings.output == Output::kOutside && infinite(colour)) return 1;
    if (!finite(colour) || !finite(read)) return 0;
    if (settings.output == Output::kWeight) {
        return std::clamp(weight_of(colour, read, *drawing.reader), 0.0, 1.0);
    }
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const double away = 2.0 * colour[c] - read[c];
        square += away * away;
    }
    return std::clamp((std::sqrt(square) - kAtSurface) / settings.reach, 0.0, 1.0);
}

void draw_matte(const Rows& rows, const Drawing& drawing) {
    const std::vector<float> straight = straight_colours(rows, drawing.conversion.get());
    std::vector<float> read(straight.size());
    const auto width = static_cast<int>(rows.pixels);
    const auto stride = static_cast<std::ptrdiff_t>(straight.size() * sizeof(float));
    drawing.reader->apply({straight.data(), width, 1, 3, stride},
                          {read.data(), width, 1, 3, stride}, {});
    const bool in_alpha = drawing.settings.in_alpha && rows.channels == 4;
    for (std::size_t i = 0; i < rows.pixels; ++i) {
        const float* from = rows.source + i * rows.channels;
        float* to = rows.result + i * rows.channels;
        const double matte = matte_of(&straight[i * 3], &read[i * 3], drawing);
        if (rows.channels == 4) to[3] = from[3];
        const double alpha = rows.premultiplied ? from[3] : 1.0;
        for (std::size_t c = 0; c < 3; ++c) {
            to[c] = !in_alpha            ? static_cast<float>(alpha * matte)
                    : rows.premultiplied ? static_cast<float>(matte * from[c])
                                         : from[c];
        }
        if (in_alpha) to[3] = static_cast<float>(matte * from[3]);
    }
}

/// Draws the palette strip in row `y` of the picture, if the strip covers that row.
void draw_strip(float* row, int x1, int x2, int y, std::size_t channels, const Drawing& drawing) {
    const OfxRectI& picture = drawing.picture;
    const std::int64_t width = static_cast<std::int64_t>(picture.x2) - picture.x1;
    const std::int64_t height = static_cast<std::int64_t>(picture.y2) - picture.y1;
    const std::int64_t strip = std::max<std::int64_t>(2, height / kStripPart);
    const std::int64_t above = static_cast<std::int64_t>(y) - picture.y1;
    if (above < 0 || above >= strip || width <= 0) return;
    const std::vector<Vec3>& colours = above < strip / 2 ? drawing.edited : drawing.original;
    const auto count = static_cast<std::int64_t>(colours.size());
    for (int x = std::max(x1, picture.x1); x < std::min(x2, picture.x2); ++x) {
        const std::int64_t column = (static_cast<std::int64_t>(x) - picture.x1) * count / width;
        const Vec3& own = colours[static_cast<std::size_t>(column)];
        const Vec3 colour = drawing.conversion ? drawing.conversion->to_clip(own) : own;
        float* to = row + static_cast<std::size_t>(x - x1) * channels;
        for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(colour[c]);
        if (channels == 4) to[3] = 1;
    }
}

void draw_rows(const Rows& rows, const Drawing& drawing) {
    const OutputSettings& settings = drawing.settings;
    if (settings.is_matte()) {
        draw_matte(rows, drawing);
    } else {
        RecolourOptions options;
        options.strength = settings.strength;
        options.premultiplied = rows.premultiplied;
        options.threads = 1;  // the rows are already shared among the host's threads
        const auto width = static_cast<int>(rows.pixels);
        const auto channels = static_cast<int>(rows.channels);
        const auto stride =
            static_cast<std::ptrdiff_t>(rows.pixels * rows.channels * sizeof(float));
        const ConstImageView from{rows.source, width, 1, channels, stride};
        const ImageView to{rows.result, width, 1, channels, stride};
        options.conversion = drawing.conversion.get();
        if (drawing.edit) {
            drawing.edit->apply(from, to, options);
        } else if (rows.result != rows.source) {
            std::copy_n(rows.source, rows.pixels * rows.channels, rows.result);
        }
        if (settings.keep > 0) keep_lightness(rows, settings);
    }
    if (settings.mix < 1) mix_in_source(rows, settings.mix, {});
}

/// The mask as values 0 to 1, row by row; 0 outside the mask's image.
std::vector<float> mask_of(const Image& mask, const OfxRectI& rows) {
    const auto width = static_cast<std::size_t>(rows.x2 - rows.x1);
    std::vector<float> shares(width * static_cast<std::size_t>(rows.y2 - rows.y1));
    const OfxRectI covered = intersect(rows, mask.bounds);
    if (is_empty(covered)) return shares;
    const auto channels = static_cast<std::size_t>(mask.channels);
    std::vector<float> numbers(static_cast<std::size_t>(covered.x2 - covered.x1) * channels);
    for (int y = covered.y1; y < covered.y2; ++y) {
        read_floats(mask, {covered.x1, y, covered.x2, y + 1}, numbers.data());
        float* to = &shares[static_cast<std::size_t>(y - rows.y1) * width +
                            static_cast<std::size_t>(covered.x1 - rows.x1)];
        for (std::size_t i = channels - 1; i < numbers.size(); i += channels) {
            const float share = numbers[i];
            *to++ = share > 0 ? std::min(share, 1.0f) : 0.0f;
        }
    }
    return shares;
}

}  // namespace

void define_output_params(ParamDefiner& define) {
    define.begin_group("outputs", "Output");
    define.choice({kParamOutput, "Output",
                   "Recoloured: the graded picture. Weight of a handle: a soft key that follows "
                   "one palette colour through time. Palette: the graded picture with this frame's "
                   "palette at the bottom, original colours above and new colours below. Outside: "
                   "a matte of the colours outside the palette."},
                  {"Recoloured", "Weight of a handle", "Palette", "Outside"});
    define.integer({kParamWeightOf, "Handle",
                    "The handle for Weight of a handle: 2 is the handle of Use 2 below."},
                   {1, 1, 100000, 1, 32});
    define.choice(
        {kParamMatteIn, "Matte in",
         "Picture: outputs the matte (Weight of a handle or Outside) as a grey picture. Alpha: "
         "keeps the picture's colours and multiplies its alpha (1 if opaque) by the matte."},
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
    define.choice({kParamPictureIn, "Picture is in",
                   "The node's input colour space. Input space: the analysed clip's code values. "
                   "Palette space: the palette's code values, such as ACEScct, for hosts that "
                   "convert themselves. Without a conversion in the sidecar both are the same. "
                   "Scene-linear: linear light, for a palette in sRGB, Rec.709 or another display "
                   "encoding. The handles' colours are then linear too."},
                  {"Input space", "Palette space", "Scene-linear"});
    define.number({kParamMix, "Mix", "Blends from the source (0) to the output (1)."},
                  {1, 0, 1, 0, 1}, 0.01, 3, true);
    define.end_group();
}

OutputSettings output_settings_at(const Params& params, OfxTime time) {
    OutputSettings settings;
    settings.output = output_of(params.int_at(kParamOutput, time));
    settings.weight_of = params.int_at(kParamWeightOf, time).value_or(1);
    settings.in_alpha = params.int_at(kParamMatteIn, time).value_or(0) == 1;
    // Some hosts do not keep a parameter inside its range.
    settings.reach = clamped(params.double_at(kParamOutsideReach, time), 0.05, 1e-4, 100);
    settings.strength = clamped(params.double_at(kParamStrength, time), 1, 0, 1);
    settings.keep = clamped(params.double_at(kParamKeepLightness, time), 0, 0, 1);
    const int of = params.int_at(kParamLightnessOf, time).value_or(0);
    constexpr int spaces = static_cast<int>(std::size(kLightnessOf));
    settings.own_lightness = of < 1 || of > spaces + 1;
    if (!settings.own_lightness && settings.keep > 0) {
        settings.lightness = of > spaces ? kRec601 : luminance_weights(kLightnessOf[of - 1]);
    }
    settings.in_palette_space = params.int_at(kParamPictureIn, time).value_or(0) == 1;
    settings.scene_linear = params.int_at(kParamPictureIn, time).value_or(0) == 2;
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
    settings.output = output_of(params.int_now(kParamOutput));
    if (!settings.is_matte() || params.int_now(kParamMatteIn).value_or(0) != 1) return;
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

void draw(const Image& in, const Image& out, const OfxRectI& area, const Drawing& drawing) {
    const OutputSettings& settings = drawing.settings;
    const OfxRectI covered = intersect(area, in.bounds);
    clear_around(out, area, covered);
    if (is_empty(covered)) return;
    const bool edit_alone = settings.output == Output::kRecoloured && settings.keep == 0 &&
                            settings.mix == 1 && !drawing.mask;
    if (edit_alone && in.depth == Depth::kFloat) {
        RecolourOptions options;
        options.strength = settings.strength;
        options.premultiplied = in.premultiplied;
        options.conversion = drawing.conversion.get();
        const int width = covered.x2 - covered.x1, height = covered.y2 - covered.y1;
        drawing.edit->apply({reinterpret_cast<const float*>(in.at(covered.x1, covered.y1)), width,
                             height, in.channels, in.row_bytes},
                            {reinterpret_cast<float*>(out.at(covered.x1, covered.y1)), width,
                             height, out.channels, out.row_bytes},
                            options);
        return;
    }
    const auto channels = static_cast<std::size_t>(in.channels);
    const std::size_t row = static_cast<std::size_t>(covered.x2 - covered.x1) * channels;
    const std::size_t most = kChunkFloats / (edit_alone ? 1 : 2);
    const int rows_at_once = static_cast<int>(std::max<std::size_t>(1, most / row));
    std::vector<float> source, result;
    for (int y = covered.y1; y < covered.y2; y += rows_at_once) {
        const OfxRectI rows = {covered.x1, y, covered.x2, std::min(y + rows_at_once, covered.y2)};
        const std::size_t count = row * static_cast<std::size_t>(rows.y2 - rows.y1);
        source.resize(count);
        if (!edit_alone) result.resize(count);
        float* const drawn = edit_alone ? source.data() : result.data();
        read_floats(in, rows, source.data());
        if (in.opaque && settings.is_matte() && settings.in_alpha) {
            for (std::size_t i = channels - 1; i < count; i += channels) source[i] = 1;
        }
        const Rows pixels{source.data(), drawn, count / channels, channels, in.premultiplied};
        draw_rows(pixels, drawing);
        for (int r = rows.y1; settings.output == Output::kPalette && r < rows.y2; ++r) {
            draw_strip(drawn + row * static_cast<std::size_t>(r - rows.y1), rows.x1, rows.x2, r,
                       channels, drawing);
        }
        if (drawing.mask) mix_in_source(pixels, 1, mask_of(*drawing.mask, rows));
        write_floats(drawn, out, rows);
    }
}

}  // namespace palette4d::node
