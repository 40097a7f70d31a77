#include "param_define.hpp"

namespace palette4d::node {

Properties ParamDefiner::define(const char* type, const ParamText& about) const {
    OfxPropertySetHandle handle = nullptr;
    if (!suites_.parameter->paramDefine ||
        suites_.parameter->paramDefine(params_, type, about.name, &handle) != kOfxStatOK) {
        handle = nullptr;
    }
    const Properties properties(suites_, handle);
    properties.set_string(kOfxPropLabel, about.label);
    properties.set_string(kOfxParamPropScriptName, about.name);
    if (about.hint) properties.set_string(kOfxParamPropHint, about.hint);
    if (group_) properties.set_string(kOfxParamPropParent, group_);
    return properties;
}

void ParamDefiner::begin_group(const char* name, const char* label) {
    group_ = nullptr;
    const Properties group = define(kOfxParamTypeGroup, {name, label, nullptr});
    group.set_int(kOfxParamPropGroupOpen, 0);
    // If the host refuses the group, parameters still appear in order.
    if (group) group_ = name;
}

Properties ParamDefiner::text(const ParamText& about, const char* mode, const char* initial) const {
    const Properties param = define(kOfxParamTypeString, about);
    param.set_string(kOfxParamPropStringMode, mode);
    param.set_string(kOfxParamPropDefault, initial);
    param.set_int(kOfxParamPropAnimates, 0);
    return param;
}

Properties ParamDefiner::number(const ParamText& about, const Range<double>& range,
                                double increment, int digits, bool animates) const {
    const Properties param = define(kOfxParamTypeDouble, about);
    param.set_string(kOfxParamPropDoubleType, kOfxParamDoubleTypePlain);
    param.set_double(kOfxParamPropDefault, range.initial);
    param.set_double(kOfxParamPropMin, range.min);
    param.set_double(kOfxParamPropMax, range.max);
    param.set_double(kOfxParamPropDisplayMin, range.display_min);
    param.set_double(kOfxParamPropDisplayMax, range.display_max);
    param.set_double(kOfxParamPropIncrement, increment);
    param.set_int(kOfxParamPropDigits, digits);
    param.set_int(kOfxParamPropAnimates, animates);
    return param;
}

Properties ParamDefiner::integer(const ParamText& about, const Range<int>& range) const {
    const Properties param = define(kOfxParamTypeInteger, about);
    param.set_int(kOfxParamPropDefault, range.initial);
    param.set_int(kOfxParamPropMin, range.min);
    param.set_int(kOfxParamPropMax, range.max);
    param.set_int(kOfxParamPropDisplayMin, range.display_min);
    param.set_int(kOfxParamPropDisplayMax, range.display_max);
    param.set_int(kOfxParamPropAnimates, 0);
    return param;
}

Properties ParamDefiner::flag(const ParamText& about, bool initial) const {
    const Properties param = define(kOfxParamTypeBoolean, about);
    param.set_int(kOfxParamPropDefault, initial);
    param.set_int(kOfxParamPropAnimates, 0);
    return param;
}

Properties ParamDefiner::choice(const ParamText& about, std::initializer_list<const char*> options,
                                int initial) const {
    const Properties param = define(kOfxParamTypeChoice, about);
    param.set_strings(kOfxParamPropChoiceOption, options);
    param.set_int(kOfxParamPropDefault, initial);
    param.set_int(kOfxParamPropAnimates, 0);
    return param;
}

Properties ParamDefiner::colour(const ParamText& about, const std::array<double, 3>& initial,
                                double min, double max) const {
    const Properties param = define(kOfxParamTypeRGB, about);
    param.set_doubles(kOfxParamPropDefault, {initial[0], initial[1], initial[2]});
    param.set_doubles(kOfxParamPropMin, {min, min, min});
    param.set_doubles(kOfxParamPropMax, {max, max, max});
    param.set_doubles(kOfxParamPropDisplayMin, {0, 0, 0});
    param.set_doubles(kOfxParamPropDisplayMax, {1, 1, 1});
    param.set_int(kOfxParamPropAnimates, 1);
    return param;
}

Properties ParamDefiner::button(const ParamText& about) const {
    return define(kOfxParamTypePushButton, about);
}

}  // namespace palette4d::node
