#include "output/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <thread>

#include "model/vec3.hpp"
#include "threads/share_rows.hpp"

namespace palette4d {
namespace {

/// Rows that draw_picture() draws at a time.
constexpr int kRowsAtOnce = 8;
/// Colours this near to the palette's surface count as inside: the surface is no more precise.
constexpr double kAtSurface = 1e-3;
/// Above this, a float has too few digits for the weight added to the colour.
constexpr float kLarge = 256;
constexpr int kStripPart = 8;  ///< the strip's height is 1/8 of the picture's

double dot(const Vec3& weights, const float* rgb) {
    return weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2];
}

bool finite_pixel(const float* rgb) {
    return std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]);
}

/// Whether a channel is infinite and none is NaN: infinities count as outside, NaNs do not.
bool infinite(const float* rgb) {
    const auto is_infinite = [](float c) { return std::isinf(c); };
    return std::none_of(rgb, rgb + 3, [](float c) { return std::isnan(c); }) &&
           std::any_of(rgb, rgb + 3, is_infinite);
}

/// Restores the source's lightness by adding the same amount to each channel. Differences between
/// channels, and with them hue, stay as edited.
void keep_lightness(const Pixels& pixels, const DrawingOptions& options) {
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const float* from = pixels.source + i * pixels.channels;
        float* to = pixels.result + i * pixels.channels;
        if (!finite_pixel(to)) continue;
        const double lost =
            options.keep * (dot(options.lightness, from) - dot(options.lightness, to));
        if (lost == 0) continue;
        for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(to[c] + lost);
    }
}

/// Straight colours in the palette's code values: (pixels, 3).
std::vector<float> straight_colours(const Pixels& pixels, const ColourConversion* conversion) {
    std::vector<float> straight(pixels.count * 3);
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const float* from = pixels.source + i * pixels.channels;
        const Vec3 seen = straight_colour(from, pixels.premultiplied);
        float* colour = &straight[i * 3];
        for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<float>(seen[c]);
        if (!conversion || !finite_pixel(colour)) continue;
        // Not of the rounded colour: GCC 12 leaves the rounding out of some channels.
        const Vec3 converted = conversion->to_palette(seen);
        for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<float>(converted[c]);
    }
    return straight;
}

/// The weight of one colour; `read` is the colour plus the weight. The smallest channel is the most
/// precise one; where it is large too, double precision is used.
double weight_of(const float* colour, const float* read, const Recolourer& reader,
                 const Spot* spot) {
    const auto smaller = [](float a, float b) { return std::abs(a) < std::abs(b); };
    const std::ptrdiff_t c = std::min_element(colour, colour + 3, smaller) - colour;
    if (std::abs(colour[c]) < kLarge) return static_cast<double>(read[c]) - colour[c];
    const Vec3 exact = reader.displaced({colour[0], colour[1], colour[2]}, 1, spot);
    return exact[static_cast<std::size_t>(c)] - colour[c];
}

/// The matte of one colour, 0 to 1; `read` is the colour plus what the reader adds, and `cleaned`
/// what cleaning up adds to that.
double matte_of(const float* colour, const float* read, const Spot* spot, float cleaned,
                const Drawing& drawing) {
    const DrawingOptions& options = drawing.options;
    if (options.output == Output::kOutside && infinite(colour)) return 1;
    if (!finite_pixel(colour) || !finite_pixel(read)) return 0;
    if (options.output != Output::kOutside) {
        return std::clamp(weight_of(colour, read, *drawing.reader, spot) + cleaned, 0.0, 1.0);
    }
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const double away = 2.0 * colour[c] - read[c];
        square += away * away;
    }
    return std::clamp((std::sqrt(square) - kAtSurface) / options.reach, 0.0, 1.0);
}

/// What apply() needs of a drawing to know where windows are.
std::optional<ImagePlace> place_of(const Drawing& drawing, const Recolourer& map,
                                   const RowPlace& place) {
    if (!map.picks().windows()) return std::nullopt;
    return image_place(drawing.picture, place.x, place.y, place.step, map.picks());
}

/// CleanUp::change() of all pixels; empty where it is 0 for all.
std::vector<float> changes_of(const Pixels& pixels, const Drawing& drawing, double own) {
    if (!drawing.clean_up) return {};
    const auto width = static_cast<std::size_t>(pixels.place.width);
    std::vector<float> changes(pixels.count * 3);
    bool some = false;
    int y = pixels.place.y;
    for (std::size_t at = 0; at < pixels.count; at += width, y += pixels.place.step) {
        some |= drawing.clean_up->change(pixels.source + at * pixels.channels, pixels.place.x, y,
                                         pixels.place.width, own, &changes[at * 3]);
    }
    if (!some) changes.clear();
    return changes;
}

