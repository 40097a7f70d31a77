#include "pixels.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace palette4d::node {
namespace {

int bytes_of_depth(const std::string& depth) {
    if (depth == kOfxBitDepthByte) return 1;
    if (depth == kOfxBitDepthShort || depth == kOfxBitDepthHalf) return 2;
    if (depth == kOfxBitDepthFloat) return 4;
    return 0;
}

int channels_of(const std::string& components) {
    if (components == kOfxImageComponentRGBA) return 4;
    if (components == kOfxImageComponentRGB) return 3;
    if (components == kOfxImageComponentAlpha) return 1;
    return 0;
}

std::string either(const Properties& image, const Properties& clip, const char* name) {
    if (auto value = image.get_string(name)) return *value;
    return clip.get_string(name).value_or("");
}

/// Adding it leaves a float of 0 to 255 no digits after the point, rounded as IEEE 754 does.
constexpr float kNoFraction = 12582912.0f;  // 1.5 * 2^23

/// To the nearest, halves to the even one: as `palette4d render` rounds.
std::uint8_t to_byte(float value) {
    // NaN fails both comparisons' opposites: it becomes 0.
    if (!(value > 0.0f)) return 0;
    if (value >= 1.0f) return 255;
    return static_cast<std::uint8_t>((value * 255.0f + kNoFraction) - kNoFraction);
}

}  // namespace

std::optional<Image> read_image(const Properties& image, const Properties& clip) {
    const auto data = image.get_pointer(kOfxImagePropData);
    const auto bounds = image.get_rect(kOfxImagePropBounds);
    const auto row_bytes = image.get_int(kOfxImagePropRowBytes);
    if (!data || !*data || !bounds || !row_bytes || is_empty(*bounds)) return std::nullopt;

    Image result;
    result.data = static_cast<char*>(*data);
    result.bounds = *bounds;
    result.definition = image.get_rect(kOfxImagePropRegionOfDefinition).value_or(*bounds);
    if (is_empty(result.definition)) result.definition = *bounds;
    result.row_bytes = *row_bytes;
    const std::string depth = either(image, clip, kOfxImageEffectPropPixelDepth);
    result.depth = depth == kOfxBitDepthByte    ? Depth::kByte
                   : depth == kOfxBitDepthFloat ? Depth::kFloat
                                                : Depth::kOther;
    result.channels = channels_of(either(image, clip, kOfxImageEffectPropComponents));
    result.pixel_bytes = bytes_of_depth(depth) * result.channels;
    if (result.channels == 4) {
        const std::string alpha = either(image, clip, kOfxImageEffectPropPreMultiplication);
        result.premultiplied = alpha == kOfxImagePreMultiplied;
        result.opaque = alpha == kOfxImageOpaque;
    }

    const std::int64_t width = static_cast<std::int64_t>(bounds->x2) - bounds->x1;
    const std::int64_t stride = result.row_bytes < 0 ? -result.row_bytes : result.row_bytes;
    const bool one_row = static_cast<std::int64_t>(bounds->y2) - bounds->y1 == 1;
    if (result.pixel_bytes == 0 || (stride < width * result.pixel_bytes && !one_row)) {
        return std::nullopt;
    }
    return result;
}

OfxRectI intersect(const OfxRectI& a, const OfxRectI& b) {
    return {std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2), std::min(a.y2, b.y2)};
}

bool is_empty(const OfxRectI& rect) { return rect.x1 >= rect.x2 || rect.y1 >= rect.y2; }

void read_floats(const Image& image, const OfxRectI& area, float* to) {
    const std::size_t row =
        static_cast<std::size_t>(area.x2 - area.x1) * static_cast<std::size_t>(image.channels);
    for (int y = area.y1; y < area.y2; ++y, to += row) {
        if (image.depth == Depth::kFloat) {
            std::memcpy(to, image.at(area.x1, y), row * sizeof(float));
            continue;
        }
        const auto* from = reinterpret_cast<const std::uint8_t*>(image.at(area.x1, y));
        for (std::size_t i = 0; i < row; ++i) to[i] = static_cast<float>(from[i]) / 255.0f;
    }
}

void write_floats(const float* from, const Image& image, const OfxRectI& area) {
    const std::size_t row =
        static_cast<std::size_t>(area.x2 - area.x1) * static_cast<std::size_t>(image.channels);
    for (int y = area.y1; y < area.y2; ++y, from += row) {
        if (image.depth == Depth::kFloat) {
            std::memcpy(image.at(area.x1, y), from, row * sizeof(float));
            continue;
        }
        auto* bytes = reinterpret_cast<std::uint8_t*>(image.at(area.x1, y));
        for (std::size_t i = 0; i < row; ++i) bytes[i] = to_byte(from[i]);
    }
}

void clear_around(const Image& out, const OfxRectI& area, const OfxRectI& covered) {
    if (is_empty(covered)) {
        clear(out, area);
        return;
    }
    clear(out, {area.x1, area.y1, area.x2, covered.y1});
    clear(out, {area.x1, covered.y2, area.x2, area.y2});
    clear(out, {area.x1, covered.y1, covered.x1, covered.y2});
    clear(out, {covered.x2, covered.y1, area.x2, covered.y2});
}

bool same_format(const Image& a, const Image& b) {
    return a.depth == b.depth && a.channels == b.channels && a.pixel_bytes == b.pixel_bytes;
}

void clear(const Image& out, const OfxRectI& area) {
    if (is_empty(area)) return;
    const std::size_t bytes =
        static_cast<std::size_t>(area.x2 - area.x1) * static_cast<std::size_t>(out.pixel_bytes);
    for (int y = area.y1; y < area.y2; ++y) std::memset(out.at(area.x1, y), 0, bytes);
}

void copy(const Image& in, const Image& out, const OfxRectI& area) {
    const OfxRectI covered = intersect(area, in.bounds);
    clear_around(out, area, covered);
    if (is_empty(covered)) return;
    const std::size_t bytes = static_cast<std::size_t>(covered.x2 - covered.x1) *
                              static_cast<std::size_t>(out.pixel_bytes);
    for (int y = covered.y1; y < covered.y2; ++y) {
        std::memmove(out.at(covered.x1, y), in.at(covered.x1, y), bytes);
    }
}

}  // namespace palette4d::node
