// The node's parameters. Their names are saved in users' projects: they never change.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "host.hpp"

namespace palette4d::plugin {

inline constexpr const char* kParamSidecar = "sidecar";
inline constexpr const char* kParamStrength = "strength";
inline constexpr const char* kParamFrameOffset = "frameOffset";
inline constexpr const char* kParamStatus = "status";

/// Defines them in a context's descriptor. A property or a parameter that the host refuses keeps
/// its default.
void define_params(const Suites& suites, OfxParamSetHandle params);

/// Reads and writes one instance's parameters. Empty where the host refuses.
class Params {
public:
    Params(const Suites& suites, OfxImageEffectHandle effect);

    /// At a time: the one way that is allowed while rendering.
    std::optional<std::string> string_at(const char* name, OfxTime time) const;
    std::optional<double> double_at(const char* name, OfxTime time) const;
    /// Integers, choices (the option's number) and booleans (0 or 1).
    std::optional<int> int_at(const char* name, OfxTime time) const;
    std::optional<std::array<double, 3>> rgb_at(const char* name, OfxTime time) const;
    /// Without a time: for actions other than rendering.
    std::optional<std::string> string_now(const char* name) const;
    std::optional<double> double_now(const char* name) const;
    std::optional<int> int_now(const char* name) const;
    std::optional<std::array<double, 3>> rgb_now(const char* name) const;
    /// Whether the host has keyframes for it.
    bool animated(const char* name) const;
    /// For instance changes only, never while rendering.
    bool set_string(const char* name, const std::string& value) const;
    bool set_int(const char* name, int value) const;
    bool set_rgb(const char* name, const std::array<double, 3>& value) const;
    /// An instance's parameter's own properties (label, secret, enabled, hint).
    Properties properties(const char* name) const;

private:
    OfxParamHandle find(const char* name) const;

    const Suites& suites_;
    const OfxParameterSuiteV1* suite_;
    OfxParamSetHandle set_ = nullptr;
};

}  // namespace palette4d::plugin
