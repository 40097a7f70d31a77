// The node's parameters. Users' projects save their names: never change them.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "host.hpp"
#include "param_define.hpp"

namespace palette4d::node {

inline constexpr const char* kParamSidecar = "sidecar";
inline constexpr const char* kParamStrength = "strength";
inline constexpr const char* kParamFrameOffset = "frameOffset";
inline constexpr const char* kParamStatus = "status";

/// The line that says what was loaded, or what is wrong.
void define_status(ParamDefiner& define, const Suites& suites);

/// Defines them in a context's descriptor. What the host refuses keeps the host's default.
void define_params(const Suites& suites, OfxParamSetHandle params);

/// Reads and writes one instance's parameters. Results are empty where the host refuses.
class Params {
public:
    /// A time for parameters that do not animate.
    static constexpr OfxTime kAnyTime = 0;

    Params(const Suites& suites, OfxImageEffectHandle effect);
    ~Params();
    Params(const Params&) = delete;
    Params& operator=(const Params&) = delete;

    /// With a time: allowed in every action.
    std::optional<std::string> string_at(const char* name, OfxTime time) const {
        return text(name, &time);
    }
    std::optional<double> double_at(const char* name, OfxTime time) const {
        return value<double>(name, &time);
    }
    /// Integers, choices (the option's index) and booleans (0 or 1).
    std::optional<int> int_at(const char* name, OfxTime time) const {
        return value<int>(name, &time);
    }
    std::optional<std::array<double, 3>> rgb_at(const char* name, OfxTime time) const {
        return rgb(name, &time);
    }
    /// Without a time: only in kOfxActionInstanceChanged, as ofxParam.h says.
    std::optional<std::string> string_now(const char* name) const { return text(name, nullptr); }
    std::optional<int> int_now(const char* name) const { return value<int>(name, nullptr); }
    std::optional<std::array<double, 3>> rgb_now(const char* name) const {
        return rgb(name, nullptr);
    }
    /// Whether the parameter has keyframes.
    bool animated(const char* name) const;
    /// Makes all later changes one undo step, which ends with this object. Without changes there is
    /// no step; hosts without undo steps ignore it. The standard allows this in
    /// kOfxActionInstanceChanged only.
    void one_undo_step(const char* label) { step_ = label; }
    /// Only in kOfxActionInstanceChanged, never while rendering.
    bool set_string(const char* name, const std::string& value) const;
    bool set_int(const char* name, int value) const;
    bool set_rgb(const char* name, const std::array<double, 3>& value) const;
    bool remove_keys(const char* name) const;
    /// The same for a parameter without undo; it belongs to no step.
    bool note_string(const char* name, const std::string& value) const;
    /// The instance's own properties of a parameter (label, secret, enabled, hint).
    Properties properties(const char* name) const;
    /// The media file, in hosts that report it; else empty.
    std::string media() const;

private:
    /// The parameter's value at a time, or now (null); false where the host refuses.
    template <typename... Values>
    bool read(const char* name, const OfxTime* time, Values*... values) const {
        const OfxParamHandle param = find(name);
        if (!param) return false;
        if (time) {
            return suite_->paramGetValueAtTime &&
                   suite_->paramGetValueAtTime(param, *time, values...) == kOfxStatOK;
        }
        return suite_->paramGetValue && suite_->paramGetValue(param, values...) == kOfxStatOK;
    }
    template <typename Value>
    std::optional<Value> value(const char* name, const OfxTime* time) const {
        Value value{};
        return read(name, time, &value) ? std::optional<Value>(value) : std::nullopt;
    }
    std::optional<std::string> text(const char* name, const OfxTime* time) const;
    std::optional<std::array<double, 3>> rgb(const char* name, const OfxTime* time) const;
    OfxParamHandle find(const char* name) const;
    void begin_step() const;

    const Suites& suites_;
    OfxImageEffectHandle effect_;
    const OfxParameterSuiteV1* suite_;
    OfxParamSetHandle set_ = nullptr;
    mutable const char* step_ = nullptr;  ///< the label of a step that has not begun
    mutable bool in_step_ = false;
};

}  // namespace palette4d::node
