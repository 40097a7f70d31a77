#include "pixels.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace palette4d::node {
namespace {

std::optional<Depth> depth_of(const std::string& depth) {
    if (depth == kOfxBitDepthByte) return Depth::kByte;
    if (depth == kOfxBitDepthShort) return Depth::kShort;
    if (depth == kOfxBitDepthHalf) return Depth::kHalf;
    if (depth == kOfxBitDepthFloat) return Depth::kFloat;
    return std::nullopt;
}

int bytes_of(Depth depth) { return depth == Depth::kByte ? 1 : depth == Depth::kFloat ? 4 : 2; }

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

/// Adding this to a float of 0 to 65535 removes the fraction, with the rounding of IEEE 754.
constexpr float kNoFraction = 12582912.0f;  // 1.5 * 2^23

/// To the nearest integer, ties to even, as `palette4d render` rounds. NaN becomes 0.
template <class Integer>
Integer to_integer(float value) {
    constexpr Integer largest = std::numeric_limits<Integer>::max();
    if (!(value > 0.0f)) return 0;
    if (value >= 1.0f) return largest;
    return static_cast<Integer>((value * static_cast<float>(largest) + kNoFraction) - kNoFraction);
}

std::uint32_t bits_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

float float_of(std::uint32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// IEEE 754 binary16. Every half, even a NaN with payload, returns with its own bits.
float from_half(std::uint16_t half) {
    const std::uint32_t sign = (half & 0x8000u) << 16, exponent = half >> 10 & 31u;
    const std::uint32_t fraction = half & 0x3ffu;
    if (exponent == 31) return float_of(sign | 0x7f800000u | fraction << 13);
    if (exponent > 0) return float_of(sign | (exponent + 112) << 23 | fraction << 13);
    const float magnitude = static_cast<float>(fraction) * 0x1p-24f;
    return sign ? -magnitude : magnitude;
}

std::uint16_t to_half(float value) {
    const std::uint32_t sign = bits_of(value) >> 16 & 0x8000u, size = bits_of(value) & 0x7fffffffu;
    std::uint32_t half;
    if (size > 0x7f800000u) {
        half = 0x7c00u | std::max(1u, size >> 13 & 0x3ffu);
    } else if (size >= 0x477ff000u) {
        half = 0x7c00u;  // 65520 and above round to infinity
    } else if (size < 0x38800000u) {
        // At 0.5, a float's last place equals the step of halves below 2^-14.
        half = bits_of(float_of(size) + 0.5f) - bits_of(0.5f);
    } else {
        half = (size + 0xfffu + (size >> 13 & 1u) - (112u << 23)) >> 13;
    }
    return static_cast<std::uint16_t>(sign | half);
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
    const auto depth = depth_of(either(image, clip, kOfxImageEffectPropPixelDepth));
    if (!depth) return std::nullopt;
    result.depth = *depth;
    result.channels = channels_of(either(image, clip, kOfxImageEffectPropComponents));
    result.pixel_bytes = bytes_of(*depth) * result.channels;
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

namespace {

/// Calls each(place) for the values of an area's rows. Hosts may put rows at any byte, so that a
/// place may not be read as a number.
template <class Number, class Each>
void each_place(const Image& image, const OfxRectI& area, Each each) {
    const std::size_t row =
        static_cast<std::size_t>(area.x2 - area.x1) * static_cast<std::size_t>(image.channels);
    for (int y = area.y1; y < area.y2; ++y) {
        auto* place = reinterpret_cast<unsigned char*>(image.at(area.x1, y));
        for (std::size_t i = 0; i < row; ++i, place += sizeof(Number)) each(place);
    }
}

/// Sets `to` to what `convert` makes of each of an area's values, of type `Number`.
template <class Number, class Convert>
void read_numbers(const Image& image, const OfxRectI& area, float* to, Convert convert) {
    each_place<Number>(image, area, [&](const unsigned char* place) {
        Number number;
        std::memcpy(&number, place, sizeof number);
        *to++ = convert(number);
    });
}

template <class Number, class Convert>
void write_numbers(const float* from, const Image& image, const OfxRectI& area, Convert convert) {
    each_place<Number>(image, area, [&](unsigned char* place) {
        const Number number = convert(*from++);
        std::memcpy(place, &number, sizeof number);
    });
}

}  // namespace

void read_floats(const Image& image, const OfxRectI& area, float* to) {
    switch (image.depth) {
        case Depth::kByte:
            return read_numbers<std::uint8_t>(
                image, area, to, [](std::uint8_t n) { return static_cast<float>(n) / 255.0f; });
        case Depth::kShort:
            return read_numbers<std::uint16_t>(
                image, area, to, [](std::uint16_t n) { return static_cast<float>(n) / 65535.0f; });
        case Depth::kHalf:
            return read_numbers<std::uint16_t>(image, area, to, from_half);
        case Depth::kFloat:
            return read_numbers<float>(image, area, to, [](float n) { return n; });
    }
}

void write_floats(const float* from, const Image& image, const OfxRectI& area) {
    switch (image.depth) {
        case Depth::kByte:
            return write_numbers<std::uint8_t>(from, image, area, to_integer<std::uint8_t>);
        case Depth::kShort:
            return write_numbers<std::uint16_t>(from, image, area, to_integer<std::uint16_t>);
        case Depth::kHalf:
            return write_numbers<std::uint16_t>(from, image, area, to_half);
        case Depth::kFloat:
            return write_numbers<float>(from, image, area, [](float n) { return n; });
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
