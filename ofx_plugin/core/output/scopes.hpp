// What waveform, parade, vectorscope and histogram show of a picture, as counts of pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "recolour/recolour_image.hpp"

namespace palette4d {

/// Levels of 8-bit code values, with kBelow of them below black and as many above white, so that
/// excursions are seen; what lies beyond is counted at the last level.
constexpr int kScopeBelow = 16, kScopeLevels = 256 + 2 * kScopeBelow;
/// Bins of the vectorscope along each axis. Its middle, bin 128, is grey; at zoom 1 its rim is the
/// chroma of ±0.5 that Rec.709 can encode.
constexpr int kScopeVectors = 257;
/// Luma (Y' of Rec.709), red, green, blue.
constexpr int kScopeTraces = 4;

struct ScopeCounts {
    int columns = 0;
    /// (columns, kScopeTraces, kScopeLevels).
    std::vector<std::uint32_t> waveform;
    /// (kScopeVectors, kScopeVectors): rows are Cr from the highest down, columns Cb.
    std::vector<std::uint32_t> vectors;
};

/// Counts the pixels of a picture of display code values. Pixels with a NaN are left out. The
/// waveform has at most `columns` columns, and none that would stay empty. `zoom` enlarges the
/// vectorscope; `threads` as in RecolourOptions.
ScopeCounts count_scopes(const ConstImageView& picture, int columns, double zoom, int threads);

}  // namespace palette4d
