#include "gpu/convert_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <variant>

#include "gpu/kernel/layout.inc"
#include "model/vec3.hpp"

namespace palette4d::gpu {
namespace {

using Numbers = std::array<double, P4D_STEP>;
/// A function of one channel.
using Function = std::array<double, 9>;

void put(const Function& function, std::size_t channel, Numbers& to) {
    std::copy(function.begin(), function.end(),
              to.begin() + 1 + static_cast<std::ptrdiff_t>(channel * function.size()));
}

/// What a log or gamma step makes of x, in its direction from x to y.
template <class Step>
Vec3 forward(Step step, double x) {
    step.inverse = false;
    return ColourConversion({step}).to_palette({x, x, x});
}

Numbers numbers_of(const MatrixStep& step, bool against) {
    const ColourConversion matrix({step});
    const auto at = [&](const Vec3& x) {
        return against ? matrix.to_clip(x) : matrix.to_palette(x);
    };
    Numbers to{P4D_MATRIX};
    const Vec3 offset = at({0, 0, 0});
    for (std::size_t c = 0; c < 3; ++c) {
        Vec3 one{0, 0, 0};
        one[c] = 1;
        const Vec3 column = at(one) - offset;
        for (std::size_t r = 0; r < 3; ++r) to[1 + 3 * r + c] = column[r];
        to[10 + c] = offset[c];
    }
    return to;
}

Numbers numbers_of(const LogStep& step, bool against) {
    const bool backward = step.inverse != against;
    Numbers to{};
    to[0] = backward ? P4D_EXP : P4D_LOG;
    const Vec3& more = step.log_offset;
    for (std::size_t c = 0; c < 3; ++c) {
        const double start = step.start[c], turn = forward(step, start)[c], below = step.below[c];
        const double scale = step.log_slope[c] / std::log2(step.base);
        const double slope = step.linear_slope[c], plus = step.linear_offset[c] / slope;
        put(backward
                ? Function{turn, turn, start, 1 / below, -more[c], 1 / scale, 0, 1 / slope, -plus}
                : Function{start, start, turn, below, plus, slope, 0, scale, more[c]},
            c, to);
    }
    return to;
}

Numbers numbers_of(const GammaStep& step, bool against) {
    const bool backward = step.inverse != against;
    Numbers to{};
    to[0] = step.mirrored ? P4D_MIRRORED : P4D_POWER;
    for (std::size_t c = 0; c < 3; ++c) {
        const double gamma = step.gamma[c], plus = step.offset[c];
        const double end = plus == 0 ? 0 : plus / (gamma - 1);
        const double slope = plus == 0 ? 1 : forward(step, end)[c] / end;
        put(backward ? Function{slope * end, 0, 0, 1 / slope, 0, 1, 1 / gamma, 1 + plus, -plus}
                     : Function{end, 0, 0, slope, plus, 1 / (1 + plus), gamma, 1, 0},
            c, to);
    }
    return to;
}

bool is_float(double value) { return std::abs(value) <= std::numeric_limits<float>::max(); }

/// A conversion's steps, and the samples of its curves.
class Steps {
public:
    /// `first` is where the samples will be.
    Steps(const ColourConversion& conversion, std::size_t first) : first_(first) {
        for (const ConversionStep& step : conversion.steps()) {
            std::visit([&](const auto& one) { add(one); }, step);
        }
        std::reverse(back.begin(), back.end());
        for (const auto* const all : {&there, &back}) {
            for (const Numbers& numbers : *all) {
                fits = fits && std::all_of(numbers.begin(), numbers.end(), is_float);
            }
        }
    }

    std::vector<Numbers> there, back;
    std::vector<float> samples;
    bool fits = true;

private:
    template <class Step>
    void add(const Step& step) {
        there.push_back(numbers_of(step, false));
        back.push_back(numbers_of(step, true));
    }
    void add(const CurveStep& step) {
        Numbers along{P4D_CURVE}, against{P4D_CURVE};
        Function found{};
        for (std::size_t c = 0; c < 3; ++c) {
            if (c < step.curves.size()) {
                const SampledCurve& curve = step.curves[c];
                found = {add(curve.x), add(curve.y), static_cast<double>(curve.x.size())};
            }
            put(found, c, along);
            std::swap(found[0], found[1]);
            put(found, c, against);
            std::swap(found[0], found[1]);
        }
        there.push_back(step.inverse ? against : along);
        back.push_back(step.inverse ? along : against);
    }
    /// Returns where they are.
    double add(const std::vector<double>& values) {
        const std::size_t start = samples.size();
        for (const double value : values) {
            fits = fits && is_float(value) &&
                   (samples.size() == start || static_cast<float>(value) > samples.back());
            samples.push_back(static_cast<float>(value));
        }
        return static_cast<double>(first_ + start);
    }

    std::size_t first_;
};

}  // namespace

bool fits(const ColourConversion& conversion) { return Steps(conversion, 0).fits; }

std::size_t table_size(const ColourConversion& conversion) {
    return 2 * P4D_STEP * conversion.steps().size();
}

void add_conversion(const ColourConversion& conversion, FrameTable& to) {
    const Steps steps(conversion, to.grids.size());
    to.table[P4D_STEPS] = static_cast<float>(steps.there.size());
    int head = P4D_STEPS;
    for (const auto* const all : {&steps.there, &steps.back}) {
        to.table[static_cast<std::size_t>(++head)] = static_cast<float>(to.table.size());
        for (const Numbers& numbers : *all) {
            for (const double value : numbers) to.table.push_back(static_cast<float>(value));
        }
    }
    to.grids.insert(to.grids.end(), steps.samples.begin(), steps.samples.end());
}

}  // namespace palette4d::gpu
