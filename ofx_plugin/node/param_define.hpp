// Defining parameters. A property or a parameter that the host refuses keeps the host's default.
#pragma once

#include <array>
#include <initializer_list>

#include "host.hpp"

namespace palette4d::node {

/// A number's default and ranges. Every number has all of them: Resolve takes none without.
template <typename Number>
struct Range {
    Number initial, min, max, display_min, display_max;
};

/// What parameters of all types say about themselves.
struct ParamText {
    const char* name;  ///< saved in users' projects: it never changes
    const char* label;
    const char* hint;
};

/// Defines parameters in a context's descriptor, in the order of the calls.
class ParamDefiner {
public:
    ParamDefiner(const Suites& suites, OfxParamSetHandle params)
        : suites_(suites), params_(params) {}

    /// What is defined from now on belongs to this group; closed where the host can close one.
    void begin_group(const char* name, const char* label);
    void end_group() { group_ = nullptr; }

    /// `mode` is one of kOfxParamStringIs…. Texts are not animated: Resolve has no such keys.
    Properties text(const ParamText& about, const char* mode, const char* initial = "") const;
    Properties number(const ParamText& about, const Range<double>& range, double increment,
                      int digits, bool animates) const;
    Properties integer(const ParamText& about, const Range<int>& range) const;
    Properties flag(const ParamText& about, bool initial) const;
    /// The options' order is their value and never changes; new ones come last.
    Properties choice(const ParamText& about, std::initializer_list<const char*> options,
                      int initial = 0) const;
    /// Animated; components from `min` to `max`, shown from 0 to 1.
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
