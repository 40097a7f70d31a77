#include "output/scopes.hpp"

#include <algorithm>
#include <mutex>

#include "threads/share_rows.hpp"

namespace palette4d {

namespace {

/// Rec.709's luma, and what scales B' - Y' and R' - Y' to ±0.5.
constexpr float kRed = 0.2126F, kGreen = 0.7152F, kBlue = 0.0722F;
constexpr float kCb = 1 / 1.8556F, kCr = 1 / 1.5748F;
constexpr int kMiddle = kScopeVectors / 2;
/// Columns of the waveform that a thread counts at once: their counts stay in its cache.
constexpr int kSlab = 16;

/// The bin nearest to a value, from 0 to `last`. Not for NaN.
int bin_of(float value, float scale, float offset, int last) {
    const float at = value * scale + (offset + 0.5F);
    return static_cast<int>(std::min(std::max(at, 0.0F), static_cast<float>(last)));
}

int level_of(float value) {
    return bin_of(value, 255.0F, static_cast<float>(kScopeBelow), kScopeLevels - 1);
}

/// The first pixel of each column of the waveform, and the picture's width.
std::vector<int> first_pixels(int columns, int width) {
    std::vector<int> result;
    for (std::int64_t column = 0; column <= columns; ++column) {
        result.push_back(static_cast<int>(column * width / columns));
    }
    return result;
}

void count_column(const ConstImageView& picture, int first, int last, const char* row,
                  float vector_scale, std::uint32_t* waveform, std::uint32_t* vectors) {
    const auto* pixel =
        reinterpret_cast<const float*>(row) + static_cast<std::ptrdiff_t>(first) * picture.channels;
    for (int x = first; x < last; ++x, pixel += picture.channels) {
        const float r = pixel[0], g = pixel[1], b = pixel[2];
        const float luma = kRed * r + kGreen * g + kBlue * b;
        if (!(luma == luma)) continue;  // NaN; so is the sum of both infinities
        ++waveform[level_of(luma)];
        ++waveform[kScopeLevels + level_of(r)];
        ++waveform[2 * kScopeLevels + level_of(g)];
        ++waveform[3 * kScopeLevels + level_of(b)];
        const float cb = (b - luma) * kCb, cr = (luma - r) * kCr;  // Cr grows upwards
        if (!(cb == cb) || !(cr == cr)) continue;
        const int across = bin_of(cb, vector_scale, kMiddle, kScopeVectors - 1);
        const int down = bin_of(cr, vector_scale, kMiddle, kScopeVectors - 1);
        ++vectors[down * kScopeVectors + across];
    }
}

}  // namespace

ScopeCounts count_scopes(const ConstImageView& picture, int columns, double zoom, int threads) {
    ScopeCounts result;
    const int wide = std::max(0, std::min(columns, picture.width));
    result.columns = wide;
    const std::size_t one = static_cast<std::size_t>(kScopeTraces) * kScopeLevels;
    result.waveform.assign(one * static_cast<std::size_t>(wide), 0);
    result.vectors.assign(static_cast<std::size_t>(kScopeVectors) * kScopeVectors, 0);
    if (wide == 0) return result;
    const float vector_scale = static_cast<float>(zoom * (kScopeVectors - 1));
    const std::vector<int> first = first_pixels(wide, picture.width);
    std::mutex adding;
    share_rows((wide + kSlab - 1) / kSlab, threads, [&](const NextRow& next) {
        std::vector<std::uint32_t> vectors(result.vectors.size(), 0);
        for (int slab = next(); slab >= 0; slab = next()) {
            const int end = std::min(wide, (slab + 1) * kSlab);
            for (int y = 0; y < picture.height; ++y) {
                const char* row = reinterpret_cast<const char*>(picture.data) +
                                  static_cast<std::ptrdiff_t>(y) * picture.row_bytes;
                for (int k = slab * kSlab; k < end; ++k) {
                    const auto column = static_cast<std::size_t>(k);
                    count_column(picture, first[column], first[column + 1], row, vector_scale,
                                 result.waveform.data() + one * column, vectors.data());
                }
            }
        }
        const std::lock_guard<std::mutex> alone(adding);
        for (std::size_t k = 0; k < vectors.size(); ++k) result.vectors[k] += vectors[k];
    });
    return result;
}

}  // namespace palette4d
