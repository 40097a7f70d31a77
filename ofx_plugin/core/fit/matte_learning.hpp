// Learning a pick's matte over colours from frames of its clip.
//
// The region of a frame that is connected with what was clicked on is the object, all else is
// background. A band around the region is matted along the line between the local means of both
// sides, since its colours are mixtures of them. Colours that no frame shows get a cone around the
// picked colour's hue. Three rounds, since a matte gives a better region.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "model/matte.hpp"

namespace palette4d {

/// A brush: squares around points, and around the lines between them.
struct Brush {
    std::vector<std::array<double, 2>> points;  ///< pixels; x from the left, y from the top
    double radius = 0;                          ///< half of a square's side
};

/// A frame to learn from.
struct LearningFrame {
    const float* pixels;  ///< (height, width, 3) of the palette's code values; NaN: no colour
    int width, height;
    std::ptrdiff_t row_bytes;
    Vec3 colour;                ///< where the picked colour is at this frame
    std::vector<Brush> object;  ///< parts of the object
    std::vector<Brush> others;  ///< parts of the background
    /// Without areas: take the pixels nearest the colour. At other frames than the first the object
    /// is found by colours that the first frame has taught.
    bool seeded = true;
};

struct LearnedMatte {
    std::vector<float> membership;  ///< a MatteGrid, 0..1
    double share = 0;               ///< of the first frame's pixels: the region
    bool found = false;             ///< whether the first frame has any such region
};

/// The first frame is the one that was clicked on. `picked` is the colour there, `holds` are
/// colours to keep. All are in the palette's code values, `display` leads to display code values
/// (null: the same). Throws std::invalid_argument without frames or pixels.
LearnedMatte learn_matte(const std::vector<LearningFrame>& frames, const Vec3& picked,
                         const std::vector<Vec3>& holds, const DisplayCurve* display);

}  // namespace palette4d
