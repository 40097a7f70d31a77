// What a host's author would check in a plugin's description.
#include <algorithm>

#include "strict_host.hpp"

namespace strict {
namespace {

void require(bool condition, const std::string& what) {
    if (!condition) Host::get().fault("described: " + what);
}

/// Every number needs both its ranges (Resolve takes no parameter without), nested around the
/// default.
void check_ranges(const std::string& name, const OfxPropertySetStruct& q, std::size_t components) {
    for (const char* range : {kOfxParamPropMin, kOfxParamPropMax, kOfxParamPropDisplayMin,
                              kOfxParamPropDisplayMax, kOfxParamPropDefault}) {
        require(q.has(range) && q.values.at(range).size() == components,
                name + " has no " + range + ", or not of all its components");
    }
    for (std::size_t i = 0; i < components; ++i) {
        const double initial = q.number(kOfxParamPropDefault, i);
        require(q.number(kOfxParamPropMin, i) <= q.number(kOfxParamPropDisplayMin, i) &&
                    q.number(kOfxParamPropDisplayMin, i) <= initial &&
                    initial <= q.number(kOfxParamPropDisplayMax, i) &&
                    q.number(kOfxParamPropDisplayMax, i) <= q.number(kOfxParamPropMax, i),
                name + "'s ranges are not nested around its default");
    }
}

void check_param(const OfxImageEffectStruct& effect, const std::string& name,
                 const OfxParamStruct& param) {
    const OfxPropertySetStruct& q = param.properties;
    require(!q.text(kOfxPropLabel).empty(), name + " has no label");
    const std::string parent = q.text(kOfxParamPropParent);
    if (!parent.empty()) {
        const auto found = effect.params.params.find(parent);
        require(found != effect.params.params.end() && found->second->type == kOfxParamTypeGroup,
                name + "'s parent " + parent + " is no group");
        // Hosts lay parameters out as they come: a group's come after it.
        const auto& order = effect.params.order;
        require(std::find(order.begin(), order.end(), parent) <
                    std::find(order.begin(), order.end(), name),
                name + " is defined before its parent");
    }
    if (param.type == kOfxParamTypeGroup) return;
    require(!q.text(kOfxParamPropHint).empty(), name + " has no hint");
    if (param.type == kOfxParamTypeDouble || param.type == kOfxParamTypeInteger) {
        check_ranges(name, q, 1);
    } else if (param.type == kOfxParamTypeRGB) {
        check_ranges(name, q, 3);
    } else if (param.type == kOfxParamTypeString) {
        // Animated unless it says otherwise.
        const bool animates = !q.has(kOfxParamPropAnimates) || q.number(kOfxParamPropAnimates) != 0;
        require(!animates || Host::get().config().animates_strings, name + " animates a text");
    } else if (param.type == kOfxParamTypeChoice) {
        require(q.has(kOfxParamPropChoiceOption), name + " has no options");
        if (!q.has(kOfxParamPropChoiceOption)) return;
        const double initial = q.number(kOfxParamPropDefault);
        const auto& options = q.values.at(kOfxParamPropChoiceOption);
        const std::set<Value> different(options.begin(), options.end());
        require(options.size() > 1 && different.size() == options.size(),
                name + " has options of one name, or only one");
        require(initial >= 0 && initial < static_cast<double>(options.size()),
                name + "'s default is none of its options");
    }
}

}  // namespace

void check_descriptor(const OfxImageEffectStruct& effect) {
    const OfxPropertySetStruct& p = effect.properties;
    for (const char* name : {kOfxPropLabel, kOfxImageEffectPluginPropGrouping,
                             kOfxImageEffectPluginRenderThreadSafety}) {
        require(!p.text(name).empty(), std::string("no ") + name);
    }
    for (const char* name :
         {kOfxImageEffectPropSupportedContexts, kOfxImageEffectPropSupportedPixelDepths}) {
        require(p.has(name), std::string("no ") + name);
    }
    for (const char* name : {kOfxImageEffectSimpleSourceClipName, kOfxImageEffectOutputClipName}) {
        const auto clip = effect.clips.find(name);
        require(clip != effect.clips.end(), std::string("no clip ") + name);
        if (clip == effect.clips.end()) continue;
        require(clip->second->properties.has(kOfxImageEffectPropSupportedComponents),
                std::string("no components of clip ") + name);
    }
    if (activity().context == kOfxImageEffectContextPaint) {
        const auto brush = effect.clips.find("Brush");
        require(brush != effect.clips.end() &&
                    brush->second->properties.text(kOfxImageEffectPropSupportedComponents) ==
                        kOfxImageComponentAlpha,
                "no clip Brush of alpha alone in the Paint context");
    }
    for (const auto& [name, param] : effect.params.params) check_param(effect, name, *param);
    for (const std::string& name : slave_params(effect)) {
        require(effect.params.params.count(name) != 0,
                "the clip preferences depend on " + name + ", which is no parameter");
    }
}

}  // namespace strict
