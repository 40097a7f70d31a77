// The parameter suite: values with their exact types, by time in most actions.
#include <cstdarg>
#include <filesystem>
#include <iterator>
#include <utility>

#include "strict_host.hpp"

namespace strict {
namespace {

std::mutex g_mutex;

const std::set<std::string>& known_types() {
    static const std::set<std::string> types = {
        kOfxParamTypeInteger, kOfxParamTypeDouble, kOfxParamTypeBoolean, kOfxParamTypeChoice,
        kOfxParamTypeRGB,     kOfxParamTypeString, kOfxParamTypeGroup,   kOfxParamTypePushButton};
    return types;
}

bool has_value(const OfxParamStruct& param) {
    return param.type != kOfxParamTypeGroup && param.type != kOfxParamTypePushButton;
}

/// Values may be set, and read without a time, "from within a kOfxActionInstanceChanged or interact
/// action" (ofxParam.h).
bool allowed(const char* function) {
    const std::string& action = activity().action;
    if (action == kOfxActionInstanceChanged) return true;
    Host::get().fault(std::string(function) + ": not allowed in " + action);
    return false;
}

/// A path as the host hands it out.
std::string path_of(const OfxParamStruct& param) {
    const std::string& text = std::get<std::string>(param.value);
    const std::string& project = Host::get().config().project;
    const std::string mode = param.properties.text(kOfxParamPropStringMode);
    const bool is_path =
        mode == kOfxParamStringIsFilePath || mode == kOfxParamStringIsDirectoryPath;
    if (project.empty() || !is_path || text.empty()) return text;
    if (std::filesystem::u8path(text).has_root_directory()) return text;
    return project + "/" + text;
}

OfxStatus define(OfxParamSetHandle set, const char* type, const char* name,
                 OfxPropertySetHandle* properties) {
    const Call call("paramDefine");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!set || !set->descriptor || !type || !name) {
        host.fault("paramDefine: not a descriptor's parameters, or no type or name");
        return kOfxStatErrBadHandle;
    }
    if (activity().action != kOfxImageEffectActionDescribeInContext) {
        host.fault("paramDefine: only while describing in a context");
        return kOfxStatFailed;
    }
    if (!known_types().count(type)) {
        host.fault(std::string("paramDefine: a type unknown to this host: ") + type);
        return kOfxStatErrUnknown;
    }
    if (set->params.count(name)) {
        host.fault(std::string("paramDefine: twice the name ") + name);
        return kOfxStatErrExists;
    }
    auto param = std::make_unique<OfxParamStruct>(
        OfxParamStruct{type, name, OfxPropertySetStruct(kParamDescriptor)});
    param->properties.put(kOfxPropType, std::string(kOfxTypeParameter));
    param->properties.put(kOfxParamPropType, std::string(type));
    param->properties.put(kOfxPropName, std::string(name));
    if (properties) *properties = &param->properties;
    set->order.emplace_back(name);
    set->params[name] = std::move(param);
    return kOfxStatOK;
}

OfxStatus get_handle(OfxParamSetHandle set, const char* name, OfxParamHandle* param,
                     OfxPropertySetHandle* properties) {
    const Call call("paramGetHandle");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!set || set->descriptor || !name) {
        host.fault("paramGetHandle: not an instance's parameters, or no name");
        return kOfxStatErrBadHandle;
    }
    const auto found = set->params.find(name);
    if (found == set->params.end()) {
        // With a refused definition the plugin may well ask for what is not there.
        if (!host.refused()) host.fault(std::string("paramGetHandle: no parameter ") + name);
        return kOfxStatErrUnknown;
    }
    if (param) *param = found->second.get();
    if (properties) *properties = &found->second->properties;
    return kOfxStatOK;
}

OfxStatus set_properties(OfxParamSetHandle set, OfxPropertySetHandle* properties) {
    const Call call("paramSetGetPropertySet");
    if (call.refused() || !set) return kOfxStatErrBadHandle;
    *properties = &set->properties;
    return kOfxStatOK;
}

OfxStatus param_properties(OfxParamHandle param, OfxPropertySetHandle* properties) {
    const Call call("paramGetPropertySet");
    if (call.refused() || !param) return kOfxStatErrBadHandle;
    *properties = &param->properties;
    return kOfxStatOK;
}

