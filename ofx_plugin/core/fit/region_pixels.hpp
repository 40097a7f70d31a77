// Pixels of a reduced frame and their neighbours: means, distances, smoothing, what is connected.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "fit/object_region.hpp"

namespace palette4d {

/// Calls visit(pixel) for the neighbours of a pixel, four or fewer.
template <class Visit>
void visit_around(const View& view, std::size_t i, Visit visit) {
    const auto width = static_cast<std::size_t>(view.width);
    if (i % width > 0) visit(i - 1);
    if (i % width + 1 < width) visit(i + 1);
    if (i >= width) visit(i - width);
    if (i + width < view.size()) visit(i + width);
}

/// Spreads from the pixels in `open` to neighbours that join(pixel) takes.
template <class Join>
void spread(const View& view, std::vector<std::size_t> open, Join join) {
    while (!open.empty()) {
        const std::size_t i = open.back();
        open.pop_back();
        visit_around(view, i, [&](std::size_t next) {
            if (join(next)) open.push_back(next);
        });
    }
}

/// Means over squares of half width `radius`, of the pixels in a mask. From sums over all pixels
/// above and to the left, so that a mean takes the same time for any radius.
class LocalMean {
public:
    LocalMean(const View& view, const Mask& mask, int radius)
        : view_(view), mask_(mask), radius_(radius), counts_(sums(nullptr)) {}

    /// The means at the `wanted` pixels; 0 at others.
    Image of(const Image& image, const Mask& wanted) const {
        const std::vector<double> values = sums(&image);
        Image means(view_.size(), 0);
        for (int y = 0; y < view_.height; ++y) {
            for (int x = 0; x < view_.width; ++x) {
                if (!wanted[view_.at(x, y)]) continue;
                const double count = window(counts_, x, y);
                means[view_.at(x, y)] =
                    static_cast<float>(count > 0 ? window(values, x, y) / count : 0.0);
            }
        }
        return means;
    }
    bool any(int x, int y) const { return window(counts_, x, y) > 0; }

private:
    std::vector<double> sums(const Image* image) const {
        const auto stride = static_cast<std::size_t>(view_.width) + 1;
        std::vector<double> table(stride * (static_cast<std::size_t>(view_.height) + 1), 0.0);
        for (int y = 0; y < view_.height; ++y) {
            double row = 0;
            for (int x = 0; x < view_.width; ++x) {
                const std::size_t i = view_.at(x, y);
                if (mask_[i]) row += image ? static_cast<double>((*image)[i]) : 1.0;
                const std::size_t at =
                    (static_cast<std::size_t>(y) + 1) * stride + static_cast<std::size_t>(x) + 1;
                table[at] = table[at - stride] + row;
            }
        }
        return table;
    }
    double window(const std::vector<double>& table, int x, int y) const {
        const auto stride = static_cast<std::size_t>(view_.width) + 1;
        const auto x1 = static_cast<std::size_t>(std::max(0, x - radius_)),
                   x2 = static_cast<std::size_t>(std::min(view_.width, x + radius_ + 1));
        const auto y1 = static_cast<std::size_t>(std::max(0, y - radius_)),
                   y2 = static_cast<std::size_t>(std::min(view_.height, y + radius_ + 1));
        return table[y2 * stride + x2] - table[y1 * stride + x2] - table[y2 * stride + x1] +
               table[y1 * stride + x1];
    }

    const View& view_;
    const Mask& mask_;
    const int radius_;
    const std::vector<double> counts_;
};

/// City-block distances to the nearest pixel whose mask is `value`; beyond the frame there is none.
std::vector<int> distances(const View& view, const Mask& mask, std::uint8_t value);
/// A little smoother, so that single noisy pixels neither join nor part regions.
Image smoothed(const View& view, const Image& image);
/// The pixels of a region that are connected with seeds, across gaps of one or two pixels.
Mask connected(const View& view, const Mask& region, const Mask& seeds);

}  // namespace palette4d