void draw_matte(const Pixels& pixels, const Drawing& drawing) {
    const std::vector<float> straight = straight_colours(pixels, drawing.conversion.get());
    std::vector<float> read(straight.size());
    RecolourOptions options;
    options.place = place_of(drawing, *drawing.reader, pixels.place);
    const auto all = static_cast<int>(pixels.count);
    const int width = options.place ? pixels.place.width : all;
    const auto stride = static_cast<std::ptrdiff_t>(3 * sizeof(float)) * width;
    drawing.reader->apply({straight.data(), width, all / width, 3, stride},
                          {read.data(), width, all / width, 3, stride}, options);
    const std::vector<float> cleaned = changes_of(pixels, drawing, -drawing.options.clean_up);
    const bool in_alpha = drawing.options.in_alpha && pixels.channels == 4;
    for (std::size_t i = 0; i < pixels.count; ++i) {
        const float* from = pixels.source + i * pixels.channels;
        float* to = pixels.result + i * pixels.channels;
        const float change = cleaned.empty() ? 0.0f : cleaned[i * 3];
        const auto at = static_cast<int>(i);
        const Spot spot = options.place ? options.place->at(at % width, at / width) : Spot{};
        const double matte = matte_of(&straight[i * 3], &read[i * 3],
                                      options.place ? &spot : nullptr, change, drawing);
        if (pixels.channels == 4) to[3] = from[3];
        const double alpha = pixels.premultiplied ? from[3] : 1.0;
        for (std::size_t c = 0; c < 3; ++c) {
            to[c] = !in_alpha              ? static_cast<float>(alpha * matte)
                    : pixels.premultiplied ? static_cast<float>(matte * from[c])
                                           : from[c];
        }
        if (in_alpha) to[3] = static_cast<float>(matte * from[3]);
    }
}

/// What draw_cleaned() and draw_converted() take of the unfiltered displacement of picks: the edit
/// has all of it where the palette moves, and is not drawn where only picks move colours.
double own_share(const Drawing& drawing) {
    const double amount = drawing.clean_up->amount();
    return drawing.edit->palette_moves() ? -amount : 1 - amount;
}

/// Adds strength times `change`, times alpha where premultiplied, to a row of pixels. Channels that
/// do not move keep their bits, even a negative zero.
void add_steps(const std::vector<float>& change, bool premultiplied, float strength, int channels,
               float* to) {
    const std::size_t count = change.size();
    if (channels == 3) {
        for (std::size_t i = 0; i < count; ++i) {
            const float step = strength * change[i], moved = to[i] + step;
            to[i] = step != 0 ? moved : to[i];
        }
        return;
    }
    for (std::size_t i = 0; i < count; i += 3, to += channels) {
        const float by = premultiplied ? to[3] * strength : strength;
        for (std::size_t c = 0; c < 3; ++c) {
            const float step = by * change[i + c], moved = to[c] + step;
            to[c] = step != 0 ? moved : to[c];
        }
    }
}

/// The edit with Drawing::clean_up, without a conversion.
void draw_cleaned(const ConstImageView& in, const ImageView& out, bool premultiplied,
                  const Drawing& drawing, const RowPlace& place) {
    if (drawing.edit->palette_moves()) {
        RecolourOptions options;
        options.strength = drawing.options.strength;
        options.premultiplied = premultiplied;
        options.place = place_of(drawing, *drawing.edit, place);
        drawing.edit->apply(in, out, options);
    } else {
        copy_rows(in, out);
    }
    const double own = own_share(drawing);
    const auto strength = static_cast<float>(drawing.options.strength);
    std::vector<float> change(static_cast<std::size_t>(in.width) * 3);
    for (int y = 0; y < in.height; ++y) {
        const float* const from = in.row(y);
        if (!drawing.clean_up->change(from, place.x, place.y + place.step * y, in.width, own,
                                      change.data())) {
            continue;
        }
        add_steps(change, premultiplied, strength, in.channels, out.row(y));
    }
}

