#include "fit/colour_bins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "model/alpha.hpp"
#include "model/vec3.hpp"

namespace palette4d {
namespace {

constexpr int kBlockBits = 9;  // of a key; the table is read and cleared in blocks
constexpr std::size_t kBlock = std::size_t{1} << kBlockBits;
constexpr std::uint32_t kMiddle = 0b111000000;  // of a block: cell 4 of 8 in all three directions
constexpr int kCodeBits = 24;
constexpr std::size_t kCodes = std::size_t{1} << kCodeBits;
constexpr std::size_t kMostMeans = std::size_t{1} << 20;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
// Cell numbers have 16 bits. Zero is in the middle, and numbers 0 to 255 (8-bit colours) share
// their upper bits.
constexpr int kZero = 1 << 15;

/// Spreads the bits of x to every third bit, so that three numbers can be interleaved.
constexpr std::uint64_t spread(std::uint64_t x) {
    x = (x | x << 16) & 0x00FF0000FF0000FFull;
    x = (x | x << 8) & 0xF00F00F00F00F00Full;
    x = (x | x << 4) & 0x30C30C30C30C30C3ull;
    return (x | x << 2) & 0x9249249249249249ull;
}

constexpr std::uint64_t interleave(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    return spread(a) << 2 | spread(b) << 1 | spread(c);
}

constexpr std::uint64_t kUnitCube = interleave(kZero, kZero, kZero);

std::uint8_t gather(std::uint32_t code) {
    std::uint32_t x = code & 0x00249249u;
    x = (x | x >> 2) & 0x000C30C3u;
    x = (x | x >> 4) & 0x0000F00Fu;
    return static_cast<std::uint8_t>(x | x >> 8);
}

/// Morton codes of one channel's 8-bit values.
struct Spread {
    std::uint32_t of[3][256]{};
    constexpr Spread() {
        for (std::uint32_t v = 0; v < 256; ++v)
            for (int c = 0; c < 3; ++c) of[c][v] = static_cast<std::uint32_t>(spread(v)) << (2 - c);
    }
};
constexpr Spread kSpread;

/// The cell number of a finite value: cells are 1/255 wide up to 1, and widen in proportion beyond.
std::uint64_t cell_number(double x) {
    const double size = std::abs(x) * 255;
    const double n = size < 255.5 ? size : 255 * (1 + std::log(size / 255));
    return static_cast<std::uint64_t>(kZero + static_cast<int>(std::floor((x < 0 ? -n : n) + 0.5)));
}

std::uint64_t key_of(const Vec3& rgb) {
    return interleave(cell_number(rgb[0]), cell_number(rgb[1]), cell_number(rgb[2]));
}

template <class Sample>
const Sample* row_of(const Rows<Sample>& rows, int y) {
    return reinterpret_cast<const Sample*>(reinterpret_cast<const char*>(rows.data) +
                                           static_cast<std::ptrdiff_t>(y) * rows.row_bytes);
}

void check_channels(int channels) {
    if (channels != 3 && channels != 4)
        throw std::invalid_argument("found " + std::to_string(channels) +
                                    " channels, expected 3 (RGB) or 4 (RGBA)");
}

/// Y'CbCr to R'G'B' in single precision, with the same steps as the renderer's decoder.
class Matrix {
public:
    explicit Matrix(const LumaChroma& how)
        : red_(static_cast<float>(how.red)),
          blue_(static_cast<float>(how.blue)),
          green_(static_cast<float>(1 - how.red - how.blue)),
          from_red_(static_cast<float>(2 * (1 - how.red))),
          from_blue_(static_cast<float>(2 * (1 - how.blue))) {
        const auto unit = static_cast<float>(1 << (how.bits - 8));
        const auto largest = static_cast<float>((1 << how.bits) - 1);
        black_ = how.full_range ? 0 : 16 * unit;
        grey_ = 128 * unit;
        luma_ = how.full_range ? largest : 219 * unit;
        chroma_ = how.full_range ? largest : 224 * unit;
    }

