#include "convert/colour_conversion.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "model/sidecar_error.hpp"
#include "model/vec3.hpp"

namespace palette4d {
namespace {

/// Exponents are clamped here, well within float, so that no edit overflows.
constexpr double kLargestExponent = 120;

Vec3 product(const MatrixStep& step, const Vec3& x) {
    const auto& m = step.matrix;
    Vec3 y;
    for (std::size_t r = 0; r < 3; ++r) {
        y[r] = m[3 * r] * x[0] + m[3 * r + 1] * x[1] + m[3 * r + 2] * x[2] + step.offset[r];
    }
    return y;
}

/// Inverts by cofactors; false when the matrix is singular in double precision.
bool inverted(const MatrixStep& step, MatrixStep& result) {
    const auto& m = step.matrix;
    const Vec3 a{m[0], m[1], m[2]}, b{m[3], m[4], m[5]}, c{m[6], m[7], m[8]};
    const Vec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
    const double determinant = dot(a, bc);
    const double size = norm(a) * norm(b) * norm(c);
    if (!(std::abs(determinant) > 1e-9 * size)) return false;
    for (std::size_t r = 0; r < 3; ++r) {
        result.matrix[3 * r] = bc[r] / determinant;
        result.matrix[3 * r + 1] = ca[r] / determinant;
        result.matrix[3 * r + 2] = ab[r] / determinant;
    }
    result.offset = {0, 0, 0};
    const Vec3 moved = product(result, step.offset);
    result.offset = {-moved[0], -moved[1], -moved[2]};
    return true;
}

/// The end of a gamma's straight line, and its slope.
struct Toe {
    double end, slope;
};

Toe toe_of(double gamma, double offset) {
    if (offset == 0) return {0, 1};
    const double end = offset / (gamma - 1);
    return {end, gamma / (1 + offset) * std::pow((end + offset) / (1 + offset), gamma - 1)};
}

double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at) {
    const auto above = std::upper_bound(x.begin() + 1, x.end() - 1, at);
    const auto i = static_cast<std::size_t>(above - x.begin());
    return y[i - 1] + (at - x[i - 1]) * ((y[i] - y[i - 1]) / (x[i] - x[i - 1]));
}

/// One channel of a step at `x`, from y to x where `backward`. `scale` and `turn` are Prepared.
double along(const LogStep& s, double scale, double turn, std::size_t c, double x, bool backward) {
    if (backward) {
        if (x <= turn) return s.start[c] + (x - turn) / s.below[c];
        const double exponent = std::min((x - s.log_offset[c]) / scale, kLargestExponent);
        return (std::exp2(exponent) - s.linear_offset[c]) / s.linear_slope[c];
    }
    if (x <= s.start[c]) return turn + s.below[c] * (x - s.start[c]);
    return scale * std::log2(s.linear_slope[c] * x + s.linear_offset[c]) + s.log_offset[c];
}

double along(const GammaStep& s, double scale, double turn, std::size_t c, double x,
             bool backward) {
    if (s.mirrored && x < 0) return -along(s, scale, turn, c, -x, backward);
    if (backward) {
        if (x <= scale * turn) return x / scale;
        return (1 + s.offset[c]) * std::pow(x, 1 / s.gamma[c]) - s.offset[c];
    }
    if (x <= turn) return scale * x;
    return std::pow((x + s.offset[c]) / (1 + s.offset[c]), s.gamma[c]);
}

double along(const CurveStep& s, double, double, std::size_t c, double x, bool backward) {
    const SampledCurve& curve = s.curves[s.curves.size() == 1 ? 0 : c];
    return backward ? interpolated(curve.y, curve.x, x) : interpolated(curve.x, curve.y, x);
}

class Checker {
public:
    explicit Checker(std::size_t step) : step_(step) {}

