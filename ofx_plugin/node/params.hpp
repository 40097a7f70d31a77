// The node's parameters. Their names are saved in users' projects: they never change.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "host.hpp"

namespace palette4d::node {

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
    ~Params();
    Params(const Params&) = delete;
    Params& operator=(const Params&) = delete;

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
    /// What is set from now on is undone in one step, which ends with this object; a host without
    /// such steps does as it does. In kOfxActionInstanceChanged alone, says the standard. Nothing
    /// set, no step.
    void one_undo_step(const char* label) { step_ = label; }
    /// For instance changes only, never while rendering.
    bool set_string(const char* name, const std::string& value) const;
    bool set_int(const char* name, int value) const;
    bool set_rgb(const char* name, const std::array<double, 3>& value) const;
    bool remove_keys(const char* name) const;
    /// The same for a parameter that cannot be undone: it is no step's.
    bool note_string(const char* name, const std::string& value) const;
    /// An instance's parameter's own properties (label, secret, enabled, hint).
    Properties properties(const char* name) const;
    /// The file of the media, in a host that tells it; else empty.
    std::string media() const;

private:
    OfxParamHandle find(const char* name) const;
    void begin_step() const;

    const Suites& suites_;
    OfxImageEffectHandle effect_;
    const OfxParameterSuiteV1* suite_;
    OfxParamSetHandle set_ = nullptr;
    mutable const char* step_ = nullptr;  ///< the label of one that is to begin
    mutable bool in_step_ = false;
};

}  // namespace palette4d::node
