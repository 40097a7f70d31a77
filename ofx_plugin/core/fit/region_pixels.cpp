#include "fit/region_pixels.hpp"

#include <cmath>

namespace palette4d {

std::vector<int> distances(const View& view, const Mask& mask, std::uint8_t value) {
    const int far = view.width + view.height;
    std::vector<int> away(view.size());
    for (std::size_t i = 0; i < away.size(); ++i) away[i] = mask[i] == value ? 0 : far;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            int& own = away[view.at(x, y)];
            if (x > 0) own = std::min(own, away[view.at(x - 1, y)] + 1);
            if (y > 0) own = std::min(own, away[view.at(x, y - 1)] + 1);
        }
    }
    for (int y = view.height - 1; y >= 0; --y) {
        for (int x = view.width - 1; x >= 0; --x) {
            int& own = away[view.at(x, y)];
            if (x + 1 < view.width) own = std::min(own, away[view.at(x + 1, y)] + 1);
            if (y + 1 < view.height) own = std::min(own, away[view.at(x, y + 1)] + 1);
        }
    }
    return away;
}

Image smoothed(const View& view, const Image& image) {
    constexpr double kSigma = 1.5;
    constexpr int kRadius = 5;
    float kernel[2 * kRadius + 1];
    double sum = 0;
    for (int i = -kRadius; i <= kRadius; ++i) sum += std::exp(-0.5 * i * i / (kSigma * kSigma));
    for (int i = -kRadius; i <= kRadius; ++i) {
        kernel[i + kRadius] = static_cast<float>(std::exp(-0.5 * i * i / (kSigma * kSigma)) / sum);
    }
    const auto blurred = [&](const Image& from, bool along_rows) {
        Image to(view.size());
        for (int y = 0; y < view.height; ++y) {
            for (int x = 0; x < view.width; ++x) {
                float value = 0;
                for (int i = -kRadius; i <= kRadius; ++i) {
                    value += kernel[i + kRadius] *
                             from[along_rows ? view.at(std::clamp(x + i, 0, view.width - 1), y)
                                             : view.at(x, std::clamp(y + i, 0, view.height - 1))];
                }
                to[view.at(x, y)] = value;
            }
        }
        return to;
    };
    return blurred(blurred(image, true), false);
}

Mask connected(const View& view, const Mask& region, const Mask& seeds) {
    const std::vector<int> away = distances(view, region, 1);
    Mask reached(view.size(), 0);
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < view.size(); ++i) {
        if (seeds[i] && away[i] <= 1) {
            reached[i] = 1;
            open.push_back(i);
        }
    }
    spread(view, std::move(open), [&](std::size_t i) {
        if (reached[i] || away[i] > 1) return false;
        reached[i] = 1;
        return true;
    });
    for (std::size_t i = 0; i < view.size(); ++i) reached[i] &= region[i];
    return reached;
}

}  // namespace palette4d
