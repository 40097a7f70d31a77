// Recolouring of images: p' = p + strength * sum_i w_i(q) (v'_i - v_i).
#pragma once

#include <cstddef>
#include <vector>

#include "palette4d/palette_body.hpp"
#include "palette4d/slice.hpp"

namespace palette4d {

/// A float32 image somebody else owns: `row_bytes` may be negative or padded, `channels` is 3 or 4
/// interleaved (the fourth is alpha and is copied untouched).
struct ConstImageView {
    const float* data;
    int width, height, channels;
    std::ptrdiff_t row_bytes;
};
struct ImageView {
    float* data;
    int width, height, channels;
    std::ptrdiff_t row_bytes;
};

struct RecolourOptions {
    double strength = 1.0;       ///< 0 returns the input, 1 the edit; linear, not clamped
    bool premultiplied = false;  ///< RGBA only: colours are divided by alpha first; alpha 0 passes
    int threads = 1;             ///< 0: one per processor
};

/// Prepared once a frame, used by many threads (const).
class Recolourer {
public:
    /// n original and n edited colours and the faces between them, all finite. Throws
    /// std::invalid_argument when they do not fit together.
    Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
               std::vector<Face> faces);
    /// No colour of this slice is edited: apply() copies bit for bit.
    bool identity() const { return identity_; }
    /// One colour, in double precision. A colour with a NaN or an infinity is returned as it is.
    Vec3 displaced(const Vec3& p, double strength) const;
    /// `in` and `out` have the same size and channels; they may be the same memory. Rows are shared
    /// among options.threads threads; the result does not depend on their number. Throws
    /// std::invalid_argument on mismatched views.
    void apply(const ConstImageView& in, const ImageView& out,
               const RecolourOptions& options) const;

private:
    class Worker;  ///< one thread's memory, and the loop over a row

    /// At strength 1. `p` must be finite; `weights` has room for one a vertex.
    Vec3 displacement_at(const Vec3& p, std::vector<double>& weights,
                         PaletteBody::Workspace& workspace) const;

    PaletteBody body_;
    std::vector<Vec3> displacement_;  ///< edited - original, one a vertex
    std::vector<int> displaced_;      ///< the vertices that move
    bool identity_ = true;
};

}  // namespace palette4d
