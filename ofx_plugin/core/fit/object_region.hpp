// Where a frame's object, its background and mixtures of both are: what a matte is learned from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/matte_learning.hpp"

namespace palette4d {

using Grid = std::vector<float>;
using Mask = std::vector<std::uint8_t>;
using Image = std::vector<float>;

/// Points of what was marked in all frames: of the object and its parts of another colour, and of
/// what is held.
struct MarkedColours {
    std::vector<Vec3> own, held;
};

/// A frame, reduced; one element a pixel.
struct View {
    int width = 0, height = 0;
    std::array<Image, 3> shown;  ///< display code values
    std::vector<Vec3> point;     ///< as if the picked colour were where it was picked
    Mask real;                   ///< has a colour
    Image amount, grows;
    Mask seed;                  ///< what the user marked as the object's
    std::vector<Mask> held;     ///< what is held, by area
    MarkedColours marked;       ///< in this frame
    std::array<Image, 3> ways;  ///< smoothed points, of frames with what is held
    Mask side;                  ///< nearer to what is held, in seeded frames with such
    bool seeded = false;
    std::vector<std::uint32_t> node;  ///< the nearest node

    std::size_t size() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
};

/// Where a frame's object, its background, and mixtures of both are.
struct Parts {
    Mask object, background, band, held;
    Image wanted;  ///< of the band: the membership that gives a mixture its part of the change
    Mask region;
};

/// Throws std::invalid_argument where the frame has no pixels, or areas are not finite.
View reduced(const LearningFrame& frame, const Vec3& picked, const DisplayCurve* display);

/// The object is what is connected with what was clicked on. Where nothing was, it begins at
/// colours that are the object's by `membership` and, by `sure`, in other frames.
Parts find_object(const View& view, const Grid& membership, const Grid& sure,
                  const MarkedColours& marked);

}  // namespace palette4d
