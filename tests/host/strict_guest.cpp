#include "strict_guest.hpp"

#include <cstring>
#include <memory>
#include <utility>

#include "harness.hpp"

using namespace strict;

namespace guest {

Guest g;

void put(OfxPropertySetHandle set, const char* name, const char* text, int index) {
    if (!g.left_out.count(name)) g.prop->propSetString(set, name, index, text);
}

OfxPropertySetHandle define(Now& now, const char* type, const char* name) {
    OfxPropertySetHandle set = nullptr;
    g.param->paramDefine(now.params, type, name, &set);
    put(set, kOfxPropLabel, name);
    if (std::strcmp(type, kOfxParamTypeGroup) != 0) put(set, kOfxParamPropHint, "A hint.");
    return set;
}

OfxPropertySetHandle number(Now& now, const char* name, double initial) {
    const OfxPropertySetHandle set = define(now, kOfxParamTypeDouble, name);
    const std::pair<const char*, double> values[] = {{kOfxParamPropDefault, initial},
                                                     {kOfxParamPropMin, 0},
                                                     {kOfxParamPropMax, 4},
                                                     {kOfxParamPropDisplayMin, 0},
                                                     {kOfxParamPropDisplayMax, 2}};
    for (const auto& [property, value] : values) {
        if (!g.left_out.count(property)) g.prop->propSetDouble(set, property, 0, value);
    }
    return set;
}

OfxPropertySetHandle choice(Now& now, const char* name, std::initializer_list<const char*> options,
                            int initial) {
    const OfxPropertySetHandle set = define(now, kOfxParamTypeChoice, name);
    int index = 0;
    for (const char* option : options) put(set, kOfxParamPropChoiceOption, option, index++);
    g.prop->propSetInt(set, kOfxParamPropDefault, 0, initial);
    return set;
}

OfxPropertySetHandle text(Now& now, const char* name) {
    const OfxPropertySetHandle set = define(now, kOfxParamTypeString, name);
    if (!g.left_out.count(kOfxParamPropAnimates)) {
        g.prop->propSetInt(set, kOfxParamPropAnimates, 0, 0);
    }
    return set;
}

OfxParamHandle handle_of(Now& now, const char* name) {
    OfxParamHandle param = nullptr;
    g.param->paramGetHandle(now.params, name, &param, nullptr);
    return param;
}

OfxImageClipHandle clip_of(Now& now, const char* name) {
    OfxImageClipHandle clip = nullptr;
    g.effect->clipGetHandle(now.effect, name, &clip, nullptr);
    return clip;
}

namespace {

unsigned char* open_image(Now& now, const char* clip, OfxPropertySetHandle& image) {
    g.effect->clipGetImage(clip_of(now, clip), 0, nullptr, &image);
    void* pixels = nullptr;
    g.prop->propGetPointer(image, kOfxImagePropData, 0, &pixels);
    return static_cast<unsigned char*>(pixels);
}

void describe(Now& now) {
    put(now.properties, kOfxPropLabel, "Guest");
    put(now.properties, kOfxImageEffectPluginPropGrouping, "Tests");
    put(now.properties, kOfxImageEffectPropSupportedContexts, kOfxImageEffectContextFilter);
    put(now.properties, kOfxImageEffectPropSupportedPixelDepths, kOfxBitDepthFloat);
    put(now.properties, kOfxImageEffectPluginRenderThreadSafety, kOfxImageEffectRenderFullySafe);
}

void describe_in_context(Now& now) {
    for (const char* name : {"Source", "Output"}) {
        if (g.left_out.count(name)) continue;
        OfxPropertySetHandle set = nullptr;
        g.effect->clipDefine(now.effect, name, &set);
        put(set, kOfxImageEffectPropSupportedComponents, kOfxImageComponentRGBA);
    }
    define(now, kOfxParamTypeGroup, "group");
    put(number(now, "number"), kOfxParamPropParent, "group");
    choice(now, "choice", {"One", "Two"});
    text(now, "text");
    if (!g.slave.empty()) {
        put(now.properties, kOfxImageEffectPropClipPreferencesSlaveParam, g.slave.c_str());
    }
}

OfxStatus main_entry(const char* name, const void* handle, OfxPropertySetHandle,
                     OfxPropertySetHandle answer) {
    const std::string action = name;
    if (action == kOfxActionLoad) {
        g.prop = fetch<OfxPropertySuiteV1>(kOfxPropertySuite);
        g.param = fetch<OfxParameterSuiteV1>(kOfxParameterSuite);
        g.effect = fetch<OfxImageEffectSuiteV1>(kOfxImageEffectSuite);
        g.thread = fetch<OfxMultiThreadSuiteV1>(kOfxMultiThreadSuite);
        g.message = fetch<OfxMessageSuiteV1>(kOfxMessageSuite);
        return kOfxStatOK;
    }
    Now now;
    now.effect = static_cast<OfxImageEffectHandle>(const_cast<void*>(handle));
    now.answer = answer;
    g.effect->getParamSet(now.effect, &now.params);
    g.effect->getPropertySet(now.effect, &now.properties);
    const bool renders = action == kOfxImageEffectActionRender;
    if (renders) {
        ++g.renders;
        now.source_pixels = open_image(now, "Source", now.source);
        now.output_pixels = open_image(now, "Output", now.output);
    } else if (action == kOfxActionDescribe) {
        describe(now);
    } else if (action == kOfxImageEffectActionDescribeInContext) {
        describe_in_context(now);
    }
    if (action == g.action) g.breach(now);
    for (OfxPropertySetHandle image : {now.source, now.output}) {
        if (image) g.effect->clipReleaseImage(image);
    }
    if (action == kOfxImageEffectActionIsIdentity) return kOfxStatReplyDefault;
    return renders ? g.answer : kOfxStatOK;
}

OfxPlugin g_plugin = {kOfxImageEffectPluginApi,
                      kOfxImageEffectPluginApiVersion,
                      "org.palette4d.tests.Guest",
                      1,
                      0,
                      [](OfxHost* host) { g.host = host; },
                      &main_entry};

}  // namespace

std::vector<std::string> faults_of(const std::string& action, Breach breach,
                                   std::set<std::string> left_out, OfxStatus answer) {
    g.action = action;
    g.breach = std::move(breach);
    g.left_out = std::move(left_out);
    g.answer = answer;
    Plugin plugin(g_plugin);
    const auto node = plugin.create();
    if (!g.left_out.count("Source") && !g.left_out.count("Output")) {
        node->set("number", 0.25);
        node->changed("number");
        std::string clip;
        double time = 0;
        node->is_identity(0, clip, time);
        node->twice = true;
        const Layout layout;
        Picture source(layout), output(layout);
        test::fill(source);
        node->render(0, &source, output, test::rect(4, 4, 12, 12));
        node->sync();
    }
    node->destroy();
    return Host::get().take_faults();
}

}  // namespace guest