    void operator()(float y, float cb, float cr, float* r, float* g, float* b) const {
        const float luma = (y - black_) / luma_;
        const float blue = (cb - grey_) / chroma_, red = (cr - grey_) / chroma_;
        *r = luma + from_red_ * red;
        *b = luma + from_blue_ * blue;
        *g = (luma - red_ * *r - blue_ * *b) / green_;
        for (float* x : {r, g, b}) *x = *x < 0 ? 0 : *x > 1 ? 1 : *x;
    }

private:
    float red_, blue_, green_, from_red_, from_blue_;
    float black_, grey_, luma_, chroma_;
};

template <class Sample>
void check_planes(const Rows<Sample> (&planes)[3], const LumaChroma& how) {
    for (const Rows<Sample>& p : planes)
        if (p.channels != 1 || p.width != planes[0].width || p.height != planes[0].height)
            throw std::invalid_argument("luma and chroma need three planes of one size");
    const int most = static_cast<int>(8 * sizeof(Sample));
    if (!(how.red > 0) || !(how.blue > 0) || !(how.red + how.blue < 1) || how.bits < 8 ||
        how.bits > most)
        throw std::invalid_argument("luma and chroma need weights of red and blue and 8 to " +
                                    std::to_string(most) + " bits");
}

/// The bins of a sample, with the colour of each chosen cell.
template <class Colour>
ColourBins sampled(const ColourCells& cells, const std::vector<Vec3>& places, std::size_t most,
                   Colour colour) {
    ColourSample sample = sample_colours(cells, places, most);
    ColourBins out;
    for (const std::size_t i : sample.chosen) {
        out.keys.push_back(cells.keys[i]);
        out.rgb.push_back(colour(i));
    }
    out.counts = std::move(sample.counts);
    return out;
}

}  // namespace

void ColourBinner::Free::operator()(void* p) const { std::free(p); }

void ColourBinner::begin(Kind kind) {
    if (kind_ != Kind::none && kind_ != kind)
        throw std::invalid_argument(
            "a frame's samples are of one kind; take() it or clear() first");
    if (!table_) {
        // calloc's zeroed pages take memory only once they are touched.
        table_.reset(static_cast<std::uint32_t*>(std::calloc(kCodes, sizeof(std::uint32_t))));
        if (!table_) throw std::bad_alloc();
        touched_.assign(kCodes / kBlock, 0);
    }
    kind_ = kind;
}

void ColourBinner::add(const Rows<std::uint8_t>& rows, bool premultiplied) {
    check_channels(rows.channels);
    if (rows.channels == 4 && premultiplied) return add_planar(rows, 8, true);
    begin(Kind::codes);
    codes_.resize(static_cast<std::size_t>(rows.width));
    for (int y = 0; y < rows.height; ++y) {
        const std::uint8_t* p = row_of(rows, y);
        std::uint32_t* const codes = codes_.data();
        std::size_t n = 0;
        for (int x = 0; x < rows.width; ++x, p += rows.channels) {
            codes[n] = kSpread.of[0][p[0]] | kSpread.of[1][p[1]] | kSpread.of[2][p[2]];
            n += rows.channels == 3 || p[3] > 0;
        }
        count_codes(n);
        ignored_ += rows.width - static_cast<double>(n);
        transparent_ += rows.width - static_cast<double>(n);
    }
}

void ColourBinner::add_luma_chroma(const Rows<std::uint8_t> (&planes)[3], const LumaChroma& how) {
    check_planes(planes, how);
    begin(Kind::luma_chroma);
    how_ = how;
    const auto width = static_cast<std::size_t>(planes[0].width);
    codes_.resize(width);
    for (int y = 0; y < planes[0].height; ++y) {
        const std::uint8_t *luma = row_of(planes[0], y), *blue = row_of(planes[1], y),
                           *red = row_of(planes[2], y);
        std::uint32_t* const codes = codes_.data();
        for (std::size_t x = 0; x < width; ++x)
            codes[x] = kSpread.of[0][luma[x]] | kSpread.of[1][blue[x]] | kSpread.of[2][red[x]];
        count_codes(width);
    }
}

/// Counts the first n of `codes_`. Two loops: their scattered stores overlap better than those of
/// one.
void ColourBinner::count_codes(std::size_t n) {
    const std::uint32_t* const codes = codes_.data();
    std::uint8_t* const touched = touched_.data();
    std::uint32_t* const table = table_.get();
    for (std::size_t i = 0; i < n; ++i) touched[codes[i] >> kBlockBits] = 1;
    for (std::size_t i = 0; i < n; ++i) ++table[codes[i]];
    pixels_ += static_cast<double>(n);
}

template <class Sample>
void ColourBinner::add_planar(const Rows<Sample>& rows, int bits, bool premultiplied) {
    check_channels(rows.channels);
    begin(Kind::means);
    const auto width = static_cast<std::size_t>(rows.width);
    for (std::vector<float>& channel : row_) channel.resize(width);
    const int unused = static_cast<int>(8 * sizeof(Sample)) - bits;
    const auto largest = static_cast<float>((std::uint64_t{1} << bits) - 1);
    const auto value = [&](Sample x) {
        if constexpr (std::is_floating_point_v<Sample>)
            return x;
        else
            return static_cast<float>(x >> unused) / largest;
    };
    for (int y = 0; y < rows.height; ++y) {
        const Sample* p = row_of(rows, y);
        for (std::size_t x = 0; x < width; ++x, p += rows.channels) {
            for (int c = 0; c < 3; ++c) row_[c][x] = value(p[c]);
            if (rows.channels == 3) continue;
            const float alpha = value(p[3]);
            if (alpha >= kLeastAlpha) {
                if (premultiplied)
                    for (std::vector<float>& channel : row_)
                        channel[x] = straight(channel[x], alpha);
            } else {
                row_[0][x] = kNone;
                ++transparent_;
            }
        }
        add_row(rows.width);
    }
}

void ColourBinner::add(const Rows<std::uint16_t>& rows, int bits, bool premultiplied) {
    if (bits < 1 || bits > 16)
        throw std::invalid_argument("found " + std::to_string(bits) + " bits, expected 1 to 16");
    add_planar(rows, bits, premultiplied);
}

void ColourBinner::add(const Rows<float>& rows, bool premultiplied) {
    add_planar(rows, 0, premultiplied);
}

void ColourBinner::add_luma_chroma(const Rows<std::uint16_t> (&planes)[3], const LumaChroma& how) {
    check_planes(planes, how);
    begin(Kind::means);
    const Matrix matrix(how);
    const auto width = static_cast<std::size_t>(planes[0].width);
    for (std::vector<float>& channel : row_) channel.resize(width);
    for (int y = 0; y < planes[0].height; ++y) {
        const std::uint16_t *luma = row_of(planes[0], y), *blue = row_of(planes[1], y),
                            *red = row_of(planes[2], y);
        float *r = row_[0].data(), *g = row_[1].data(), *b = row_[2].data();
        for (std::size_t x = 0; x < width; ++x)
            matrix(luma[x], blue[x], red[x], r + x, g + x, b + x);
        add_row(planes[0].width);
    }
}

void ColourBinner::add_colours(const std::vector<Vec3>& rgb, const std::vector<double>& counts) {
    if (rgb.size() != counts.size())
        throw std::invalid_argument("binning colours needs a count for each");
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        bool valid = counts[i] > 0 && std::isfinite(counts[i]) && finite(rgb[i]);
        for (int c = 0; valid && c < 3; ++c)
            valid = std::abs(rgb[i][c]) <= std::numeric_limits<float>::max();
        if (!valid)
            throw std::invalid_argument(
                "binning needs finite colours and positive, finite counts; colour " +
                std::to_string(i) + " is not, or too large");
    }
    begin(Kind::means);
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        Mean& mean = means_[index_of(key_of(rgb[i]) >> shift_) - 1];
        for (int c = 0; c < 3; ++c) mean.sum[c] += counts[i] * rgb[i][c];
        mean.count += counts[i];
        pixels_ += counts[i];
        if (means_.size() > kMostMeans) widen();
    }
}