/// The same through a conversion: the steps are added to the palette's code values.
void draw_converted(const ConstImageView& in, const ImageView& out, bool premultiplied,
                    const Drawing& drawing, const RowPlace& place) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const ColourConversion& conversion = *drawing.conversion;
    const double own = own_share(drawing), strength = drawing.options.strength;
    const auto width = static_cast<std::size_t>(in.width);
    const auto channels = static_cast<std::size_t>(in.channels);
    std::vector<float> change(width * 3), before(width * 3), after(width * 3);
    RecolourOptions options;
    options.strength = strength;
    copy_rows(in, out);
    for (int y = 0; y < in.height; ++y) {
        const float* const from = in.row(y);
        const bool cleaned = drawing.clean_up->change(from, place.x, place.y + place.step * y,
                                                      in.width, own, change.data());
        if (!cleaned && !drawing.edit->palette_moves()) continue;
        if (!cleaned) std::fill(change.begin(), change.end(), 0.0f);
        const Pixels row{from, nullptr, width, channels, premultiplied};
        before = straight_colours(row, &conversion);
        after = before;
        if (drawing.edit->palette_moves()) {
            options.place = place_of(drawing, *drawing.edit,
                                     {place.x, place.y + place.step * y, in.width, place.step});
            drawing.edit->apply({before.data(), in.width, 1, 3, 0},
                                {after.data(), in.width, 1, 3, 0}, options);
        }
        float* to = out.row(y);
        for (std::size_t i = 0; i < width; ++i, to += channels) {
            const float* const pixel = from + i * channels;
            if (!recolourable(pixel, premultiplied) || !finite_pixel(&before[3 * i])) continue;
            Vec3 step;
            for (std::size_t c = 0; c < 3; ++c) {
                step[c] = static_cast<double>(after[3 * i + c]) - before[3 * i + c] +
                          strength * change[3 * i + c];
            }
            if (step == Vec3{0, 0, 0}) continue;
            // The step is added to the unrounded value, as without cleaning up.
            const Vec3 colour = conversion.to_clip(
                conversion.to_palette(straight_colour(pixel, premultiplied)) + step);
            if (!finite(colour)) continue;
            const double alpha = premultiplied ? pixel[3] : 1.0;
            for (std::size_t c = 0; c < 3; ++c) {
                to[c] = static_cast<float>(std::clamp(alpha * colour[c], -kLargest, kLargest));
            }
        }
    }
}

}  // namespace

std::shared_ptr<const Recolourer> cleaned_map(const Drawing& drawing) {
    const DrawingOptions& options = drawing.options;
    const bool matte = options.output == Output::kPick;
    const std::shared_ptr<const Recolourer>& map = matte ? drawing.reader : drawing.edit;
    if (options.clean_up == 0 || options.passes() || (options.is_matte() && !matte) || !map ||
        map->picks().picks.empty() || (!matte && options.strength == 0)) {
        return nullptr;
    }
    return map;
}

double clip_lines(const Drawing& drawing) {
    const std::shared_ptr<const Recolourer> map = cleaned_map(drawing);
    return map ? map->picks().lines : 0;
}

std::shared_ptr<CleanUp> make_clean_up(const Drawing& drawing, CleanUp::Format format,
                                       const CleanUp::Place& place) {
    const std::shared_ptr<const Recolourer> map = cleaned_map(drawing);
    if (!map) return nullptr;
    return std::make_shared<CleanUp>(map, drawing.conversion, drawing.options.clean_up, format,
                                     place);
}

void draw_edit(const ConstImageView& in, const ImageView& out, bool premultiplied,
               const Drawing& drawing, const RowPlace& place) {
    if (drawing.clean_up) {
        if (drawing.conversion) {
            draw_converted(in, out, premultiplied, drawing, place);
        } else {
            draw_cleaned(in, out, premultiplied, drawing, place);
        }
        return;
    }
    if (!drawing.edit) {
        copy_rows(in, out);
        return;
    }
    RecolourOptions options;
    options.strength = drawing.options.strength;
    options.premultiplied = premultiplied;
    options.conversion = drawing.conversion.get();
    options.place = place_of(drawing, *drawing.edit, place);
    drawing.edit->apply(in, out, options);
}

void draw_pixels(const Pixels& pixels, const Drawing& drawing) {
    const DrawingOptions& options = drawing.options;
    if (options.is_matte()) {
        draw_matte(pixels, drawing);
    } else {
        const auto channels = static_cast<int>(pixels.channels);
        const auto all = static_cast<int>(pixels.count);
        const bool rows = drawing.clean_up || (drawing.edit && drawing.edit->picks().windows());
        const int width = rows ? pixels.place.width : all;
        const auto stride = static_cast<std::ptrdiff_t>(sizeof(float) * pixels.channels) * width;
        draw_edit({pixels.source, width, all / width, channels, stride},
                  {pixels.result, width, all / width, channels, stride}, pixels.premultiplied,
                  drawing, pixels.place);
        if (options.keep > 0) keep_lightness(pixels, options);
    }
    if (options.mix < 1) mix_in_source(pixels, options.mix, {});
}

