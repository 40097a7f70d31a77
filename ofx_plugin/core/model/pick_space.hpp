// The space in which picks tell one thing's colours from another's: two coordinates of saturation,
// and lightness. All lights and shadows of one surface lie near one line in it.
//
// It is defined on display code values, 0..1. For palettes in a log or scene-linear encoding a
// DisplayCurve leads there. Sums, products and quotients only, so that it may stand in a header.
#pragma once

#include <algorithm>
#include <vector>

#include "model/vec3.hpp"

namespace palette4d {

/// Chroma, in code values, at which a hue is half certain: 2.5 times the chroma noise of 8-bit
/// 4:2:0 video. Larger: pale things are picked by lightness, smaller: noise counts as hue.
constexpr double kChromaNoise = 0.04;
/// Lightness, in code values, at which saturation counts half, so that noise in the dark stays
/// below a fifth. Larger: dark shades look pale. Smaller: noise in the dark looks saturated.
constexpr double kDark = 5 * kChromaNoise;
/// Saturation that parts two colours: the radius of one thing's colours beside its hue line.
constexpr double kNear = 0.05;
/// What a difference of lightness counts beside one of saturation: shades are nearer.
constexpr double kLightnessWeight = 0.4;

/// The code values of a display for a palette's code values: a monotone curve for each channel,
/// linear between `values`, which are evenly spaced, and constant beyond.
struct DisplayCurve {
    double from, to;             ///< the palette's code values of the first and the last value
    std::vector<double> values;  ///< at least 2

    double operator()(double code) const {
        const auto last = static_cast<double>(values.size() - 1);
        // NaN counts as the start.
        const double part_of_all = (code - from) / (to - from);
        const double at = (part_of_all > 0 ? std::min(part_of_all, 1.0) : 0.0) * last;
        const auto below = std::min(static_cast<std::size_t>(at), values.size() - 2);
        const double part = at - static_cast<double>(below);
        return values[below] + part * (values[below + 1] - values[below]);
    }
};

inline Vec3 displayed(const Vec3& colour, const DisplayCurve* curve) {
    if (!curve) return colour;
    return {(*curve)(colour[0]), (*curve)(colour[1]), (*curve)(colour[2])};
}

/// Axes of the plane of chroma: (2, -1, -1) / sqrt(6) and (0, 1, -1) / sqrt(2).
constexpr double kRedAxis = 0.40824829046386302, kGreenAxis = 0.70710678118654752;

/// Two coordinates of chroma: the projection of a colour along grey.
inline std::array<double, 2> chroma_of(const Vec3& display) {
    return {kRedAxis * ((display[0] - display[1]) + (display[0] - display[2])),
            kGreenAxis * (display[1] - display[2])};
}

/// Lightness is the largest channel, at least 0.
inline double lightness_of(const Vec3& display) {
    return std::max(std::max(display[0], display[1]), std::max(display[2], 0.0));
}

/// Two coordinates of saturation, and lightness.
inline Vec3 pick_point(const Vec3& display) {
    const auto [red, green] = chroma_of(display);
    const double lightness = lightness_of(display);
    const double scale = 1 / (lightness + kDark);
    return {red * scale, green * scale, lightness};
}

/// The squared distance of two points, in units of saturation.
inline double pick_distance2(const Vec3& a, const Vec3& b) {
    const double u = a[0] - b[0], v = a[1] - b[1], l = kLightnessWeight * (a[2] - b[2]);
    return u * u + v * v + l * l;
}

/// How certain the hue of a picked colour is, 0..1.
inline double hue_certainty(const Vec3& display) {
    const auto [red, green] = chroma_of(display);
    const double square = red * red + green * green;
    return square / (square + kChromaNoise * kChromaNoise);
}

/// 0 up to `low`, 1 from `high` on, smooth between.
inline double smooth_step(double x, double low, double high) {
    const double t = std::min(std::max((x - low) / (high - low), 0.0), 1.0);
    return t * t * (3 - 2 * t);
}

/// Colours within this of the picked colour, in saturation, move along where it moves in time.
/// Others stay: backgrounds do not change with the object.
constexpr double kMovesAlong = 6.5 * kNear;
/// 1 at a picked colour, 0 far from it.
inline double nearness(const Vec3& point, const Vec3& picked) {
    const double t = std::max(0.0, 1 - pick_distance2(point, picked) / (kMovesAlong * kMovesAlong));
    return t * t;
}

/// What a hold leaves of a pick: 0 at the hold, 1 where a colour is nearer the pick.
inline double spared(const Vec3& point, const Vec3& hold, const Vec3& pick) {
    const double to_hold = pick_distance2(point, hold), to_pick = pick_distance2(point, pick);
    return smooth_step(to_hold / std::max(to_hold + to_pick, 1e-9), 0, 0.5);
}

/// Added to a pale pick's lightness and to what it is below 1, so that black and white have
/// amounts.
constexpr double kLeastLight = 0.02;

/// How much of a picked colour is in others: along its chroma, 1 at the pick, s in a shade s times
/// as dark, alpha in a mixture of alpha of it and grey, 0 in grey. Of a pale colour, relative
/// lightness, where greys beyond 0..1 count as 0 or 1.
struct PickedColour {
    std::array<double, 2> along;  ///< the chroma part of the amount is along . chroma_of(colour)
    double plain;                 ///< the part that is read from lightness, 0..1
    double dark, bright;

    explicit PickedColour(const Vec3& display) {
        const double grey = grey_of(display);
        const auto [red, green] = chroma_of(display);
        const double square = red * red + green * green;
        const double noise2 = kChromaNoise * kChromaNoise;
        along = {red / (square + noise2), green / (square + noise2)};
        plain = noise2 / (square + noise2);
        dark = 1 / (grey + kLeastLight);
        bright = 1 / (1 - grey + kLeastLight);
    }
    PickedColour(const std::array<double, 2>& along_chroma, double of_lightness, double darker,
                 double brighter)
        : along(along_chroma), plain(of_lightness), dark(darker), bright(brighter) {}

    /// 0 or more. Above a half, but not always 1, at a picked colour itself.
    double amount(const Vec3& display) const {
        const auto [red, green] = chroma_of(display);
        const double t =
            std::min((red * red + green * green) * (1 / (kChromaNoise * kChromaNoise)), 1.0);
        const double hue = std::max(along[0] * red + along[1] * green, 0.0) * (t * t * (3 - 2 * t));
        const double grey = grey_of(display);
        const double light =
            std::min((grey + kLeastLight) * dark, std::min((1 - grey + kLeastLight) * bright, 1.0));
        const double found = hue + plain * light;
        // Highlights: slope 1 at the pick, and at most twice its amount.
        return found > 1 ? 2 - 1 / found : found;
    }

    /// The mean of the channels, within 0 to 1.
    static double grey_of(const Vec3& display) {
        const double grey = (display[0] + display[1] + display[2]) * (1.0 / 3);
        return std::min(std::max(grey, 0.0), 1.0);
    }
};

}  // namespace palette4d