/// Bins the row of colours in `row_`.
void ColourBinner::add_row(int width) {
    const auto n = static_cast<std::size_t>(width);
    const float *const r = row_[0].data(), *const g = row_[1].data(), *const b = row_[2].data();
    codes_.resize(n);
    cells_.resize(n);
    std::int32_t* const cells = cells_.data();
    for (std::size_t x = 0; x < n; ++x) {
        // The nearest 8-bit colour. Values without one, NaN included, count as outside.
        const float p = r[x] * 255 + 0.5f, q = g[x] * 255 + 0.5f, s = b[x] * 255 + 0.5f;
        const bool inside = (p >= 0) & (p < 256) & (q >= 0) & (q < 256) & (s >= 0) & (s < 256);
        const int i = static_cast<int>(inside ? p : 0), j = static_cast<int>(inside ? q : 0),
                  k = static_cast<int>(inside ? s : 0);
        cells[x] = inside ? i << 16 | j << 8 | k : -1;
    }
    std::uint32_t* const index = codes_.data();
    std::uint32_t* const table = table_.get();
    double counted = static_cast<double>(n);
    for (std::size_t x = 0; x < n; ++x) {
        if (cells[x] < 0) {
            const Vec3 rgb{r[x], g[x], b[x]};
            index[x] = finite(rgb) ? index_of(key_of(rgb) >> shift_) : 0;
            counted -= index[x] == 0;
            continue;
        }
        const std::uint32_t code =
            (kSpread.of[0][cells[x] >> 16] | kSpread.of[1][cells[x] >> 8 & 255] |
             kSpread.of[2][cells[x] & 255]) >>
            shift_;
        index[x] = table[code];
        if (index[x] == 0) index[x] = index_of((kUnitCube >> shift_) | code);
    }
    Mean* const means = means_.data();
    for (std::size_t x = 0; x < n; ++x) {
        if (index[x] == 0) continue;
        Mean& mean = means[index[x] - 1];
        mean.sum[0] += r[x];
        mean.sum[1] += g[x];
        mean.sum[2] += b[x];
        mean.count += 1;
    }
    pixels_ += counted;
    ignored_ += static_cast<double>(n) - counted;
    // With grain nearly every pixel has its own colour, so limit memory while rows are added.
    if (means_.size() > kMostMeans) widen();
}

