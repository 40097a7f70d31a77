// Colour statistics of a frame: pixels are collected in cells, and a bounded number of colours
// represents them all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "fit/colour_sample.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// Colours of a frame, each with the number of pixels it represents.
struct ColourBins {
    std::vector<std::uint64_t> keys;  ///< their cells (`ColourCells`)
    std::vector<Vec3> rgb;
    std::vector<double> counts;
};

/// Rows of interleaved samples, `row_bytes` apart (negative for upside-down images).
template <class Sample>
struct Rows {
    const Sample* data;
    int width, height, channels;
    std::ptrdiff_t row_bytes;
};

/// How to convert Y'CbCr samples of 8 to 16 bits to R'G'B' (ITU-T H.273, section 8.3).
struct LumaChroma {
    double red, blue;  ///< weights in luma, K_R and K_B
    int bits;
    bool full_range;
};

/// Collects a frame's pixels, given in strips of any height, row by row.
///
/// 8-bit samples are counted by their exact colour. All others go into cells 1/255 wide between 0
/// and 1; beyond 1 cells widen in proportion. Each cell keeps the mean of its pixels. Memory is
/// bounded: above a million cells, cells are merged eight to one. Pixels that are not finite do not
/// count, nor do those with alpha below 1/255, invisible in 8 bit. A frame has samples of one kind
/// and 3 or 4 channels; otherwise throws std::invalid_argument.
class ColourBinner {
public:
    ColourBinner() = default;

    /// Colours are value / 255, divided by alpha when premultiplied.
    void add(const Rows<std::uint8_t>& rows, bool premultiplied);
    /// Samples whose upper `bits` bits hold the value; colours are value / its maximum.
    void add(const Rows<std::uint16_t>& rows, int bits, bool premultiplied);
    void add(const Rows<float>& rows, bool premultiplied);
    /// Three planes of one size (one channel each); colours are clamped to 0..1.
    void add_luma_chroma(const Rows<std::uint8_t> (&planes)[3], const LumaChroma& how);
    void add_luma_chroma(const Rows<std::uint16_t> (&planes)[3], const LumaChroma& how);
    /// Colours with counts, such as those of other bins. Throws std::invalid_argument unless all
    /// are finite and all counts positive.
    void add_colours(const std::vector<Vec3>& rgb, const std::vector<double>& counts);

    double pixels() const { return pixels_; }            ///< that count
    double ignored() const { return ignored_; }          ///< that do not count
    double transparent() const { return transparent_; }  ///< ignored because of their alpha

    /// At most `most` colours that represent the frame (`sample_colours`); then clears the frame.
    ColourBins take(std::size_t most);
    /// Clears the frame and keeps the memory for the next one.
    void clear();

private:
    enum class Kind { none, codes, luma_chroma, means };
    struct Mean {
        double sum[3];
        double count;
        Vec3 colour() const { return {sum[0] / count, sum[1] / count, sum[2] / count}; }
    };
    struct Free {
        void operator()(void* p) const;
    };

    void begin(Kind kind);
    template <class Sample>
    void add_planar(const Rows<Sample>& rows, int bits, bool premultiplied);
    void add_row(int width);
    void count_codes(std::size_t n);
    std::uint32_t index_of(std::uint64_t key);
    void widen();
    void clear_cells();
    Vec3 colour_of(std::uint32_t code) const;
    ColourBins sampled_codes(std::size_t most);
    ColourBins sampled_means(std::size_t most);
    template <class Use>
    void drain(Use use);

    Kind kind_ = Kind::none;
    LumaChroma how_{};
    double pixels_ = 0, ignored_ = 0, transparent_ = 0;
    /// Indexed by the Morton code of an 8-bit colour: its pixel count, or its mean's index plus 1.
    std::unique_ptr<std::uint32_t[], Free> table_;
    std::vector<std::uint8_t> touched_;  ///< blocks of the table that are not all 0
    int shift_ = 0;                      ///< bits by which the cells have been merged
    std::vector<std::uint64_t> keys_;    ///< cells of the means
    std::vector<Mean> means_;
    std::unordered_map<std::uint64_t, std::uint32_t> outside_;  ///< means beyond 0..1, by key
    ColourCells drained_;
    std::vector<float> row_[3];
    std::vector<std::uint32_t> codes_;
    std::vector<std::int32_t> cells_;
};

/// At most `most` of the bins, each with the pixels of its neighbourhood.
ColourBins thin(ColourBins bins, std::size_t most);

}  // namespace palette4d
