#include "model/picks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace palette4d {
namespace {

/// The keys around a frame, and the weight of the later one.
template <class Key>
struct Around {
    const Key *before, *after;
    double weight;
};
template <class Key>
Around<Key> around(const std::vector<Key>& keys, double frame) {
    const auto after =
        std::upper_bound(keys.begin(), keys.end(), frame,
                         [](double time, const Key& key) { return time < key.frame; });
    if (after == keys.begin()) return {&keys.front(), &keys.front(), 0};
    if (after == keys.end()) return {&keys.back(), &keys.back(), 0};
    const Key& before = *(after - 1);
    return {&before, &*after, (frame - before.frame) / (after->frame - before.frame)};
}

}  // namespace

PickWindow::Box PickWindow::box_at(double at) const {
    const auto [before, after, weight] = around(keys, at);
    Box box = before->box;
    for (std::size_t i = 0; i < box.size(); ++i) box[i] += weight * (after->box[i] - box[i]);
    return box;
}

FrameWindow::FrameWindow(const PickWindow& window, double frame)
    : feather(std::max(window.feather, kLeastFeather)), inverted(window.inverted) {
    const PickWindow::Box exact = window.box_at(frame);
    for (std::size_t i = 0; i < box.size(); ++i) box[i] = static_cast<float>(exact[i]);
}

double FrameWindow::at(const Spot& spot) const {
    const auto beyond = [](double low, double at, double high) {
        return std::max({low - at, at - high, 0.0});
    };
    const double x = beyond(box[0], spot.x, box[2]), y = beyond(box[1], spot.y, box[3]);
    const double left = 1 - std::min((x * x + y * y) / (feather * feather), 1.0);
    return inverted ? 1 - left * left : left * left;
}

const Matte& HueMatte::get() const {
    std::call_once(once_, [this] { matte_ = hue_matte(display_); });
    return matte_;
}

const Matte& Pick::taken() const {
    if (matte) return *matte;
    if (!hue) throw std::invalid_argument("picks: found a pick without a matte");
    return hue->get();
}

Vec3 Pick::colour_at(double at) const {
    if (path.empty()) return rgb;
    const auto [before, after, weight] = around(path, at);
    return before->rgb + weight * (after->rgb - before->rgb);
}

Vec3 Pick::change_at(double at) const {
    const Vec3 colour = colour_at(at);
    if (hold) return {0, 0, 0};
    if (toward_colour) return to - colour;
    const Vec3 change = to - rgb;
    const auto largest = [](const Vec3& c) { return std::max(c[0], std::max(c[1], c[2])); };
    // The change that makes a wall blue by day would make its night black a bright blue.
    const double now = largest(colour), picked = largest(rgb);
    double part = now < picked ? std::max(0.0, now) / std::max(picked, 1e-9) : 1.0;
    double most = std::max(largest(to), largest(rgb));
    for (const PathKey& key : path) most = std::max(most, largest(key.rgb));
    for (std::size_t c = 0; c < 3; ++c) {
        // A shift leads to no colour below or above all that are known, and not out of 0..1.
        double low = std::min(0.0, std::min(to[c], rgb[c]));
        for (const PathKey& key : path) low = std::min(low, key.rgb[c]);
        const double high = most <= 1 ? 1.0 : std::numeric_limits<double>::infinity();
        const double size = std::abs(change[c]);
        if (size > 1e-9) {
            part = std::min(part, (change[c] < 0 ? colour[c] - low : high - colour[c]) / size);
        }
    }
    return std::max(0.0, part) * change;
}

double Pick::ramp_in() const { return std::max(fade, 1.0); }

double Pick::ramp_out() const { return std::max(fade_out.value_or(fade), 1.0); }

double Pick::strength_at(double at) const {
    double strength = 1;
    if (from) strength = std::min(strength, 1 - (*from - at) / ramp_in());
    if (until) strength = std::min(strength, 1 - (at - *until) / ramp_out());
    if (!path.empty()) {
        const auto [before, after, weight] = around(path, at);
        strength *= before->there + weight * (after->there - before->there);
    }
    return std::max(0.0, std::min(strength, 1.0));
}

}  // namespace palette4d