/// The index of a cell's mean, plus 1, in the table or the map; adds a mean where there is none.
std::uint32_t ColourBinner::index_of(std::uint64_t key) {
    const bool inside = key << shift_ >> kCodeBits == kUnitCube >> kCodeBits;
    const auto code = static_cast<std::uint32_t>(key & ((kCodes >> shift_) - 1));
    std::uint32_t& index = inside ? table_[code] : outside_[key];
    if (index == 0) {
        if (inside) touched_[code >> kBlockBits] = 1;
        keys_.push_back(key);
        means_.push_back({{0, 0, 0}, 0});
        index = static_cast<std::uint32_t>(means_.size());
    }
    return index;
}

/// Merges cells eight to one until few enough are left.
void ColourBinner::widen() {
    while (means_.size() > kMostMeans / 2 && shift_ < kCodeBits) {
        std::vector<std::uint64_t> keys;
        std::vector<Mean> means;
        keys.swap(keys_);
        means.swap(means_);
        clear_cells();
        shift_ += 3;
        for (std::size_t i = 0; i < keys.size(); ++i) {
            Mean& wider = means_[index_of(keys[i] >> 3) - 1];
            for (int c = 0; c < 3; ++c) wider.sum[c] += means[i].sum[c];
            wider.count += means[i].count;
        }
    }
}

void ColourBinner::clear_cells() {
    for (std::size_t block = 0; block < touched_.size(); ++block)
        if (touched_[block]) std::fill_n(&table_[block * kBlock], kBlock, 0u);
    std::fill(touched_.begin(), touched_.end(), std::uint8_t{0});
    keys_.clear();
    means_.clear();
    outside_.clear();
}

void ColourBinner::clear() {
    clear_cells();
    drained_.keys.clear();
    drained_.counts.clear();
    kind_ = Kind::none;
    shift_ = 0;
    pixels_ = ignored_ = transparent_ = 0;
}

