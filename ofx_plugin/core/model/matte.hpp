// A matte over colours: how certainly a colour belongs to what was picked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/pick_space.hpp"

namespace palette4d {

/// A grid over pick_point(): saturations within +-kMost, lightnesses 0..1. Lightness varies
/// fastest.
struct MatteGrid {
    static constexpr int kSaturations = 96, kLightnesses = 16;
    static constexpr double kMost = 0.7;  ///< the saturation of pure red, and a little room
    static constexpr std::size_t kSize = std::size_t{kSaturations} * kSaturations * kLightnesses;
    static constexpr double kPerSaturation = (kSaturations - 1) / (2 * kMost);
    static constexpr double kPerLightness = kLightnesses - 1;

    /// The point of a node.
    static Vec3 point(int u, int v, int l) {
        return {u / kPerSaturation - kMost, v / kPerSaturation - kMost, l / kPerLightness};
    }
    static std::size_t index(int u, int v, int l) {
        return (static_cast<std::size_t>(u) * kSaturations + static_cast<std::size_t>(v)) *
                   kLightnesses +
               static_cast<std::size_t>(l);
    }
    /// The node below a point, so that the eight nodes around it are there, and the parts (0..1) of
    /// the way to the nodes above. Points beyond the grid count as its nearest ones.
    struct Place {
        int u, v, l;
        double part_u, part_v, part_l;
    };
    static Place place(const Vec3& point);
    /// A grid's value at a point, between its nodes.
    template <class T>
    static double at(const T* grid, const Vec3& point) {
        const Place p = place(point);
        const auto line = [&](int u, int v) {
            const T* const node = grid + index(u, v, p.l);
            const double low = static_cast<double>(node[0]);
            return low + p.part_l * (static_cast<double>(node[1]) - low);
        };
        const auto plane = [&](int u) {
            const double low = line(u, p.v);
            return low + p.part_v * (line(u, p.v + 1) - low);
        };
        const double low = plane(p.u);
        return low + p.part_u * (plane(p.u + 1) - low);
    }
};

/// Log odds that colours belong to a picked thing, at the nodes of a MatteGrid: kOdds / kMiddle for
/// each step above or below kMiddle.
struct Matte {
    static constexpr int kMiddle = 63;  ///< values are 0 to 2 kMiddle
    static constexpr double kOdds = 6;  ///< log odds at both ends: 1 in 400 is none
    std::vector<std::uint8_t> odds;     ///< MatteGrid::kSize values

    static double log_odds(std::uint8_t value) { return (value - kMiddle) * (kOdds / kMiddle); }
};

/// The matte of all colours of a picked colour's hue, for which nothing has been learned: a cone
/// around its hue; of a pale colour, a ball around the colour. `picked` is a display colour.
Matte hue_matte(const Vec3& picked);
/// The values of that matte, 0..1.
std::vector<float> hue_grid(const Vec3& picked);
/// The matte of memberships 0..1.
Matte matte_of(const std::vector<float>& membership);

}  // namespace palette4d
