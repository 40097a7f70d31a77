// What the node and `palette4d render` draw for a frame: the recoloured picture, a matte made from
// the palette, or the picture with its palette. Both use this code, so that they agree to the bit.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "output/clean_up.hpp"
#include "recolour/recolour.hpp"
#include "recolour/recolour_image.hpp"

namespace palette4d {

/// Hosts save these numbers: never change them.
enum class Output { kRecoloured, kWeight, kPalette, kOutside, kPick };

struct DrawingOptions {
    Output output = Output::kRecoloured;
    bool in_alpha = false;    ///< mattes multiply alpha; else they are grey pictures
    double reach = 0.05;      ///< distance from the palette at which Outside is 1; above 0
    double strength = 1;      ///< 0 to 1
    double keep = 0;          ///< share of the source's lightness to keep, 0 to 1
    Vec3 lightness{0, 0, 0};  ///< weights of red, green and blue; they sum to 1
    double mix = 1;           ///< 0 the source, 1 the output
    double clean_up = 1;      ///< share of the filtered displacement of picks, 0 to 1

    /// The output is the source, whatever the other options are.
    bool passes() const { return mix == 0 || (output == Output::kRecoloured && strength == 0); }
    bool is_matte() const {
        return output == Output::kWeight || output == Output::kOutside || output == Output::kPick;
    }
};

/// What one frame draws. Read-only, so that threads share it.
struct Drawing {
    DrawingOptions options;
    /// The edit, whose picks are cleaned up; null where colours do not change.
    std::shared_ptr<const Recolourer> edit;
    /// For mattes: weight_reader(), surface_reader() or matte_at().
    std::shared_ptr<const Recolourer> reader;
    /// From the picture's code values to the palette's; null where they are equal.
    std::shared_ptr<const ColourConversion> conversion;
    /// For Output::kPalette: the slice's colours before and after the edit.
    std::vector<Vec3> original, edited;
    /// The bounds of the whole picture: windows of picks lie in it, and the strip at its bottom.
    Area picture{};
    /// From make_clean_up(); null: nothing is cleaned up.
    std::shared_ptr<const CleanUp> clean_up;

    /// Nothing but `edit` is drawn.
    bool edit_alone() const {
        return options.output == Output::kRecoloured && options.keep == 0 && options.mix == 1 &&
               !clean_up;
    }
};

/// Where rows of pixels lie in the plane.
struct RowPlace {
    int x, y;   ///< of the first pixel
    int width;  ///< of a row
    int step;   ///< from a row's y to the next one's: 1 or -1
};

/// Float pixels without gaps, with three or four channels.
struct Pixels {
    const float* source;
    float* result;  ///< may be the source where Drawing::edit_alone()
    std::size_t count;
    std::size_t channels;
    bool premultiplied;
    RowPlace place{};  ///< for Drawing::clean_up and windows of picks only
};

/// What the picks that are drawn and cleaned up are of; null where there are none.
std::shared_ptr<const Recolourer> cleaned_map(const Drawing& drawing);
/// The lines of the clip that a drawing's picks are of, for clean_up_cell().
double clip_lines(const Drawing& drawing);
/// The filter of a drawing, before CleanUp::prepare(); null where there is nothing to clean up.
std::shared_ptr<CleanUp> make_clean_up(const Drawing& drawing, CleanUp::Format format,
                                       const CleanUp::Place& place);
/// Draws the edit alone, row by row, whatever gaps are between rows; copies where there is no edit.
/// `in` and `out` have the same size and channels, and may be the same without Drawing::clean_up.
void draw_edit(const ConstImageView& in, const ImageView& out, bool premultiplied,
               const Drawing& drawing, const RowPlace& place);
/// Draws all but the strip of Output::kPalette. A pixel's result depends on that pixel, its place
/// and Drawing::clean_up alone.
void draw_pixels(const Pixels& pixels, const Drawing& drawing);
/// Draws the strip into a row, pixels x1 to x2 of row y, if the strip covers that row.
void draw_strip(float* row, int x1, int x2, int y, std::size_t channels, const Drawing& drawing);
/// Fades from the source (0) to the result (1). `mask` multiplies `mix` for each pixel; an empty
/// mask counts as 1.
void mix_in_source(const Pixels& pixels, double mix, const std::vector<float>& mask);

/// Draws a whole picture, whose first row is its top. `in` and `out` have the same size and
/// channels, and do not overlap. An empty drawing.picture is all of it, else what lies around is
/// overscan; its y counts from the last row upwards. `threads` as in RecolourOptions.
void draw_picture(const ConstImageView& in, const ImageView& out, Drawing drawing,
                  bool premultiplied, int threads);

}  // namespace palette4d
