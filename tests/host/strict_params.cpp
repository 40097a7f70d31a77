// The parameter suite: values with their exact types, by time only while rendering.
#include <cstdarg>
#include <iterator>

#include "strict_host.hpp"

namespace strict {
namespace {

std::mutex g_mutex;

bool rendering() { return activity().action == kOfxImageEffectActionRender; }

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
    if (type != std::string(kOfxParamTypeDouble) && type != std::string(kOfxParamTypeString)) {
        host.fault(std::string("paramDefine: a type unknown to this host: ") + type);
        return kOfxStatErrUnknown;
    }
    if (set->params.count(name)) {
        host.fault(std::string("paramDefine: twice the name ") + name);
        return kOfxStatErrExists;
    }
    auto param = std::make_unique<OfxParamStruct>(
        OfxParamStruct{type, name, OfxPropertySetStruct(kParamDescriptor), 0.0, {}});
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

double at_time(const OfxParamStruct& param, double time) {
    if (param.keys.empty()) return std::get<double>(param.value);
    const auto after = param.keys.lower_bound(time);
    if (after == param.keys.end()) return param.keys.rbegin()->second;
    if (after == param.keys.begin() || after->first == time) return after->second;
    const auto before = std::prev(after);
    const double w = (time - before->first) / (after->first - before->first);
    return (1 - w) * before->second + w * after->second;
}

OfxStatus read(OfxParamHandle param, double time, va_list arguments) {
    if (!param) {
        Host::get().fault("a parameter's value asked for without a parameter");
        return kOfxStatErrBadHandle;
    }
    const std::lock_guard<std::mutex> lock(g_mutex);
    if (param->type == kOfxParamTypeDouble) {
        *va_arg(arguments, double*) = at_time(*param, time);
    } else {
        *va_arg(arguments, char**) = lend(std::get<std::string>(param->value));
    }
    return kOfxStatOK;
}

OfxStatus get_value(OfxParamHandle param, ...) {
    const Call call("paramGetValue");
    if (call.refused()) return kOfxStatFailed;
    if (rendering()) Host::get().fault("paramGetValue: while rendering; it has no time");
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
    const std::string& action = activity().action;
    if (action != kOfxActionCreateInstance && action != kOfxActionBeginInstanceChanged &&
        action != kOfxActionInstanceChanged && action != kOfxActionEndInstanceChanged &&
        action != kOfxActionSyncPrivateData) {
        Host::get().fault("paramSetValue: not allowed in " + action);
        return kOfxStatFailed;
    }
    if (!param) return kOfxStatErrBadHandle;
    va_list arguments;
    va_start(arguments, param);
    {
        const std::lock_guard<std::mutex> lock(g_mutex);
        if (param->type == kOfxParamTypeDouble) {
            param->value = va_arg(arguments, double);
        } else {
            param->value = std::string(va_arg(arguments, const char*));
        }
    }
    va_end(arguments);
    if (param->on_set) param->on_set(param->name);
    return kOfxStatOK;
}

OfxStatus unexpected(const char* function) {
    Host::get().fault(std::string(function) + ": not expected of this plugin");
    return kOfxStatErrUnsupported;
}
OfxStatus derivative(OfxParamHandle, OfxTime, ...) { return unexpected("paramGetDerivative"); }
OfxStatus integral(OfxParamHandle, OfxTime, OfxTime, ...) { return unexpected("paramGetIntegral"); }
OfxStatus set_at(OfxParamHandle, OfxTime, ...) { return unexpected("paramSetValueAtTime"); }
OfxStatus num_keys(OfxParamHandle, unsigned int*) { return unexpected("paramGetNumKeys"); }
OfxStatus key_time(OfxParamHandle, unsigned int, OfxTime*) { return unexpected("paramGetKeyTime"); }
OfxStatus key_index(OfxParamHandle, OfxTime, int, int*) { return unexpected("paramGetKeyIndex"); }
OfxStatus delete_key(OfxParamHandle, OfxTime) { return unexpected("paramDeleteKey"); }
OfxStatus delete_keys(OfxParamHandle) { return unexpected("paramDeleteAllKeys"); }
OfxStatus copy(OfxParamHandle, OfxParamHandle, OfxTime, const OfxRangeD*) {
    return unexpected("paramCopy");
}
OfxStatus edit_begin(OfxParamSetHandle, const char*) { return unexpected("paramEditBegin"); }
OfxStatus edit_end(OfxParamSetHandle) { return unexpected("paramEditEnd"); }

const OfxParameterSuiteV1 kSuite = {
    define,      get_handle, set_properties, param_properties, get_value, get_value_at, derivative,
    integral,    set_value,  set_at,         num_keys,         key_time,  key_index,    delete_key,
    delete_keys, copy,       edit_begin,     edit_end};

}  // namespace

SuiteTable parameter_suite() {
    using S = OfxParameterSuiteV1;
    return {&kSuite,
            sizeof kSuite,
            {{"paramDefine", offsetof(S, paramDefine)},
             {"paramGetHandle", offsetof(S, paramGetHandle)},
             {"paramGetValue", offsetof(S, paramGetValue)},
             {"paramGetValueAtTime", offsetof(S, paramGetValueAtTime)},
             {"paramSetValue", offsetof(S, paramSetValue)}}};
}

}  // namespace strict
