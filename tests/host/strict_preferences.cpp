// What a plugin would have its clips be, and whether hosts can know when to ask.
#include <algorithm>

#include "strict_host.hpp"

namespace strict {

std::set<std::string> slave_params(const OfxImageEffectStruct& descriptor) {
    std::set<std::string> names;
    const auto& values = descriptor.properties.values;
    const auto found = values.find(kOfxImageEffectPropClipPreferencesSlaveParam);
    if (found == values.end()) return names;
    for (const Value& name : found->second) names.insert(std::get<std::string>(name));
    return names;
}

OfxStatus Instance::clip_preferences(OfxPropertySetStruct& out) {
    out.put(kOfxImageEffectFrameVarying, 0);
    // What holds where a plugin says nothing.
    const auto found = effect_.clips.find(kOfxImageEffectSimpleSourceClipName);
    if (found != effect_.clips.end()) {
        const OfxPropertySetStruct& source = found->second->properties;
        out.put(kOfxImageEffectPropPreMultiplication,
                source.text(kOfxImageEffectPropPreMultiplication));
        for (const char* name : {"Source", "Output"}) {
            out.put(std::string("OfxImageClipPropComponents_") + name,
                    source.text(kOfxImageEffectPropComponents));
        }
    }
    return plugin_.call(kOfxImageEffectActionGetClipPreferences, &effect_, nullptr, &out);
}

OfxStatus Instance::clip_preferences(bool& frame_varying) {
    OfxPropertySetStruct out(kOutArgs);
    const OfxStatus status = clip_preferences(out);
    frame_varying = out.number(kOfxImageEffectFrameVarying) != 0;
    return status;
}

void Instance::check_preferences() {
    Host& host = Host::get();
    const Config& config = host.config();
    // What is refused or missing may be what the plugin needs to answer, or to name parameters.
    if (config.incomplete || config.refused_call >= 0 || !config.null_functions.empty() ||
        !config.missing_suites.empty() ||
        config.missing_properties.count(kOfxImageEffectPropClipPreferencesSlaveParam)) {
        return;
    }
    OfxPropertySetStruct out(kOutArgs);
    host.count_calls(false);
    clip_preferences(out);
    host.count_calls(true);
    const bool knows = std::any_of(set_since_.begin(), set_since_.end(),
                                   [&](const auto& name) { return slaves_.count(name) != 0; });
    if (preferred_ && *preferred_ != out.values && !knows) {
        std::string names;
        for (const std::string& name : set_since_) names += " " + name;
        host.fault("GetClipPreferences: another answer after a change of" + names +
                   ", and no host would ask");
    }
    preferred_ = out.values;
    set_since_.clear();
}

}  // namespace strict