Vec3 ColourBinner::colour_of(std::uint32_t code) const {
    const auto channel = [&](int c) { return gather(code >> (2 - c)); };
    if (kind_ == Kind::codes) return {channel(0) / 255.0, channel(1) / 255.0, channel(2) / 255.0};
    float r, g, b;
    Matrix{how_}(channel(0), channel(1), channel(2), &r, &g, &b);
    return {r, g, b};
}

/// Calls use(code, value) for all nonzero entries of the table in order, and zeroes them.
template <class Use>
void ColourBinner::drain(Use use) {
    constexpr std::size_t kGroup = 4;  // most entries are 0: tested four at a time
    for (std::size_t block = 0; block < touched_.size(); ++block) {
        if (!touched_[block]) continue;
        touched_[block] = 0;
        const auto first = static_cast<std::uint32_t>(block * kBlock);
        for (std::uint32_t code = first; code < first + kBlock; code += kGroup) {
            std::uint32_t* const four = &table_[code];
            if (!(four[0] | four[1] | four[2] | four[3])) continue;
            for (std::uint32_t i = 0; i < kGroup; ++i)
                if (four[i]) use(code + i, four[i]);
            std::fill_n(four, kGroup, 0u);
        }
    }
}

/// Samples 8-bit codes: the table holds their counts.
ColourBins ColourBinner::sampled_codes(std::size_t most) {
    std::vector<Vec3> places;
    drain([&](std::uint32_t code, std::uint32_t count) {
        const std::uint32_t first = code & ~static_cast<std::uint32_t>(kBlock - 1);
        if (drained_.keys.empty() || drained_.keys.back() < first) {
            places.push_back(colour_of(first | kMiddle));
        }
        drained_.keys.push_back(code);
        drained_.counts.push_back(count);
    });
    return sampled(drained_, places, most, [&](std::size_t i) {
        return colour_of(static_cast<std::uint32_t>(drained_.keys[i]));
    });
}

/// Samples means: the table, and the map for colours beyond 0..1, hold their indices plus 1.
ColourBins ColourBinner::sampled_means(std::size_t most) {
    codes_.clear();  // reused for the order of the means
    const auto append = [&](std::uint32_t index) {
        drained_.keys.push_back(keys_[index - 1] << shift_);
        drained_.counts.push_back(means_[index - 1].count);
        codes_.push_back(index - 1);
    };
    std::vector<std::pair<std::uint64_t, std::uint32_t>> outside(outside_.begin(), outside_.end());
    std::sort(outside.begin(), outside.end());
    auto next = outside.begin();
    for (; next != outside.end() && next->first << shift_ < kUnitCube; ++next) append(next->second);
    drain([&](std::uint32_t, std::uint32_t index) { append(index); });
    for (; next != outside.end(); ++next) append(next->second);

    std::vector<Vec3> places;
    for (const std::size_t first : colour_blocks(drained_))
        if (first < codes_.size()) places.push_back(means_[codes_[first]].colour());
    return sampled(drained_, places, most,
                   [&](std::size_t i) { return means_[codes_[i]].colour(); });
}

ColourBins ColourBinner::take(std::size_t most) {
    ColourBins out;
    if (kind_ == Kind::codes || kind_ == Kind::luma_chroma)
        out = sampled_codes(most);
    else if (kind_ == Kind::means)
        out = sampled_means(most);
    clear();
    return out;
}

ColourBins thin(ColourBins bins, std::size_t most) {
    if (bins.keys.size() <= most) return bins;
    ColourCells cells{std::move(bins.keys), std::move(bins.counts)};
    const std::vector<std::size_t> blocks = colour_blocks(cells);
    std::vector<Vec3> places;
    for (std::size_t b = 0; b + 1 < blocks.size(); ++b) {
        const auto n = static_cast<double>(blocks[b + 1] - blocks[b]);
        Vec3 mean{0, 0, 0};
        for (std::size_t i = blocks[b]; i < blocks[b + 1]; ++i) mean = mean + 1 / n * bins.rgb[i];
        places.push_back(mean);
    }
    return sampled(cells, places, most, [&](std::size_t i) { return bins.rgb[i]; });
}

}  // namespace palette4d