    void operator()(const LogStep& s) const {
        if (!(s.base > 1)) fail("/base", s.base, "a base above 1");
        for (std::size_t c = 0; c < 3; ++c) {
            const std::string at = '/' + std::to_string(c);
            positive(s.log_slope[c], "/log_slope" + at);
            positive(s.linear_slope[c], "/linear_slope" + at);
            positive(s.below[c], "/below" + at);
            const double argument = s.linear_slope[c] * s.start[c] + s.linear_offset[c];
            if (!(argument > 0)) {
                fail("/start" + at, s.start[c], "a number whose logarithm there is");
            }
        }
    }
    void operator()(const GammaStep& s) const {
        for (std::size_t c = 0; c < 3; ++c) {
            const std::string at = '/' + std::to_string(c);
            if (!(s.gamma[c] >= 0.01 && s.gamma[c] <= 100)) {
                fail("/gamma" + at, s.gamma[c], "a number from 0.01 to 100");
            }
            if (!(s.offset[c] >= 0 && s.offset[c] < 1)) {
                fail("/offset" + at, s.offset[c], "a number from 0 to less than 1");
            }
            if (s.offset[c] > 0 && !(s.gamma[c] > 1)) {
                fail("/gamma" + at, s.gamma[c], "a number above 1 with an offset");
            }
        }
    }
    void operator()(const CurveStep& s) const {
        if (s.curves.size() != 1 && s.curves.size() != 3) {
            fail("/curves", static_cast<double>(s.curves.size()), "1 curve or 3");
        }
        for (std::size_t i = 0; i < s.curves.size(); ++i) {
            const std::string at = "/curves/" + std::to_string(i);
            const SampledCurve& curve = s.curves[i];
            if (curve.x.size() < 2) {
                fail(at + "/x", static_cast<double>(curve.x.size()), "2 samples or more");
            }
            if (curve.y.size() != curve.x.size()) {
                fail(at + "/y", static_cast<double>(curve.y.size()),
                     "as many numbers as x, " + std::to_string(curve.x.size()));
            }
            rising(curve.x, at + "/x");
            rising(curve.y, at + "/y");
        }
    }
    void operator()(const MatrixStep&) const {}  // uses its inverse

private:
    [[noreturn]] void fail(const std::string& member, double found,
                           const std::string& expected) const {
        throw SidecarError("", '/' + std::to_string(step_) + member,
                           "the number " + decimal_text(found), expected);
    }
    void positive(double value, const std::string& member) const {
        if (!(value > 0)) fail(member, value, "a number above 0");
    }
    void rising(const std::vector<double>& values, const std::string& member) const {
        for (std::size_t i = 1; i < values.size(); ++i) {
            if (!(values[i] > values[i - 1])) {
                fail(member + '/' + std::to_string(i), values[i],
                     "numbers that rise, here above " + decimal_text(values[i - 1]));
            }
        }
    }

    std::size_t step_;
};

}  // namespace

ColourConversion::ColourConversion(std::vector<ConversionStep> steps) : steps_(std::move(steps)) {
    for (std::size_t i = 0; i < steps_.size(); ++i) {
        std::visit(Checker(i), steps_[i]);
        Prepared prepared;
        if (const auto* matrix = std::get_if<MatrixStep>(&steps_[i])) {
            if (!inverted(*matrix, prepared.inverse)) {
                throw SidecarError("", '/' + std::to_string(i) + "/matrix",
                                   "a matrix without an inverse",
                                   "one whose rows do not depend on each other");
            }
        } else if (const auto* log = std::get_if<LogStep>(&steps_[i])) {
            for (std::size_t c = 0; c < 3; ++c) {
                prepared.scale[c] = log->log_slope[c] / std::log2(log->base);
                const double inner = log->linear_slope[c] * log->start[c] + log->linear_offset[c];
                prepared.turn[c] = prepared.scale[c] * std::log2(inner) + log->log_offset[c];
            }
        } else if (const auto* gamma = std::get_if<GammaStep>(&steps_[i])) {
            for (std::size_t c = 0; c < 3; ++c) {
                const Toe toe = toe_of(gamma->gamma[c], gamma->offset[c]);
                prepared.scale[c] = toe.slope;
                prepared.turn[c] = toe.end;
            }
        }
        prepared_.push_back(prepared);
    }
}

Vec3 ColourConversion::converted(std::size_t i, const Vec3& x, bool against) const {
    const Prepared& at = prepared_[i];
    const auto convert = [&](const auto& step) -> Vec3 {
        if constexpr (std::is_same_v<decltype(step), const MatrixStep&>) {
            return product(against ? at.inverse : step, x);
        } else {
            const bool backward = step.inverse != against;
            Vec3 y{};
            for (std::size_t c = 0; c < 3; ++c) {
                y[c] = along(step, at.scale[c], at.turn[c], c, x[c], backward);
            }
            return y;
        }
    };
    return std::visit(convert, steps_[i]);
}

Vec3 ColourConversion::to_palette(const Vec3& clip) const {
    Vec3 at = clip;
    for (std::size_t i = 0; i < steps_.size(); ++i) at = converted(i, at, false);
    return at;
}

Vec3 ColourConversion::to_clip(const Vec3& palette) const {
    Vec3 at = palette;
    for (std::size_t i = steps_.size(); i-- > 0;) at = converted(i, at, true);
    return at;
}

}  // namespace palette4d