void draw_strip(float* row, int x1, int x2, int y, std::size_t channels, const Drawing& drawing) {
    const Area& picture = drawing.picture;
    const std::int64_t width = static_cast<std::int64_t>(picture.x2) - picture.x1;
    const std::int64_t height = static_cast<std::int64_t>(picture.y2) - picture.y1;
    const std::int64_t strip = std::max<std::int64_t>(2, height / kStripPart);
    const std::int64_t above = static_cast<std::int64_t>(y) - picture.y1;
    if (above < 0 || above >= strip || width <= 0) return;
    const std::vector<Vec3>& colours = above < strip / 2 ? drawing.edited : drawing.original;
    const auto count = static_cast<std::int64_t>(colours.size());
    for (int x = std::max(x1, picture.x1); x < std::min(x2, picture.x2); ++x) {
        const std::int64_t column = (static_cast<std::int64_t>(x) - picture.x1) * count / width;
        const Vec3& own = colours[static_cast<std::size_t>(column)];
        const Vec3 colour = drawing.conversion ? drawing.conversion->to_clip(own) : own;
        float* to = row + static_cast<std::size_t>(x - x1) * channels;
        for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(colour[c]);
        if (channels == 4) to[3] = 1;
    }
}

void mix_in_source(const Pixels& pixels, double mix, const std::vector<float>& mask) {
    for (std::size_t i = 0; i < pixels.count * pixels.channels; ++i) {
        const float from = pixels.source[i];
        float& to = pixels.result[i];
        if (from == to) continue;
        const double share = mask.empty() ? mix : mix * mask[i / pixels.channels];
        to = std::isfinite(from) && std::isfinite(to)
                 ? static_cast<float>(from + share * (static_cast<double>(to) - from))
                 : from;
    }
}

void draw_picture(const ConstImageView& in, const ImageView& out, Drawing drawing,
                  bool premultiplied, int threads) {
    premultiplied = premultiplied && in.channels == 4;
    const DrawingOptions& options = drawing.options;
    if (options.passes()) {
        drawing.options = {};
        drawing.edit = nullptr;
    }
    const auto channels = static_cast<std::size_t>(in.channels);
    const std::size_t row = static_cast<std::size_t>(in.width) * channels;
    const auto row_bytes = static_cast<std::ptrdiff_t>(row * sizeof(float));
    const Area whole{0, 0, in.width, in.height};
    if (drawing.picture.x1 >= drawing.picture.x2) drawing.picture = whole;
    if (row == 0) return;
    const bool packed = in.row_bytes == row_bytes && out.row_bytes == row_bytes;
    const auto row_at = [&](int y) { return in.row(in.height - 1 - y); };  // y counts upwards
    const int cell = clean_up_cell(1, clip_lines(drawing));
    if (const auto clean_up = make_clean_up(drawing, {in.channels, premultiplied},
                                            {whole, whole, whole, drawing.picture, cell, cell})) {
        const unsigned processors = std::max(1u, std::thread::hardware_concurrency());
        const int strips = threads == 0 ? static_cast<int>(processors) : threads;
        clean_up->prepare([&](int y, int x1, int, float*) { return row_at(y) + x1 * in.channels; },
                          strips,
                          [&](int count, const std::function<void(int)>& work) {
                              share_rows(count, threads, [&](const NextRow& next) {
                                  for (int i = next(); i >= 0; i = next()) work(i);
                              });
                          });
        drawing.clean_up = clean_up;
    }
    const int at_once = packed ? kRowsAtOnce : 1;
    const int bands = (in.height + at_once - 1) / at_once;
    share_rows(bands, threads, [&](const NextRow& next) {
        for (int band = next(); band >= 0; band = next()) {
            const int first = band * at_once, last = std::min(first + at_once, in.height);
            const float* const from = in.row(first);
            float* const to = out.row(first);
            const std::size_t count =
                static_cast<std::size_t>(last - first) * static_cast<std::size_t>(in.width);
            draw_pixels({from,
                         to,
                         count,
                         channels,
                         premultiplied,
                         {0, in.height - 1 - first, in.width, -1}},
                        drawing);
            if (options.output != Output::kPalette) continue;
            for (int y = first; y < last; ++y) {
                draw_strip(to + row * static_cast<std::size_t>(y - first), 0, in.width,
                           in.height - 1 - y, channels, drawing);
            }
        }
    });
}

}  // namespace palette4d
