#include "model/matte.hpp"

#include <algorithm>
#include <cmath>

namespace palette4d {
namespace {

/// Standard deviation of one thing's hue, as the tangent of 24 degrees. From 18 to 30 degrees
/// little changes; wider takes neighbouring hues, narrower leaves a thing's coloured highlights.
constexpr double kHueWidth = 0.4452;
/// The same of a pale thing's colours: in saturation, and in lightness.
constexpr double kPaleWidth = 1.5 * kNear, kPaleLightness = 0.3;

}  // namespace

MatteGrid::Place MatteGrid::place(const Vec3& point) {
    const auto along = [](double at, int count, int& below, double& part) {
        at = at > 0 ? std::min(at, static_cast<double>(count - 1)) : 0.0;  // NaN too
        below = std::min(static_cast<int>(at), count - 2);
        part = at - below;
    };
    Place p;
    along((point[0] + kMost) * kPerSaturation, kSaturations, p.u, p.part_u);
    along((point[1] + kMost) * kPerSaturation, kSaturations, p.v, p.part_v);
    along(point[2] * kPerLightness, kLightnesses, p.l, p.part_l);
    return p;
}

std::vector<float> hue_grid(const Vec3& picked) {
    const Vec3 own = pick_point(picked);
    const double certain = hue_certainty(picked);
    const auto [red, green] = chroma_of(picked);
    const double length = std::max(std::sqrt(red * red + green * green), 1e-9);
    const double east = red / length, north = green / length;
    std::vector<float> grid(MatteGrid::kSize);
    std::size_t at = 0;
    for (int u = 0; u < MatteGrid::kSaturations; ++u) {
        for (int v = 0; v < MatteGrid::kSaturations; ++v) {
            const Vec3 node = MatteGrid::point(u, v, 0);
            const double along = node[0] * east + node[1] * north;
            const double aside = node[1] * east - node[0] * north;
            const double width = kHueWidth * std::max(along, 0.0);
            const double behind = std::min(along, 0.0) / kNear;
            const double cone = aside * aside / (kNear * kNear + width * width) + behind * behind;
            const double du = node[0] - own[0], dv = node[1] - own[1];
            const double away = (du * du + dv * dv) / (kPaleWidth * kPaleWidth);
            for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
                const double dl = (l / MatteGrid::kPerLightness - own[2]) / kPaleLightness;
                const double square = certain * cone + (1 - certain) * (away + dl * dl);
                grid[at++] = static_cast<float>(std::exp(-0.5 * square));
            }
        }
    }
    return grid;
}

Matte matte_of(const std::vector<float>& membership) {
    Matte matte;
    matte.odds.reserve(membership.size());
    for (const float value : membership) {
        const double m =
            value > 0 ? std::clamp(static_cast<double>(value), 1e-9, 1 - 1e-9) : 1e-9;  // NaN too
        const double odds = std::log(m / (1 - m)) * (Matte::kMiddle / Matte::kOdds);
        const double most = Matte::kMiddle;
        matte.odds.push_back(
            static_cast<std::uint8_t>(std::lround(std::min(std::max(odds, -most), most) + most)));
    }
    return matte;
}

Matte hue_matte(const Vec3& picked) { return matte_of(hue_grid(picked)); }

}  // namespace palette4d