double mixed(double a, double b, double w) { return (1 - w) * a + w * b; }
Colour mixed(const Colour& a, const Colour& b, double w) {
    return {mixed(a[0], b[0], w), mixed(a[1], b[1], w), mixed(a[2], b[2], w)};
}

/// Doubles and colours may be animated.
template <typename T>
T at_time(const OfxParamStruct& param, double time) {
    if (param.keys.empty()) return std::get<T>(param.value);
    const auto after = param.keys.lower_bound(time);
    if (after == param.keys.end()) return std::get<T>(param.keys.rbegin()->second);
    if (after == param.keys.begin() || after->first == time) return std::get<T>(after->second);
    const auto before = std::prev(after);
    return mixed(std::get<T>(before->second), std::get<T>(after->second),
                 (time - before->first) / (after->first - before->first));
}

OfxStatus read(OfxParamHandle param, double time, va_list arguments) {
    if (!param || !has_value(*param)) {
        Host::get().fault("a value asked for without a parameter, or of one that has none");
        return kOfxStatErrBadHandle;
    }
    const std::lock_guard<std::mutex> lock(g_mutex);
    if (param->type == kOfxParamTypeDouble) {
        *va_arg(arguments, double*) = at_time<double>(*param, time);
    } else if (param->type == kOfxParamTypeString) {
        *va_arg(arguments, char**) = lend(path_of(*param));
    } else if (param->type == kOfxParamTypeRGB) {
        for (const double component : at_time<Colour>(*param, time)) {
            *va_arg(arguments, double*) = component;
        }
    } else {
        *va_arg(arguments, int*) = std::get<int>(param->value);
    }
    return kOfxStatOK;
}

OfxStatus get_value(OfxParamHandle param, ...) {
    const Call call("paramGetValue");
    if (call.refused()) return kOfxStatFailed;
    allowed("paramGetValue");
    va_list arguments;
    va_start(arguments, param);
    const OfxStatus status = read(param, 0, arguments);
    va_end(arguments);
    return status;
}

OfxStatus get_value_at(OfxParamHandle param, OfxTime time, ...) {
    const Call call("paramGetValueAtTime");
    if (call.refused()) return kOfxStatFailed;
    va_list arguments;
    va_start(arguments, time);
    const OfxStatus status = read(param, time, arguments);
    va_end(arguments);
    return status;
}

OfxStatus set_value(OfxParamHandle param, ...) {
    const Call call("paramSetValue");
    if (call.refused()) return kOfxStatFailed;
    if (!allowed("paramSetValue")) return kOfxStatFailed;
    if (!param || !has_value(*param)) {
        Host::get().fault("paramSetValue: no parameter, or one without a value");
        return kOfxStatErrBadHandle;
    }
    const Value before = param->value;
    va_list arguments;
    va_start(arguments, param);
    {
        const std::lock_guard<std::mutex> lock(g_mutex);
        if (param->type == kOfxParamTypeDouble) {
            param->value = va_arg(arguments, double);
        } else if (param->type == kOfxParamTypeString) {
            param->value = std::string(va_arg(arguments, const char*));
        } else if (param->type == kOfxParamTypeRGB) {
            Colour colour;
            for (double& component : colour) component = va_arg(arguments, double);
            param->value = colour;
        } else {
            param->value = va_arg(arguments, int);
        }
    }
    va_end(arguments);
    if (param->on_set) param->on_set(param->name, before);
    return kOfxStatOK;
}

