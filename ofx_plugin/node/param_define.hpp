// Defines parameters. A property or parameter that the host refuses keeps the host's default.
#pragma once

#include <array>
#include <initializer_list>

#include "host.hpp"

namespace palette4d::node {

/// A number's default and ranges. All are required: Resolve refuses numbers without them.
template <typename Number>
struct Range {
    Number initial, min, max, display_min, display_max;
};

/// The names and hint that parameters of every type have.
struct ParamText {
    const char* name;  ///< saved in users' projects; never change it
    const char* label;
    const char* hint;
};

/// Defines parameters in a context's descriptor, in call order.
class ParamDefiner {
public:
    ParamDefiner(const Suites& suites, OfxParamSetHandle params)
        : suites_(suites), params_(params) {}

    /// Opens a group for the parameters that follow; shown closed where the host supports it.
    void begin_group(const char* name, const char* label);
    void end_group() { group_ = nullptr; }

    /// `mode` is one of kOfxParamStringIs…. Not animated: Resolve has no keyframes for texts.
    Properties text(const ParamText& about, const char* mode, const char* initial = "") const;
    Properties number(const ParamText& about, const Range<double>& range, double increment,
                      int digits, bool animates) const;
    Properties integer(const ParamText& about, const Range<int>& range) const;
    Properties flag(const ParamText& about, bool initial) const;
    /// Projects save an option's index: never reorder options, append new ones.
    Properties choice(const ParamText& about, std::initializer_list<const char*> options,
                      int initial = 0) const;
    /// Animated. Components go from `min` to `max`; sliders show 0 to 1.
    Properties colour(const ParamText& about, const std::array<double, 3>& initial, double min,
                      double max) const;
    Properties button(const ParamText& about) const;

private:
    Properties define(const char* type, const ParamText& about) const;

    const Suites& suites_;
    OfxParamSetHandle params_;
    const char* group_ = nullptr;
};

}  // namespace palette4d::node
