// Recolouring of images: p' = p + strength * sum_i w_i(q) (v'_i - v_i).
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "model/slice.hpp"
#include "recolour/palette_body.hpp"
#include "simd/instruction_set.hpp"

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

/// How exactly a colour's displacement is computed.
enum class Precision {
    /// Many colours at a time, in float where an estimate of the error, made along with each
    /// result, allows that, else in double. Channels of straight colours are within
    /// kSingleTolerance of kDouble (times the largest difference between two vertices'
    /// displacements times strength, where that is above 1), and within half a unit in the last
    /// place of the result.
    kSingle,
    /// One colour after another by PaletteBody, in double throughout: what kSingle is held against.
    kDouble,
};
inline constexpr double kSingleTolerance = 1e-4;

struct RecolourOptions {
    double strength = 1.0;       ///< 0 returns the input, 1 the edit; linear, not clamped
    bool premultiplied = false;  ///< RGBA only: colours are divided by alpha first; alpha 0 passes
    int threads = 1;             ///< 0: one per processor
    Precision precision = Precision::kSingle;
    InstructionSet instructions = InstructionSet::kBest;  ///< of kSingle; the result is the same
};

/// How many of the colours of an apply() each way of computing took; what is copied counts nowhere.
struct RecolourCounts {
    long long single = 0;   ///< many at a time in float
    long long twofold = 0;  ///< many at a time in double
    long long one = 0;      ///< by PaletteBody

    RecolourCounts& operator+=(const RecolourCounts& other) {
        single += other.single;
        twofold += other.twofold;
        one += other.one;
        return *this;
    }
};

struct RecolourPlan;

/// Prepared once a frame, used by many threads (const).
class Recolourer {
public:
    /// n original and n edited colours and the faces between them, all finite. Throws
    /// std::invalid_argument when they do not fit together.
    Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
               std::vector<Face> faces);
    ~Recolourer();
    Recolourer(const Recolourer&) = delete;
    Recolourer& operator=(const Recolourer&) = delete;

    /// No colour of this slice is edited: apply() copies bit for bit.
    bool identity() const { return identity_; }
    /// Some colour moves; else apply() copies as well.
    bool moves() const { return !displaced_.empty(); }
    const std::vector<Vec3>& original() const { return body_.rgb(); }
    /// For the core's own sources; the plan is there where some colour moves.
    const PaletteBody& body() const { return body_; }
    const std::vector<Vec3>& displacement() const { return displacement_; }
    const RecolourPlan& plan() const { return *plan_; }
    /// One colour, in double precision. A colour with a NaN or an infinity is returned as it is.
    Vec3 displaced(const Vec3& p, double strength) const;
    /// `in` and `out` have the same size and channels; they may be the same memory. Rows are shared
    /// among options.threads threads. A pixel's result depends on that pixel and the options only:
    /// not on the number of threads, the image around it, where it lies, or the processor. Throws
    /// std::invalid_argument on mismatched views and for instructions that are not there.
    RecolourCounts apply(const ConstImageView& in, const ImageView& out,
                         const RecolourOptions& options) const;

private:
    friend class OneByOne;

    /// At strength 1. `p` must be finite; `weights` has room for one a vertex.
    Vec3 displacement_at(const Vec3& p, std::vector<double>& weights,
                         PaletteBody::Workspace& workspace) const;

    PaletteBody body_;
    std::vector<Vec3> displacement_;  ///< edited - original, one a vertex
    std::vector<int> displaced_;      ///< the vertices that move
    std::unique_ptr<const RecolourPlan> plan_;
    bool identity_ = true;
};

}  // namespace palette4d
