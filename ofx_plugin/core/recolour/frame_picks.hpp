// The picks and holds of one frame, ready to recolour: D(c) = sum of m(c) a(c) change.
//
// Of the change's light, its mean over the channels, a colour has no more than of the pick's
// lightness: else saturated shades would be crushed to black, or as light as the rest.
//
// m is the matte over colours at this frame: the learned grid with the pick's sliders, moved along
// with the picked colour, and what holds leave of it. a is the amount of the picked colour in c: 1
// at it, s in a shade of it s times as dark, alpha in its mixture of alpha with grey, 0 in grey. So
// shadows, highlights, soft edges and noise change as much as they should. Far from a pick's window
// its m is less.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "model/edits.hpp"
#include "model/matte.hpp"
#include "model/vector_bytes.hpp"
#include "recolour/pick_kernels.hpp"

namespace palette4d {

/// The values of a MatteGrid at one frame, 0..1.
using FrameMatte = std::vector<float>;

/// What one pick does at a frame.
struct FramePick {
    Vec3 colour;      ///< the picked colour there, in the palette's code values
    Vec3 change;      ///< the whole change of that colour from the unedited one
    double strength;  ///< how much of the change is asked for, above 0
    std::shared_ptr<const FrameMatte> matte;
    std::optional<FrameWindow> window{};  ///< none: the whole picture
    bool is_matte = false;                ///< the change shows the amount, and has no light
};

struct FramePicks {
    std::vector<FramePick> picks;
    /// What holds leave of the changes that the palette makes; null: all.
    std::shared_ptr<const FrameMatte> left;
    std::shared_ptr<const DisplayCurve> display;
    double width = 1, height = 1;  ///< of the clip or its part, in pixels
    double lines = 1;              ///< of the whole clip; 1: not known

    /// Whether a pick has one.
    bool windows() const;
    std::size_t bytes() const;
};

/// The enabled picks and holds that ask for something at a frame.
FramePicks picks_at(const Edits& edits, double frame);
/// One pick's share of its change, 0..1, as a change of all channels; for its matte. Without a pick
/// of this id, or where it asks for nothing, no colour changes.
FramePicks matte_at(const Edits& edits, const std::string& id, double frame);

/// What a matte is made from at any frame, for exports that make it themselves.
struct StillMatte {
    FrameMatte values;                                  ///< where the colour was picked
    std::array<float, MatteGrid::kLightnesses> shares;  ///< by the range of lightness
    Vec3 first;                                         ///< the picked colour's point
    bool learned;                                       ///< not that of the hue
};
StillMatte still_matte(const Edits& edits, const Pick& pick);
/// A pick or hold that asks for something at a frame: its number in Edits::picks, its point there
/// and its strength. Picks first, in the order of picks_at().
struct PickMoment {
    std::size_t pick;
    Vec3 point;
    double strength;
};
std::vector<PickMoment> pick_moments(const Edits& edits, double frame);

/// The memory that a PickPlan points to. `done` has what the palette does to each picked colour.
template <class T>
class PickMemory {
public:
    PickMemory(const FramePicks& picks, const std::vector<Vec3>& done);
    /// Valid while this is.
    PickPlan<T> plan() const;
    /// Without the mattes that it shares with `picks`.
    std::size_t bytes() const;

private:
    /// In the form that the kernels read; `idle` are the values that do nothing.
    typename PickPlan<T>::Grid grid(const std::shared_ptr<const FrameMatte>& matte, float idle);

    std::vector<typename PickPlan<T>::One> picks_;
    typename PickPlan<T>::Grid left_{};
    std::vector<std::shared_ptr<const FrameMatte>> mattes_;
    std::size_t arranged_bytes_ = 0;
    std::vector<T> display_;
    T display_from_ = 0, display_scale_ = 1;
};

extern template class PickMemory<float>;
extern template class PickMemory<double>;

/// What holds leave of the palette's change of a colour, 0..1.
double left_at(const FramePicks& picks, const Vec3& colour);
/// The displacement of one colour, of which the palette does `moved`, in double. `plan` is that of
/// the picks; windows count where its pixel's `spot` is given.
Vec3 with_picks(const FramePicks& picks, const PickPlan<double>& plan, const Vec3& colour,
                const Vec3& moved, const Spot* spot = nullptr);

}  // namespace palette4d