OfxStatus unexpected(const char* function) {
    Host::get().fault(std::string(function) + ": not expected of this plugin");
    return kOfxStatErrUnsupported;
}
OfxStatus derivative(OfxParamHandle, OfxTime, ...) { return unexpected("paramGetDerivative"); }
OfxStatus integral(OfxParamHandle, OfxTime, OfxTime, ...) { return unexpected("paramGetIntegral"); }
OfxStatus set_at(OfxParamHandle, OfxTime, ...) { return unexpected("paramSetValueAtTime"); }
OfxStatus num_keys(OfxParamHandle param, unsigned int* count) {
    const Call call("paramGetNumKeys");
    if (call.refused() || !param || !count) return kOfxStatFailed;
    *count = static_cast<unsigned int>(param->keys.size());
    return kOfxStatOK;
}
OfxStatus key_time(OfxParamHandle, unsigned int, OfxTime*) { return unexpected("paramGetKeyTime"); }
OfxStatus key_index(OfxParamHandle, OfxTime, int, int*) { return unexpected("paramGetKeyIndex"); }
OfxStatus delete_key(OfxParamHandle, OfxTime) { return unexpected("paramDeleteKey"); }
OfxStatus delete_keys(OfxParamHandle param) {
    const Call call("paramDeleteAllKeys");
    if (call.refused() || !param || !allowed("paramDeleteAllKeys")) return kOfxStatFailed;
    const Value before = param->value;
    const std::map<double, Value> keys = std::exchange(param->keys, {});
    if (!keys.empty()) param->value = keys.begin()->second;
    if (param->on_set) param->on_set(param->name, before);
    if (param->set && param->set->open_step) param->set->open_step->keys.emplace(param->name, keys);
    return kOfxStatOK;
}
OfxStatus copy(OfxParamHandle, OfxParamHandle, OfxTime, const OfxRangeD*) {
    return unexpected("paramCopy");
}
OfxStatus edit_begin(OfxParamSetHandle set, const char* label) {
    const Call call("paramEditBegin");
    if (call.refused()) return kOfxStatFailed;
    Host& host = Host::get();
    if (!set || set->descriptor || !label || !*label) {
        host.fault("paramEditBegin: not an instance's parameters, or no label");
        return kOfxStatErrBadHandle;
    }
    if (activity().action != kOfxActionInstanceChanged) {
        host.fault("paramEditBegin: only while an instance changes");
        return kOfxStatFailed;
    }
    if (host.config().edit_answer != kOfxStatOK) return host.config().edit_answer;
    if (set->open_step) host.fault("paramEditBegin: one has begun already");
    set->open_step = UndoStep{label, {}};
    return kOfxStatOK;
}

OfxStatus edit_end(OfxParamSetHandle set) {
    const Call call("paramEditEnd");
    if (call.refused()) {
        if (set) set->open_step.reset();  // the plugin has done its part
        return kOfxStatFailed;
    }
    if (!set || !set->open_step) {
        Host::get().fault("paramEditEnd: none has begun");
        return kOfxStatErrBadHandle;
    }
    if (set->open_step->before.empty() && Host::get().has_undo_steps()) {
        Host::get().fault("paramEditEnd: nothing to undo was set");
    }
    set->steps.push_back(*std::exchange(set->open_step, std::nullopt));
    if (Host::get().config().natron && set->on_edit_end) {
        activity().locked = true;
        set->on_edit_end();
        activity().locked = false;
    }
    return kOfxStatOK;
}

const OfxParameterSuiteV1 kParameterSuite = {
    define,      get_handle, set_properties, param_properties, get_value, get_value_at, derivative,
    integral,    set_value,  set_at,         num_keys,         key_time,  key_index,    delete_key,
    delete_keys, copy,       edit_begin,     edit_end};

}  // namespace

SuiteTable parameter_suite() {
    using S = OfxParameterSuiteV1;
    return {&kParameterSuite,
            sizeof kParameterSuite,
            {{"paramDefine", offsetof(S, paramDefine)},
             {"paramGetHandle", offsetof(S, paramGetHandle)},
             {"paramGetPropertySet", offsetof(S, paramGetPropertySet)},
             {"paramGetValue", offsetof(S, paramGetValue)},
             {"paramGetValueAtTime", offsetof(S, paramGetValueAtTime)},
             {"paramSetValue", offsetof(S, paramSetValue)},
             {"paramGetNumKeys", offsetof(S, paramGetNumKeys)},
             {"paramDeleteAllKeys", offsetof(S, paramDeleteAllKeys)},
             {"paramEditBegin", offsetof(S, paramEditBegin)},
             {"paramEditEnd", offsetof(S, paramEditEnd)}}};
}

}  // namespace strict
