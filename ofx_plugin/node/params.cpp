#include "params.hpp"

#include <utility>

#include "gpu_render.hpp"
#include "handle_params.hpp"
#include "host_time.hpp"
#include "output_params.hpp"
#include "param_define.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {
void define_status(ParamDefiner& define, const Suites& suites) {
    const Properties status =
        define.text({kParamStatus, "Status",
                     "The loaded sidecar and the frame shown, or what is wrong with the sidecar."},
                    kOfxParamStringIsMultiLine, "No sidecar chosen");
    // Natron draws disabled text black on dark grey, so the status stays enabled there.
    status.set_int(kOfxParamPropEnabled, suites.is_natron);
    status.set_int(kOfxParamPropEvaluateOnChange, 0);
    status.set_int(kOfxParamPropCanUndo, 0);
}

void define_params(const Suites& suites, OfxParamSetHandle params) {
    ParamDefiner define(suites, params);
    define_file_params(define);

    define_status(define, suites);
    define.number({kParamStrength, "Strength",
                   "How much of the edit applies: 0 is the original picture, 1 the full edit."},
                  {1, 0, 1, 0, 1}, 0.01, 3, true);
    if (renders_on_gpus(suites)) define_gpu_param(define);
    define_output_params(define);
    define_handle_params(define);
    define_time_params(define);
}

Params::Params(const Suites& suites, OfxImageEffectHandle effect)
    : suites_(suites), effect_(effect), suite_(suites.parameter) {
    if (!suites.effect->getParamSet || suites.effect->getParamSet(effect, &set_) != kOfxStatOK) {
        set_ = nullptr;
    }
}

Params::~Params() {
    if (in_step_) suite_->paramEditEnd(set_);
}

void Params::begin_step() const {
    const char* label = std::exchange(step_, nullptr);
    if (!label || !set_ || !suite_->paramEditBegin || !suite_->paramEditEnd) return;
    in_step_ = suite_->paramEditBegin(set_, label) == kOfxStatOK;
}

OfxParamHandle Params::find(const char* name) const {
    OfxParamHandle param = nullptr;
    if (!set_ || !suite_->paramGetHandle ||
        suite_->paramGetHandle(set_, name, &param, nullptr) != kOfxStatOK) {
        return nullptr;
    }
    return param;
}

Properties Params::properties(const char* name) const {
    OfxPropertySetHandle handle = nullptr;
    const OfxParamHandle param = find(name);
    if (!param || !suite_->paramGetPropertySet ||
        suite_->paramGetPropertySet(param, &handle) != kOfxStatOK) {
        handle = nullptr;
    }
    return {suites_, handle};
}

std::string Params::media() const {
    OfxPropertySetHandle handle = nullptr;
    if (!suites_.effect->getPropertySet ||
        suites_.effect->getPropertySet(effect_, &handle) != kOfxStatOK) {
        return "";
    }
    return Properties(suites_, handle).get_string(kResolvePropSrcFilePath).value_or("");
}

std::optional<std::string> Params::text(const char* name, const OfxTime* time) const {
    const char* text = value<char*>(name, time).value_or(nullptr);
    return text ? std::optional<std::string>(text) : std::nullopt;
}

std::optional<std::array<double, 3>> Params::rgb(const char* name, const OfxTime* time) const {
    std::array<double, 3> rgb{};
    if (!read(name, time, &rgb[0], &rgb[1], &rgb[2])) return std::nullopt;
    return rgb;
}

bool Params::animated(const char* name) const {
    unsigned int keys = 0;
    const OfxParamHandle param = find(name);
    return param && suite_->paramGetNumKeys &&
           suite_->paramGetNumKeys(param, &keys) == kOfxStatOK && keys > 0;
}

bool Params::set_string(const char* name, const std::string& value) const {
    begin_step();
    return note_string(name, value);
}

bool Params::note_string(const char* name, const std::string& value) const {
    const OfxParamHandle param = find(name);
    return param && suite_->paramSetValue &&
           suite_->paramSetValue(param, value.c_str()) == kOfxStatOK;
}

bool Params::set_int(const char* name, int value) const {
    begin_step();
    const OfxParamHandle param = find(name);
    return param && suite_->paramSetValue && suite_->paramSetValue(param, value) == kOfxStatOK;
}

bool Params::set_rgb(const char* name, const std::array<double, 3>& value) const {
    begin_step();
    const OfxParamHandle param = find(name);
    return param && suite_->paramSetValue &&
           suite_->paramSetValue(param, value[0], value[1], value[2]) == kOfxStatOK;
}

bool Params::remove_keys(const char* name) const {
    begin_step();
    const OfxParamHandle param = find(name);
    return param && suite_->paramDeleteAllKeys && suite_->paramDeleteAllKeys(param) == kOfxStatOK;
}

}  // namespace palette4d::node
