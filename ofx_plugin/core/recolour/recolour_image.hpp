// The one path from an image to its recoloured copy. Threads share the rows; colours are
// unpremultiplied, converted to the palette's space, displaced, and converted back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "convert/colour_conversion.hpp"
#include "model/alpha.hpp"
#include "model/picks.hpp"
#include "simd/instruction_set.hpp"

namespace palette4d {

/// A float32 image that the caller owns and has checked: `row_bytes` may be negative or padded,
/// `channels` is 3 or 4, interleaved (the fourth is alpha and is copied). An output has the size of
/// its input.
template <class Number, class Byte>
struct ImageOf {
    Number* data;
    int width, height, channels;
    std::ptrdiff_t row_bytes;

    Number* row(int y) const {
        return reinterpret_cast<Number*>(reinterpret_cast<Byte*>(data) + row_bytes * y);
    }
};
using ConstImageView = ImageOf<const float, const char>;
using ImageView = ImageOf<float, char>;

void copy_rows(const ConstImageView& in, const ImageView& out);

/// Where an image's pixels are in the clip's picture, which windows of picks need: the first one's
/// column and row in the whole picture, from its top left corner; from a row to the next one, 1 or
/// -1; and a pixel's width and height, in pixels of the clip.
struct ImagePlace {
    std::int64_t column, row;
    int step;
    double width, height;

    /// The same for a pixel whatever image it is in.
    Spot at(int x, int y) const {
        const auto down = row + static_cast<std::int64_t>(step) * y;
        return {static_cast<float>((static_cast<double>(column + x) + 0.5) * width),
                static_cast<float>((static_cast<double>(down) + 0.5) * height)};
    }
};

/// How exactly a colour's displacement is computed.
enum class Precision {
    /// Many colours at a time, in float where the error estimate allows it, else in double.
    /// Straight colours differ from kDouble by at most kSingleTolerance, plus half a unit in the
    /// last place. The tolerance scales with (largest difference between two vertices'
    /// displacements) * strength where that is above 1.
    kSingle,
    /// One colour at a time by PaletteBody, all in double: the reference for kSingle.
    kDouble,
};
inline constexpr double kSingleTolerance = 1e-4;

struct RecolourOptions {
    double strength = 1.0;       ///< 0 returns the input, 1 the edit; linear, not clamped
    bool premultiplied = false;  ///< RGBA only: divides colours by alpha first; alpha 0 passes
    int threads = 1;             ///< 0: one per processor
    Precision precision = Precision::kSingle;
    InstructionSet instructions = InstructionSet::kBest;  ///< of kSingle; the result is the same
    /// From the image's code values to the palette's; null where they are the same. Colours that
    /// the edit does not move keep their bits; others are converted in double.
    const ColourConversion* conversion = nullptr;
    std::optional<ImagePlace> place{};  ///< none: windows of picks do not count
};

/// How many colours of an apply() each method computed; copied colours are not counted.
struct RecolourCounts {
    long long single = 0;   ///< many at a time in float
    long long twofold = 0;  ///< many at a time in double
    long long one = 0;      ///< by PaletteBody

    RecolourCounts& operator+=(const RecolourCounts& other) {
        single += other.single;
        twofold += other.twofold;
        one += other.one;
        return *this;
    }
};

/// One thread's recolouring of rows of pixels in the palette's code values.
class RowWorker {
public:
    virtual ~RowWorker() = default;
    /// Adjacent pixels. `from` and `to` must stay valid until finish() returns; only then is all of
    /// it written. `spots` has where each pixel is; null: windows do not count.
    virtual void row(const float* from, float* to, int width, const Spot* spots) = 0;
    virtual void finish() = 0;
    virtual RecolourCounts counts() const = 0;
};

/// Whether the pixel can be recoloured: finite colours, and an alpha that can divide them.
inline bool recolourable(const float* pixel, bool premultiplied) {
    // NaN where a channel is not finite: 0 times infinity is NaN.
    return 0 * pixel[0] + 0 * pixel[1] + 0 * pixel[2] == 0 && (!premultiplied || divides(pixel[3]));
}
/// The pixel's colour, straight() where it is premultiplied.
Vec3 straight_colour(const float* pixel, bool premultiplied);

}  // namespace palette4d
