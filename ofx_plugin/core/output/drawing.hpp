// What the node and `palette4d render` draw for a frame: the recoloured picture, a matte made from
// the palette, or the picture with its palette. Both use this code, so that they agree to the bit.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "recolour/recolour.hpp"
#include "recolour/recolour_image.hpp"

namespace palette4d {

/// Hosts save these numbers: never change them.
enum class Output { kRecoloured, kWeight, kPalette, kOutside };

struct DrawingOptions {
    Output output = Output::kRecoloured;
    bool in_alpha = false;    ///< mattes multiply alpha; else they are grey pictures
    double reach = 0.05;      ///< distance from the palette at which Outside is 1; above 0
    double strength = 1;      ///< 0 to 1
    double keep = 0;          ///< share of the source's lightness to keep, 0 to 1
    Vec3 lightness{0, 0, 0};  ///< weights of red, green and blue; they sum to 1
    double mix = 1;           ///< 0 the source, 1 the output

    /// The output is the source, whatever the other options are.
    bool passes() const { return mix == 0 || (output == Output::kRecoloured && strength == 0); }
    bool is_matte() const { return output == Output::kWeight || output == Output::kOutside; }
    /// The recoloured picture, which nothing is added to.
    bool edit_alone() const { return output == Output::kRecoloured && keep == 0 && mix == 1; }
};

/// A part of the plane of pixels; y counts upwards, and x2 and y2 are outside.
struct Area {
    int x1, y1, x2, y2;
};

/// What one frame draws. Read-only, so that threads share it.
struct Drawing {
    DrawingOptions options;
    /// The edit, exact or interpolated; null where colours do not change.
    std::shared_ptr<const ColourMap> edit;
    /// For mattes: weight_reader() or surface_reader().
    std::shared_ptr<const Recolourer> reader;
    /// From the picture's code values to the palette's; null where they are equal.
    std::shared_ptr<const ColourConversion> conversion;
    /// For Output::kPalette: the slice's colours before and after the edit, and the bounds of the
    /// whole picture, which has the strip at its bottom.
    std::vector<Vec3> original, edited;
    Area picture{};
};

/// Float pixels without gaps, with three or four channels.
struct Pixels {
    const float* source;
    float* result;  ///< may be the source where options.edit_alone()
    std::size_t count;
    std::size_t channels;
    bool premultiplied;
};

/// Draws the edit alone, row by row, whatever gaps are between rows; copies where there is no edit.
/// `in` and `out` have the same size and channels, and may be the same.
void draw_edit(const ConstImageView& in, const ImageView& out, bool premultiplied,
               const Drawing& drawing);
/// Draws all but the strip of Output::kPalette. A pixel's result depends on that pixel alone.
void draw_pixels(const Pixels& pixels, const Drawing& drawing);
/// Draws the strip into a row, pixels x1 to x2 of row y, if the strip covers that row.
void draw_strip(float* row, int x1, int x2, int y, std::size_t channels, const Drawing& drawing);
/// Fades from the source (0) to the result (1). `mask` multiplies `mix` for each pixel; an empty
/// mask counts as 1.
void mix_in_source(const Pixels& pixels, double mix, const std::vector<float>& mask);

/// Draws a whole picture, whose first row is its top. `in` and `out` have the same size and
/// channels, and do not overlap. Ignores drawing.picture; `threads` as in RecolourOptions.
void draw_picture(const ConstImageView& in, const ImageView& out, Drawing drawing,
                  bool premultiplied, int threads);

}  // namespace palette4d
