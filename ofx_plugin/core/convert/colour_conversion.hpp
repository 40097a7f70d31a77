// Converts a clip's code values to its palette's, and back, by matrices and monotone curves. So
// neither the node nor a renderer needs a colour management library.
#pragma once

#include <array>
#include <cstddef>
#include <variant>
#include <vector>

#include "model/vec3.hpp"

namespace palette4d {

/// y = matrix x + offset; the matrix is row-major and invertible.
struct MatrixStep {
    std::array<double, 9> matrix;
    Vec3 offset;
};

/// For each channel y = log_slope log_base(linear_slope x + linear_offset) + log_offset where x is
/// above `start`. Below, a straight line with slope `below`. The camera logs of CLF.
struct LogStep {
    double base;
    Vec3 log_slope, log_offset, linear_slope, linear_offset, start, below;
    bool inverse;  ///< from y to x
};

/// For each channel y = ((x + offset) / (1 + offset))^gamma; below x = offset / (gamma - 1) the
/// tangent through 0. Without an offset y = x^gamma. Negative values follow the straight line
/// (without an offset y = x), or are mirrored: y(-x) = -y(x).
struct GammaStep {
    Vec3 gamma, offset;
    bool mirrored;
    bool inverse;  ///< from y to x
};

/// Samples of a curve, x and y strictly increasing; linear in between and beyond the ends.
struct SampledCurve {
    std::vector<double> x, y;
};
struct CurveStep {
    std::vector<SampledCurve> curves;  ///< one for all channels, or three
    bool inverse;                      ///< from y to x
};

using ConversionStep = std::variant<MatrixStep, LogStep, GammaStep, CurveStep>;

/// The chain of steps; continuous, invertible, defined for every number. Immutable.
class ColourConversion {
public:
    ColourConversion() = default;  ///< the identity
    /// Throws SidecarError (without a file) for a step that is not invertible or not a curve.
    explicit ColourConversion(std::vector<ConversionStep> steps);

    const std::vector<ConversionStep>& steps() const { return steps_; }
    bool identity() const { return steps_.empty(); }
    /// Converts finite clip values to palette values. The result is finite for inputs up to 1e30.
    Vec3 to_palette(const Vec3& clip) const;
    /// The inverse of to_palette().
    Vec3 to_clip(const Vec3& palette) const;

private:
    /// Values precomputed from a step.
    struct Prepared {
        MatrixStep inverse{};  ///< of a matrix step
        Vec3 scale{}, turn{};  ///< log: factor to log2, y at start; gamma: its line
    };
    /// Step i, in its own direction or against it.
    Vec3 converted(std::size_t i, const Vec3& x, bool against) const;

    std::vector<ConversionStep> steps_;
    std::vector<Prepared> prepared_;  ///< one per step
};

}  // namespace palette4d
