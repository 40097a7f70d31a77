// The property suite: every name, type, dimension and direction is checked against a table.
#include <cstring>
#include <set>

#include "strict_host.hpp"

namespace strict {
namespace {

enum Type { kInt, kDouble, kString, kPointer };
constexpr const char* kTypeNames[] = {"int", "double", "string", "pointer"};

struct Rule {
    Type type;
    int dimension;      ///< 0: any
    unsigned readable;  ///< kinds of sets that have it
    unsigned writable;  ///< kinds of sets on which a plugin may set it
};

constexpr unsigned kDescriptors = kEffectDescriptor | kClipDescriptor | kParamDescriptor;
constexpr unsigned kAnyParam = kParamDescriptor | kParam;
constexpr unsigned kAnyEffect = kEffectDescriptor | kEffect;
constexpr unsigned kAnyClip = kClipDescriptor | kClip;

const std::map<std::string, Rule>& rules() {
    static const std::map<std::string, Rule> table = {
        {kOfxPropType, {kString, 1, ~0u, 0}},
        {kOfxPropName, {kString, 1, kHost | kAnyClip | kAnyParam | kInArgs | kOutArgs, kOutArgs}},
        {kOfxPropLabel,
         {kString, 1, kHost | kAnyEffect | kAnyClip | kAnyParam, kDescriptors | kParam}},
        {kOfxPropShortLabel, {kString, 1, kAnyEffect | kAnyClip | kAnyParam, kDescriptors}},
        {kOfxPropLongLabel, {kString, 1, kAnyEffect | kAnyClip | kAnyParam, kDescriptors}},
        {kOfxPropVersion, {kInt, 0, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxPropVersionLabel, {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxPropPluginDescription, {kString, 1, kEffectDescriptor, kEffectDescriptor}},
        {kOfxPropAPIVersion, {kInt, 0, kHost, 0}},
        {"NatronOfxHostIsNatron", {kInt, 1, kHost, 0}},  // its own
        {kOfxPluginPropFilePath, {kString, 1, kEffectDescriptor, 0}},
        {"OfxImageEffectPropSrcFilePath", {kString, 1, kEffect, 0}},  // Resolve's
        {kOfxImageEffectPropProjectSize, {kDouble, 2, kEffect, 0}},
        {kOfxImageEffectPropProjectOffset, {kDouble, 2, kEffect, 0}},
        {kOfxImageEffectPropProjectPixelAspectRatio, {kDouble, 1, kEffect, 0}},
        {"OfxImageEffectPropSrcFrame", {kInt, 1, kInArgs, 0}},  // likewise
        {kOfxPropTime, {kDouble, 1, kInArgs | kOutArgs, kOutArgs}},
        {kOfxPropIsInteractive, {kInt, 1, kEffect | kInArgs, 0}},
        {kOfxPropChangeReason, {kString, 1, kInArgs, 0}},
        {kOfxPropInstanceData, {kPointer, 1, kEffect, kEffect}},
        {kOfxPropEffectInstance, {kPointer, 1, kInArgs, 0}},

        {kOfxImageEffectPropContext, {kString, 1, kEffect | kInArgs, 0}},
        {kOfxImageEffectPropSupportedContexts,
         {kString, 0, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPropSupportedPixelDepths,
         {kString, 0, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPropSupportedComponents, {kString, 0, kHost | kAnyClip, kClipDescriptor}},
        {kOfxImageEffectPropSupportsTiles,
         {kInt, 1, kHost | kAnyEffect | kAnyClip, kEffectDescriptor | kClipDescriptor}},
        {kOfxImageEffectPropSupportsMultiResolution,
         {kInt, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPropSupportsMultipleClipDepths,
         {kInt, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPropSupportsMultipleClipPARs,
         {kInt, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPropTemporalClipAccess,
         {kInt, 1, kHost | kEffectDescriptor | kAnyClip, kEffectDescriptor | kClipDescriptor}},
        {"OfxImageEffectPropNoSpatialAwareness",
         {kString, 1, kEffectDescriptor | kInArgs, kEffectDescriptor}},
        {"OfxImageEffectPropCPURenderSupported",
         {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {"OfxImageEffectPropOpenCLRenderSupported",
         {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {"OfxImageEffectPropCudaRenderSupported",
         {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {"OfxImageEffectPropCudaStreamSupported",
         {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {"OfxImageEffectPropMetalRenderSupported",
         {kString, 1, kHost | kEffectDescriptor, kEffectDescriptor}},
        {"OfxImageEffectPropMetalEnabled", {kInt, 1, kInArgs, 0}},
        {"OfxImageEffectPropMetalCommandQueue", {kPointer, 1, kInArgs, 0}},
        {"OfxImageEffectPropOpenCLEnabled", {kInt, 1, kInArgs, 0}},
        {"OfxImageEffectPropOpenCLCommandQueue", {kPointer, 1, kInArgs, 0}},
        {"OfxImageEffectPropCudaEnabled", {kInt, 1, kInArgs, 0}},
        {"OfxImageEffectPropCudaStream", {kPointer, 1, kInArgs, 0}},
        {kOfxImageEffectPropColourManagementStyle,
         {kString, 1, kHost | kAnyEffect, kEffectDescriptor}},
        {kOfxImageEffectPropColourManagementAvailableConfigs,
         {kString, 0, kHost | kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageClipPropColourspace, {kString, 1, kClip | kOutArgs, kOutArgs}},
        {kOfxImageClipPropPreferredColourspaces, {kString, 0, kClip | kInArgs, 0}},
        {"OfxImageClipPropPreferredColourspaces_Source", {kString, 0, kOutArgs, kOutArgs}},
        {kOfxImageEffectPluginPropGrouping, {kString, 1, kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPluginPropSingleInstance, {kInt, 1, kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPluginPropHostFrameThreading,
         {kInt, 1, kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectPluginRenderThreadSafety,
         {kString, 1, kEffectDescriptor, kEffectDescriptor}},
        {kOfxImageEffectFrameVarying, {kInt, 1, kOutArgs, kOutArgs}},
        {"OfxImageClipPropComponents_Source", {kString, 0, kOutArgs, kOutArgs}},
        {"OfxImageClipPropComponents_Output", {kString, 0, kOutArgs, kOutArgs}},
        {kOfxImageEffectPropClipPreferencesSlaveParam,
         {kString, 0, kEffectDescriptor, kEffectDescriptor}},

        {kOfxImageClipPropOptional, {kInt, 1, kAnyClip, kClipDescriptor}},
        {kOfxImageClipPropIsMask, {kInt, 1, kAnyClip, kClipDescriptor}},
        {kOfxImageClipPropConnected, {kInt, 1, kClip, 0}},
        {kOfxImageEffectPropPixelDepth, {kString, 1, kClip | kImage, 0}},
        {kOfxImageEffectPropComponents, {kString, 1, kClip | kImage, 0}},
        {kOfxImageEffectPropPreMultiplication, {kString, 1, kClip | kImage | kOutArgs, kOutArgs}},
        {kOfxImageEffectPropFrameRange, {kDouble, 2, kClip | kInArgs, 0}},
        {kOfxImageEffectPropFrameRate, {kDouble, 1, kClip | kEffect | kOutArgs, kOutArgs}},

        {kOfxImagePropData, {kPointer, 1, kImage, 0}},
        {kOfxImagePropBounds, {kInt, 4, kImage, 0}},
        {kOfxImagePropRegionOfDefinition, {kInt, 4, kImage, 0}},
        {kOfxImagePropRowBytes, {kInt, 1, kImage, 0}},
        {kOfxImagePropField, {kString, 1, kImage, 0}},
        {kOfxImagePropPixelAspectRatio, {kDouble, 1, kClip | kImage, 0}},
        {kOfxImagePropUniqueIdentifier, {kString, 1, kImage, 0}},

        {kOfxImageEffectPropRenderWindow, {kInt, 4, kInArgs, 0}},
        {kOfxImageEffectPropRenderScale, {kDouble, 2, kInArgs | kImage, 0}},
        {kOfxImageEffectPropRegionOfInterest, {kDouble, 4, kInArgs, 0}},
        {"OfxImageClipPropRoI_Source", {kDouble, 4, kOutArgs, kOutArgs}},
        {kOfxImageEffectPropFieldToRender, {kString, 1, kInArgs, 0}},
        {kOfxImageEffectPropFrameStep, {kDouble, 1, kInArgs, 0}},
        {kOfxImageEffectPropSequentialRenderStatus, {kInt, 1, kInArgs, 0}},
        {kOfxImageEffectPropInteractiveRenderStatus, {kInt, 1, kInArgs, 0}},
        {kOfxImageEffectPropRenderQualityDraft, {kInt, 1, kInArgs, 0}},

        {kOfxParamPropType, {kString, 1, kAnyParam, 0}},
        {kOfxParamPropAnimates, {kInt, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropCanUndo, {kInt, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropPersistant, {kInt, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropEvaluateOnChange, {kInt, 1, kAnyParam, kParamDescriptor | kParam}},
        {kOfxParamPropSecret, {kInt, 1, kAnyParam, kParamDescriptor | kParam}},
        {kOfxParamPropScriptName, {kString, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropHint, {kString, 1, kAnyParam, kParamDescriptor | kParam}},
        {kOfxParamPropParent, {kString, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropEnabled, {kInt, 1, kAnyParam, kParamDescriptor | kParam}},
        {"OfxParamPropLayoutHint", {kInt, 1, kAnyParam, kParamDescriptor}},  // Nuke's, Natron's
        {kOfxParamPropIncrement, {kDouble, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropDigits, {kInt, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropDoubleType, {kString, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropStringMode, {kString, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropStringFilePathExists, {kInt, 1, kAnyParam, kParamDescriptor}},
        {kOfxParamPropChoiceOption, {kString, 0, kAnyParam, kParamDescriptor | kParam}},
        {kOfxParamPropGroupOpen, {kInt, 1, kAnyParam, kParamDescriptor}},
    };
    return table;
}

/// Those whose type is the parameter's own.
const std::set<std::string>& typed_by_param() {
    static const std::set<std::string> names = {kOfxParamPropDefault, kOfxParamPropMin,
                                                kOfxParamPropMax, kOfxParamPropDisplayMin,
                                                kOfxParamPropDisplayMax};
    return names;
}

/// Those that only parameters of some types have.
const std::map<std::string, std::set<std::string>>& types_with() {
    static const std::set<std::string> valued = {kOfxParamTypeInteger, kOfxParamTypeDouble,
                                                 kOfxParamTypeBoolean, kOfxParamTypeChoice,
                                                 kOfxParamTypeRGB,     kOfxParamTypeString};
    static const std::map<std::string, std::set<std::string>> types = {
        {kOfxParamPropIncrement, {kOfxParamTypeDouble, kOfxParamTypeRGB}},
        {kOfxParamPropDigits, {kOfxParamTypeDouble, kOfxParamTypeRGB}},
        {kOfxParamPropDoubleType, {kOfxParamTypeDouble}},
        {kOfxParamPropStringMode, {kOfxParamTypeString}},
        {kOfxParamPropStringFilePathExists, {kOfxParamTypeString}},
        {kOfxParamPropChoiceOption, {kOfxParamTypeChoice}},
        {kOfxParamPropGroupOpen, {kOfxParamTypeGroup}},
        {kOfxParamPropAnimates, valued},
        {kOfxParamPropCanUndo, valued},
        {kOfxParamPropPersistant, valued},
        {kOfxParamPropEvaluateOnChange, valued},
    };
    return types;
}

/// What texts may say where the standard has a word for each meaning.
const std::map<std::string, std::set<std::string>>& words_of() {
    static const std::set<std::string> flags = {"true", "false"};
    static const std::set<std::string> alpha = {kOfxImageOpaque, kOfxImagePreMultiplied,
                                                kOfxImageUnPreMultiplied};
    static const std::set<std::string> components = {kOfxImageComponentRGBA, kOfxImageComponentRGB,
                                                     kOfxImageComponentAlpha};
    static const std::map<std::string, std::set<std::string>> words = {
        {kOfxImageEffectPropSupportedContexts,
         {kOfxImageEffectContextFilter, kOfxImageEffectContextGeneral,
          kOfxImageEffectContextPaint}},
        {kOfxImageEffectPropSupportedPixelDepths, {kOfxBitDepthByte, kOfxBitDepthFloat}},
        {kOfxImageEffectPropSupportedComponents, components},
        {"OfxImageClipPropComponents_Source", components},
        {"OfxImageClipPropComponents_Output", components},
        {kOfxImageEffectPluginRenderThreadSafety, {kOfxImageEffectRenderFullySafe}},
        {kOfxImageEffectPropPreMultiplication, alpha},
        {"OfxImageEffectPropNoSpatialAwareness", flags},
        {"OfxImageEffectPropCPURenderSupported", flags},
        {"OfxImageEffectPropOpenCLRenderSupported", flags},
        {"OfxImageEffectPropCudaRenderSupported", flags},
        {"OfxImageEffectPropCudaStreamSupported", flags},
        {"OfxImageEffectPropMetalRenderSupported", flags},
        {kOfxParamPropDoubleType, {kOfxParamDoubleTypePlain}},
        {kOfxParamPropStringMode,
         {kOfxParamStringIsSingleLine, kOfxParamStringIsMultiLine, kOfxParamStringIsFilePath,
          kOfxParamStringIsDirectoryPath, kOfxParamStringIsLabel}},
    };
    return words;
}

std::mutex g_sets_mutex;
std::set<const OfxPropertySetStruct*>& live_sets() {
    static std::set<const OfxPropertySetStruct*> sets;
    return sets;
}

bool is_live(OfxPropertySetHandle set) {
    const std::lock_guard<std::mutex> lock(g_sets_mutex);
    return live_sets().count(set) != 0;
}

// One lock for all values: this host is for finding faults, not for speed.
std::mutex g_values_mutex;

/// The type of a property on a set; notes what is wrong with asking for it. -1: no such property.
int type_of(OfxPropertySetHandle set, const std::string& name, bool writing, const char* function) {
    Host& host = Host::get();
    const std::string call = std::string(function) + "(" + name + ")";
    if (typed_by_param().count(name)) {
        const unsigned allowed = writing ? kParamDescriptor : kAnyParam;
        if (!(set->kind & allowed)) {
            host.fault(call + ": not a property of this object");
            return -1;
        }
        const std::string param = set->text(kOfxParamPropType);
        const bool initial = name == kOfxParamPropDefault;
        if (param == kOfxParamTypeDouble || param == kOfxParamTypeRGB) return kDouble;
        if (param == kOfxParamTypeInteger) return kInt;
        if (param == kOfxParamTypeString && initial) return kString;
        if ((param == kOfxParamTypeBoolean || param == kOfxParamTypeChoice) && initial) return kInt;
        host.fault(call + ": not a property of a " + param);
        return -1;
    }
    const auto rule = rules().find(name);
    if (rule == rules().end()) {
        host.fault(call + ": the standard has no such property");
        return -1;
    }
    if (!(rule->second.readable & set->kind)) {
        host.fault(call + ": not a property of this object");
        return -1;
    }
    if (writing && !(rule->second.writable & set->kind)) {
        host.fault(call + ": a plugin may not set it here");
        return -1;
    }
    const std::string param = set->kind & kAnyParam ? set->text(kOfxParamPropType) : "";
    const auto types = types_with().find(name);
    if (!param.empty() && types != types_with().end() && !types->second.count(param)) {
        host.fault(call + ": not a property of a " + param);
        return -1;
    }
    return rule->second.type;
}

int dimension_of(OfxPropertySetHandle set, const std::string& name) {
    if (typed_by_param().count(name)) {
        return set->text(kOfxParamPropType) == kOfxParamTypeRGB ? 3 : 1;
    }
    const auto rule = rules().find(name);
    return rule == rules().end() ? 1 : rule->second.dimension;
}

OfxStatus check(OfxPropertySetHandle set, const char* name, int index, bool writing, Type type,
                const char* function) {
    Host& host = Host::get();
    if (!set || !is_live(set)) {
        host.fault(std::string(function) + ": not a property set (any more)");
        return kOfxStatErrBadHandle;
    }
    if (!name) {
        host.fault(std::string(function) + ": no name");
        return kOfxStatErrUnknown;
    }
    host.asked(name);
    if (host.config().missing_properties.count(name)) return kOfxStatErrUnknown;
    const int known = type_of(set, name, writing, function);
    if (known < 0) return kOfxStatErrUnknown;
    const std::string call = std::string(function) + "(" + name + ")";
    if (known != type) {
        host.fault(call + ": it is of type " + kTypeNames[known]);
        return kOfxStatErrValue;
    }
    const int dimension = dimension_of(set, name);
    if (index < 0 || (dimension > 0 && index >= dimension)) {
        host.fault(call + ": index " + std::to_string(index) + " is out of range");
        return kOfxStatErrBadIndex;
    }
    return kOfxStatOK;
}

template <typename T>
OfxStatus set_one(const char* function, OfxPropertySetHandle set, const char* name, int index,
                  Type type, T value) {
    const Call call(function);
    if (call.refused()) return kOfxStatErrUnknown;
    const OfxStatus status = check(set, name, index, true, type, function);
    if (status != kOfxStatOK) return status;
    const std::lock_guard<std::mutex> lock(g_values_mutex);
    if (Host::get().config().secret_stays && set->kind == kParam &&
        name == std::string(kOfxParamPropSecret) && set->number(" described as secret") != 0) {
        return kOfxStatOK;  // and nothing comes of it
    }
    std::vector<Value>& values = set->values[name];
    if (static_cast<std::size_t>(index) > values.size()) {
        Host::get().fault(std::string(function) + "(" + name + "): leaves a gap before index " +
                          std::to_string(index));
        return kOfxStatErrBadIndex;
    }
    if (static_cast<std::size_t>(index) == values.size()) values.emplace_back();
    values[static_cast<std::size_t>(index)] = value;
    return kOfxStatOK;
}

template <typename T>
OfxStatus get_one(const char* function, OfxPropertySetHandle set, const char* name, int index,
                  Type type, T* value) {
    const Call call(function);
    if (call.refused()) return kOfxStatErrUnknown;
    const OfxStatus status = check(set, name, index, false, type, function);
    if (status != kOfxStatOK) return status;
    const std::lock_guard<std::mutex> lock(g_values_mutex);
    const auto found = set->values.find(name);
    if (found == set->values.end()) return kOfxStatErrUnknown;  // this host does not tell
    if (static_cast<std::size_t>(index) >= found->second.size()) return kOfxStatErrBadIndex;
    const T* stored = std::get_if<T>(&found->second[static_cast<std::size_t>(index)]);
    if (!stored) return kOfxStatErrValue;  // a host that is wrong about its own property
    *value = *stored;
    return kOfxStatOK;
}

OfxStatus set_pointer(OfxPropertySetHandle s, const char* n, int i, void* v) {
    return set_one<void*>("propSetPointer", s, n, i, kPointer, v);
}
OfxStatus set_string(OfxPropertySetHandle s, const char* n, int i, const char* v) {
    if (!v) {
        Host::get().fault("propSetString: a null string");
        return kOfxStatErrValue;
    }
    const auto words = n ? words_of().find(n) : words_of().end();
    if (words != words_of().end() && !words->second.count(v)) {
        Host::get().fault(std::string("propSetString(") + n + "): the standard has no word " + v +
                          " for it, or not one that a node of this kind may use");
        return kOfxStatErrValue;
    }
    return set_one<std::string>("propSetString", s, n, i, kString, v);
}
OfxStatus set_double(OfxPropertySetHandle s, const char* n, int i, double v) {
    return set_one<double>("propSetDouble", s, n, i, kDouble, v);
}
OfxStatus set_int(OfxPropertySetHandle s, const char* n, int i, int v) {
    return set_one<int>("propSetInt", s, n, i, kInt, v);
}
OfxStatus get_pointer(OfxPropertySetHandle s, const char* n, int i, void** v) {
    return get_one<void*>("propGetPointer", s, n, i, kPointer, v);
}
OfxStatus get_string(OfxPropertySetHandle s, const char* n, int i, char** v) {
    std::string value;
    const OfxStatus status = get_one<std::string>("propGetString", s, n, i, kString, &value);
    if (status == kOfxStatOK) *v = lend(value);
    return status;
}
OfxStatus get_double(OfxPropertySetHandle s, const char* n, int i, double* v) {
    return get_one<double>("propGetDouble", s, n, i, kDouble, v);
}
OfxStatus get_int(OfxPropertySetHandle s, const char* n, int i, int* v) {
    return get_one<int>("propGetInt", s, n, i, kInt, v);
}

// The N forms are built on the single ones.
template <typename T, typename One>
OfxStatus each(int count, T* values, One one) {
    for (int i = 0; i < count; ++i) {
        const OfxStatus status = one(i, values[i]);
        if (status != kOfxStatOK) return status;
    }
    return kOfxStatOK;
}
OfxStatus set_pointers(OfxPropertySetHandle s, const char* n, int c, void* const* v) {
    return each(c, v, [&](int i, void* x) { return set_pointer(s, n, i, x); });
}
OfxStatus set_strings(OfxPropertySetHandle s, const char* n, int c, const char* const* v) {
    return each(c, v, [&](int i, const char* x) { return set_string(s, n, i, x); });
}
OfxStatus set_doubles(OfxPropertySetHandle s, const char* n, int c, const double* v) {
    return each(c, v, [&](int i, double x) { return set_double(s, n, i, x); });
}
OfxStatus set_ints(OfxPropertySetHandle s, const char* n, int c, const int* v) {
    return each(c, v, [&](int i, int x) { return set_int(s, n, i, x); });
}
OfxStatus get_pointers(OfxPropertySetHandle s, const char* n, int c, void** v) {
    return each(c, v, [&](int i, void*& x) { return get_pointer(s, n, i, &x); });
}
OfxStatus get_strings(OfxPropertySetHandle, const char*, int, char**) {
    return kOfxStatErrUnsupported;  // cannot be had without breaking the rule on lent strings
}
OfxStatus get_doubles(OfxPropertySetHandle s, const char* n, int c, double* v) {
    return each(c, v, [&](int i, double& x) { return get_double(s, n, i, &x); });
}
OfxStatus get_ints(OfxPropertySetHandle s, const char* n, int c, int* v) {
    return each(c, v, [&](int i, int& x) { return get_int(s, n, i, &x); });
}
OfxStatus reset(OfxPropertySetHandle, const char*) {
    Host::get().fault("propReset: not expected of this plugin");
    return kOfxStatErrUnsupported;
}
OfxStatus dimension(OfxPropertySetHandle set, const char* name, int* count) {
    const Call call("propGetDimension");
    if (call.refused()) return kOfxStatErrUnknown;
    if (!set || !is_live(set) || !name) return kOfxStatErrBadHandle;
    if (type_of(set, name, false, "propGetDimension") < 0) return kOfxStatErrUnknown;
    const std::lock_guard<std::mutex> lock(g_values_mutex);
    const auto found = set->values.find(name);
    if (found == set->values.end()) return kOfxStatErrUnknown;
    *count = static_cast<int>(found->second.size());
    return kOfxStatOK;
}

const OfxPropertySuiteV1 kPropertySuite = {
    set_pointer,  set_string,  set_double,  set_int,    set_pointers, set_strings,
    set_doubles,  set_ints,    get_pointer, get_string, get_double,   get_int,
    get_pointers, get_strings, get_doubles, get_ints,   reset,        dimension};

}  // namespace

SuiteTable property_suite() {
    using S = OfxPropertySuiteV1;
    return {&kPropertySuite,
            sizeof kPropertySuite,
            {{"propSetPointer", offsetof(S, propSetPointer)},
             {"propSetString", offsetof(S, propSetString)},
             {"propSetDouble", offsetof(S, propSetDouble)},
             {"propSetInt", offsetof(S, propSetInt)},
             {"propGetPointer", offsetof(S, propGetPointer)},
             {"propGetString", offsetof(S, propGetString)},
             {"propGetDouble", offsetof(S, propGetDouble)},
             {"propGetInt", offsetof(S, propGetInt)}}};
}

}  // namespace strict

OfxPropertySetStruct::OfxPropertySetStruct(strict::Kind k) : kind(k) {
    const std::lock_guard<std::mutex> lock(strict::g_sets_mutex);
    strict::live_sets().insert(this);
}

OfxPropertySetStruct::OfxPropertySetStruct(const OfxPropertySetStruct& other)
    : OfxPropertySetStruct(other.kind) {
    values = other.values;
}

OfxPropertySetStruct::~OfxPropertySetStruct() {
    const std::lock_guard<std::mutex> lock(strict::g_sets_mutex);
    strict::live_sets().erase(this);
}

std::string OfxPropertySetStruct::text(const std::string& name, std::size_t index) const {
    const auto found = values.find(name);
    if (found == values.end() || index >= found->second.size()) return "";
    const std::string* value = std::get_if<std::string>(&found->second[index]);
    return value ? *value : "";
}

double OfxPropertySetStruct::number(const std::string& name, std::size_t index) const {
    const auto found = values.find(name);
    if (found == values.end() || index >= found->second.size()) return 0;
    if (const int* value = std::get_if<int>(&found->second[index])) return *value;
    const double* value = std::get_if<double>(&found->second[index]);
    return value ? *value : 0;
}
