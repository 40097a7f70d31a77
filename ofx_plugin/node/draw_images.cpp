#include "draw_images.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palette4d::node {
namespace {

// Floats in one chunk of rows, source and result: small enough for the second-level cache.
constexpr std::size_t kChunkFloats = 32768;

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

bool is_aligned(const Image& image) {
    const auto place = reinterpret_cast<std::uintptr_t>(image.data);
    return (place | static_cast<std::uintptr_t>(image.row_bytes)) % alignof(float) == 0;
}

void draw(const Image& in, const Image& out, const OfxRectI& area, const NodeDrawing& drawing) {
    const DrawingOptions& options = drawing.options;
    const OfxRectI covered = intersect(area, in.bounds);
    clear_around(out, area, covered);
    if (is_empty(covered)) return;
    const bool edit_alone = drawing.edit_alone() && !drawing.mask;
    if (options.output == Output::kRecoloured && options.keep == 0 && options.mix == 1 &&
        !drawing.mask && in.depth == Depth::kFloat && is_aligned(in) && is_aligned(out)) {
        const int width = covered.x2 - covered.x1, height = covered.y2 - covered.y1;
        draw_edit({reinterpret_cast<const float*>(in.at(covered.x1, covered.y1)), width, height,
                   in.channels, in.row_bytes},
                  {reinterpret_cast<float*>(out.at(covered.x1, covered.y1)), width, height,
                   out.channels, out.row_bytes},
                  in.premultiplied, drawing, {covered.x1, covered.y1, width, 1});
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
        if (in.opaque && options.is_matte() && options.in_alpha) {
            for (std::size_t i = channels - 1; i < count; i += channels) source[i] = 1;
        }
        const Pixels pixels{source.data(),    drawn,
                            count / channels, channels,
                            in.premultiplied, {rows.x1, rows.y1, rows.x2 - rows.x1, 1}};
        draw_pixels(pixels, drawing);
        for (int r = rows.y1; options.output == Output::kPalette && r < rows.y2; ++r) {
            draw_strip(drawn + row * static_cast<std::size_t>(r - rows.y1), rows.x1, rows.x2, r,
                       channels, drawing);
        }
        if (drawing.mask) mix_in_source(pixels, 1, mask_of(*drawing.mask, rows));
        write_floats(drawn, out, rows);
    }
}

}  // namespace palette4d::node
