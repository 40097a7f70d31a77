#include "params.hpp"

namespace palette4d::plugin {
namespace {

// A clip of four million frames is 48 hours at 24 frames a second; Resolve wants finite ranges.
constexpr double kLargestOffset = 4e6;

Properties define(const Suites& suites, OfxParamSetHandle params, const char* type,
                  const char* name, const char* label, const char* hint) {
    OfxPropertySetHandle handle = nullptr;
    if (!suites.parameter->paramDefine ||
        suites.parameter->paramDefine(params, type, name, &handle) != kOfxStatOK) {
        handle = nullptr;
    }
    const Properties properties(suites, handle);
    properties.set_string(kOfxPropLabel, label);
    properties.set_string(kOfxParamPropScriptName, name);
    properties.set_string(kOfxParamPropHint, hint);
    return properties;
}

void set_range(const Properties& param, double initial, double min, double max, double display_min,
               double display_max) {
    param.set_double(kOfxParamPropDefault, initial);
    param.set_double(kOfxParamPropMin, min);
    param.set_double(kOfxParamPropMax, max);
    param.set_double(kOfxParamPropDisplayMin, display_min);
    param.set_double(kOfxParamPropDisplayMax, display_max);
}

}  // namespace

void define_params(const Suites& suites, OfxParamSetHandle params) {
    const Properties sidecar =
        define(suites, params, kOfxParamTypeString, kParamSidecar, "Sidecar",
               "The clip's palette and its edits, a file made by 'palette4d analyze'. Read again "
               "whenever it changes.");
    sidecar.set_string(kOfxParamPropStringMode, kOfxParamStringIsFilePath);
    sidecar.set_int(kOfxParamPropStringFilePathExists, 1);
    sidecar.set_string(kOfxParamPropDefault, "");
    sidecar.set_int(kOfxParamPropAnimates, 0);

    const Properties strength =
        define(suites, params, kOfxParamTypeDouble, kParamStrength, "Strength",
               "How much of the edit is applied: 0 is the original picture, 1 the edit.");
    strength.set_string(kOfxParamPropDoubleType, kOfxParamDoubleTypePlain);
    set_range(strength, 1, 0, 1, 0, 1);
    strength.set_double(kOfxParamPropIncrement, 0.01);
    strength.set_int(kOfxParamPropDigits, 3);
    strength.set_int(kOfxParamPropAnimates, 1);

    const Properties offset = define(
        suites, params, kOfxParamTypeDouble, kParamFrameOffset, "Frame offset",
        "Frames added to the host's time before the palette is looked up: the host's frame 0 "
        "shows the analysed clip's first frame plus this.");
    offset.set_string(kOfxParamPropDoubleType, kOfxParamDoubleTypePlain);
    set_range(offset, 0, -kLargestOffset, kLargestOffset, -1000, 1000);
    offset.set_double(kOfxParamPropIncrement, 1);
    offset.set_int(kOfxParamPropDigits, 2);
    offset.set_int(kOfxParamPropAnimates, 0);

    const Properties status = define(suites, params, kOfxParamTypeString, kParamStatus, "Status",
                                     "What was loaded, or what is wrong with the sidecar.");
    status.set_string(kOfxParamPropStringMode, kOfxParamStringIsLabel);
    status.set_string(kOfxParamPropDefault, "No sidecar chosen");
    status.set_int(kOfxParamPropAnimates, 0);
    status.set_int(kOfxParamPropEnabled, 0);
    status.set_int(kOfxParamPropPersistant, 0);
    status.set_int(kOfxParamPropEvaluateOnChange, 0);
    status.set_int(kOfxParamPropCanUndo, 0);
}

Params::Params(const Suites& suites, OfxImageEffectHandle effect) : suite_(suites.parameter) {
    if (!suites.effect->getParamSet || suites.effect->getParamSet(effect, &set_) != kOfxStatOK) {
        set_ = nullptr;
    }
}

OfxParamHandle Params::find(const char* name) const {
    OfxParamHandle param = nullptr;
    if (!set_ || !suite_->paramGetHandle ||
        suite_->paramGetHandle(set_, name, &param, nullptr) != kOfxStatOK) {
        return nullptr;
    }
    return param;
}

std::optional<std::string> Params::string_at(const char* name, OfxTime time) const {
    char* value = nullptr;
    const OfxParamHandle param = find(name);
    if (!param || !suite_->paramGetValueAtTime ||
        suite_->paramGetValueAtTime(param, time, &value) != kOfxStatOK || !value) {
        return std::nullopt;
    }
    return std::string(value);
}

std::optional<double> Params::double_at(const char* name, OfxTime time) const {
    double value = 0;
    const OfxParamHandle param = find(name);
    if (!param || !suite_->paramGetValueAtTime ||
        suite_->paramGetValueAtTime(param, time, &value) != kOfxStatOK) {
        return std::nullopt;
    }
    return value;
}

std::optional<std::string> Params::string_now(const char* name) const {
    char* value = nullptr;
    const OfxParamHandle param = find(name);
    if (!param || !suite_->paramGetValue || suite_->paramGetValue(param, &value) != kOfxStatOK ||
        !value) {
        return std::nullopt;
    }
    return std::string(value);
}

bool Params::set_string(const char* name, const std::string& value) const {
    const OfxParamHandle param = find(name);
    return param && suite_->paramSetValue &&
           suite_->paramSetValue(param, value.c_str()) == kOfxStatOK;
}

}  // namespace palette4d::plugin
