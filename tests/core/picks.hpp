// Picks that several tests use.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "model/edits.hpp"
#include "recolour/frame_picks.hpp"

namespace picks {

/// A pick with the matte of its hue.
inline palette4d::Pick pick(std::string id, const palette4d::Vec3& rgb, const palette4d::Vec3& to) {
    palette4d::Pick result;
    result.id = std::move(id);
    result.rgb = rgb;
    result.to = to;
    result.matte = std::make_shared<const palette4d::Matte>(palette4d::hue_matte(rgb));
    return result;
}

inline palette4d::Pick hold(std::string id, const palette4d::Vec3& rgb) {
    palette4d::Pick result = pick(std::move(id), rgb, rgb);
    result.hold = true;
    return result;
}

/// What a pick does at a frame, with another matte: `inside` within a ball of saturation and
/// lightness around the colour, 0 outside.
inline palette4d::FramePick ball(const palette4d::Vec3& colour, const palette4d::Vec3& change,
                                 double radius, float inside = 1) {
    using palette4d::MatteGrid;
    palette4d::FrameMatte matte(MatteGrid::kSize, 0.0f);
    const palette4d::Vec3 own = palette4d::pick_point(colour);
    for (int u = 0; u < MatteGrid::kSaturations; ++u) {
        for (int v = 0; v < MatteGrid::kSaturations; ++v) {
            for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
                if (palette4d::pick_distance2(MatteGrid::point(u, v, l), own) < radius * radius) {
                    matte[MatteGrid::index(u, v, l)] = inside;
                }
            }
        }
    }
    return {colour, change, 1, std::make_shared<const palette4d::FrameMatte>(std::move(matte))};
}

}  // namespace picks
