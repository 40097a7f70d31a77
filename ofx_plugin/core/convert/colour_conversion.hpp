// From a clip's numbers to those that its palette is found in, and back: a chain of matrices and
// monotone curves, so that neither the node nor a renderer needs a colour management library.
#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// y = matrix x + offset; rows follow each other, the matrix has an inverse.
struct MatrixStep {
    std::array<double, 9> matrix;
    Vec3 offset;
};

/// For each channel y = log_slope log_base(linear_slope x + linear_offset) + log_offset where x is
/// above `start`, and from there down a straight line of slope `below`. The camera logs of CLF.
struct LogStep {
    double base;
    Vec3 log_slope, log_offset, linear_slope, linear_offset, start, below;
    bool inverse;  ///< from y to x
};

/// For each channel y = ((x + offset) / (1 + offset))^gamma, and below x = offset / (gamma - 1) the
/// tangent through 0. Without an offset y = x^gamma. Negative numbers go on along the straight line
/// (without an offset y = x), or mirrored: y(-x) = -y(x).
struct GammaStep {
    Vec3 gamma, offset;
    bool mirrored;
    bool inverse;  ///< from y to x
};

/// Samples of a curve, both strictly rising, straight in between and beyond the ends.
struct SampledCurve {
    std::vector<double> x, y;
};
struct CurveStep {
    std::vector<SampledCurve> curves;  ///< one for all channels, or three
    bool inverse;                      ///< from y to x
};

using ConversionStep = std::variant<MatrixStep, LogStep, GammaStep, CurveStep>;

/// A step that has no inverse or is no curve: which member, what was found and expected.
class ConversionProblem : public std::invalid_argument {
public:
    ConversionProblem(std::size_t step, std::string member, std::string found,
                      std::string expected);
    std::size_t step() const { return step_; }
    const std::string& member() const { return member_; }
    const std::string& found() const { return found_; }
    const std::string& expected() const { return expected_; }

private:
    std::size_t step_;
    std::string member_, found_, expected_;
};

/// The chain; continuous, invertible, defined for every number. Immutable.
class ColourConversion {
public:
    ColourConversion() = default;  ///< changes nothing
    /// Throws ConversionProblem.
    explicit ColourConversion(std::vector<ConversionStep> steps);

    const std::vector<ConversionStep>& steps() const { return steps_; }
    bool identity() const { return steps_.empty(); }
    /// The palette's numbers of the clip's, which must be finite. Not finite only beyond 1e30.
    Vec3 to_palette(const Vec3& clip) const;
    /// And back.
    Vec3 to_clip(const Vec3& palette) const;

private:
    /// What a step needs at every colour and what follows from it alone.
    struct Prepared {
        MatrixStep inverse{};  ///< of a matrix
        Vec3 scale{}, turn{};  ///< of a log: to log2, and y at the start; of a gamma: of its line
    };
    static double log_forward(const LogStep& s, const Prepared& at, std::size_t c, double x);
    static double log_backward(const LogStep& s, const Prepared& at, std::size_t c, double y);
    static double gamma_forward(const GammaStep& s, const Prepared& at, std::size_t c, double x);
    static double gamma_backward(const GammaStep& s, const Prepared& at, std::size_t c, double y);
    /// One step of three curves, in its own direction or against it.
    static Vec3 curved(const ConversionStep& step, const Prepared& at, const Vec3& x, bool against);

    std::vector<ConversionStep> steps_;
    std::vector<Prepared> prepared_;  ///< one a step
};

}  // namespace palette4d
