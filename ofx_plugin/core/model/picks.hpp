// Picks and holds: colours of the clip that change or stay, as the user asked.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "model/matte.hpp"
#include "model/vec3.hpp"

namespace palette4d {

/// Where a picked colour is at a frame.
struct PathKey {
    double frame;
    Vec3 rgb;
    double there = 1;  ///< how much of the change is asked for, 0..1: 0 where the colour is gone
};

/// The hue_matte() of a display colour, computed at its first use: a file's versions may have many
/// picks that are never used. Thread-safe.
class HueMatte {
public:
    explicit HueMatte(const Vec3& display) : display_(display) {}
    const Matte& get() const;

private:
    Vec3 display_;
    mutable std::once_flag once_;
    mutable Matte matte_;
};

/// The part of the picture that a pick changes: a box that moves over time, and its soft surround;
/// or all but that.
struct PickWindow {
    /// Left, top, right and bottom, in pixels of the clip from its top left corner.
    using Box = std::array<double, 4>;
    struct Key {
        double frame;
        Box box;
    };
    double feather;         ///< how far the change fades out beyond the box, in pixels
    std::vector<Key> keys;  ///< at least one, in order; linear between
    bool inverted = false;  ///< the pick changes what is outside

    Box box_at(double frame) const;
};

/// The middle of a pixel, in pixels of the clip from its top left corner. Single precision, so that
/// all kernels read the same.
struct Spot {
    float x, y;
};

/// A window at a frame.
struct FrameWindow {
    FrameWindow(const PickWindow& window, double frame);

    std::array<float, 4> box;
    double feather;
    bool inverted;

    /// What it leaves of a pick: 1 in the box, 0 from the feather on; 1 minus that if inverted.
    double at(const Spot& spot) const;
};
/// The least feather in pixels: narrower edges have steps.
inline constexpr double kLeastFeather = 1;

struct Pick {
    std::string id;
    bool hold = false;  ///< the colour stays; else it becomes `to`
    bool enabled = true;
    double frame = 0;            ///< where it was picked
    Vec3 rgb{}, to{};            ///< in the palette's code values, before edits
    bool toward_colour = false;  ///< at other frames: the same new colour, not the same change
    std::optional<double> from, until;  ///< first and last frame with the full change
    double fade = 0;                    ///< frames of the ramps before and after
    std::optional<double> fade_out;     ///< of the ramp after, where it differs
    std::vector<PathKey> path;  ///< the colour at other frames, linear between; empty: always rgb
    std::shared_ptr<const Matte> matte;   ///< a learned one; null: that of the colour's hue
    std::shared_ptr<const HueMatte> hue;  ///< never null where `matte` is
    double reach = 0;                     ///< log odds added to the matte
    double softness = 0.5;                ///< 0 a hard matte, 1 a soft one
    double darkest = 0, lightest = 1;     ///< the display lightness that the pick takes
    std::optional<PickWindow> window;     ///< none: the whole picture
    int levels = 0;  ///< values of the matte where it was picked, for small exports; 0: all

    /// The learned matte, else that of the hue. Throws std::invalid_argument without either.
    const Matte& taken() const;
    /// The frames from no change to the full one, and back: at least one, so that a range without
    /// fades ends between two frames.
    double ramp_in() const;
    double ramp_out() const;
    /// Where the colour is at a frame.
    Vec3 colour_at(double frame) const;
    /// The whole change that is asked for at a frame, without ramps.
    Vec3 change_at(double frame) const;
    /// How much of it is asked for, 0..1.
    double strength_at(double frame) const;
};

}  // namespace palette4d
