// That the strict host notices what it says it does: a plug-in that keeps the standard, but for one
// breach at a time. A check that nothing can fail is worth nothing.
#include <cstring>
#include <functional>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

/// What a breach may get hold of.
struct Now {
    OfxImageEffectHandle effect = nullptr;
    OfxParamSetHandle params = nullptr;
    OfxPropertySetHandle properties = nullptr;  ///< the effect's
    OfxPropertySetHandle source = nullptr, output = nullptr;
    OfxPropertySetHandle answer = nullptr;  ///< the action's
    unsigned char* source_pixels = nullptr;
    unsigned char* output_pixels = nullptr;
};
using Breach = std::function<void(Now&)>;

/// The plug-in's state.
struct Guest {
    OfxHost* host = nullptr;
    const OfxPropertySuiteV1* prop = nullptr;
    const OfxParameterSuiteV1* param = nullptr;
    const OfxImageEffectSuiteV1* effect = nullptr;
    const OfxMultiThreadSuiteV1* thread = nullptr;
    const OfxMessageSuiteV1* message = nullptr;
    std::string action;  ///< in which the breach happens
    Breach breach;
    std::set<std::string> left_out;  ///< of the description
    std::string slave;               ///< a parameter that the clip preferences depend on
    OfxStatus answer = kOfxStatOK;   ///< of a render
    int renders = 0;
} g;

template <typename Suite>
const Suite* fetch(const char* name, int version = 1) {
    return static_cast<const Suite*>(g.host->fetchSuite(g.host->host, name, version));
}

void put(OfxPropertySetHandle set, const char* name, const char* text, int index = 0) {
    if (!g.left_out.count(name)) g.prop->propSetString(set, name, index, text);
}

OfxPropertySetHandle define(Now& now, const char* type, const char* name) {
    OfxPropertySetHandle set = nullptr;
    g.param->paramDefine(now.params, type, name, &set);
    put(set, kOfxPropLabel, name);
    if (std::strcmp(type, kOfxParamTypeGroup) != 0) put(set, kOfxParamPropHint, "A hint.");
    return set;
}

OfxPropertySetHandle number(Now& now, const char* name, double initial = 1) {
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
                            int initial = 0) {
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

/// The faults of a plug-in's life in which the breach happens.
std::vector<std::string> faults_of(const std::string& action, Breach breach,
                                   std::set<std::string> left_out = {},
                                   OfxStatus answer = kOfxStatOK) {
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
        fill(source);
        node->render(0, &source, output, rect(4, 4, 12, 12));
    }
    node->destroy();
    return Host::get().take_faults();
}

void expect(const std::string& words, const std::vector<std::string>& faults) {
    bool found = false;
    std::string all;
    for (const std::string& fault : faults) {
        found |= fault.find(words) != std::string::npos;
        all += "\n  " + fault;
    }
    EXPECT(found, "no fault '" + words + "' among" + (all.empty() ? " none at all" : all));
}

struct Wrong {
    const char* words;  ///< of the fault that must be noted
    Breach breach;
};
void expect_each(const std::string& action, const std::vector<Wrong>& cases) {
    for (const Wrong& one : cases) expect(one.words, faults_of(action, one.breach));
}

const char* const kDescribe = kOfxActionDescribe;
const char* const kInContext = kOfxImageEffectActionDescribeInContext;
const char* const kCreate = kOfxActionCreateInstance;
const char* const kRender = kOfxImageEffectActionRender;

}  // namespace

TEST(a_plugin_that_keeps_the_standard_has_no_faults) {
    g.renders = 0;
    CHECK(faults_of("", {}).empty());
    CHECK(g.renders == 2);
}

TEST(wrong_properties_are_noticed) {
    char* lent = nullptr;
    int count = 0;
    void* pixels = nullptr;
    expect_each(
        kDescribe,
        {{"the standard has no such property",
          [](Now& n) { g.prop->propSetString(n.properties, "OfxPropLabl", 0, "x"); }},
         {"the standard has no such property",
          [&](Now& n) { g.prop->propGetDimension(n.properties, "OfxPropLabl", &count); }},
         {"not a property of this object",
          [](Now& n) { g.prop->propSetInt(n.properties, kOfxImageClipPropOptional, 0, 1); }},
         {"not a property of this object",
          [](Now& n) { g.prop->propSetDouble(n.properties, kOfxParamPropDefault, 0, 1); }},
         {"a plugin may not set it here",
          [](Now& n) { g.prop->propSetString(n.properties, kOfxPropType, 0, "x"); }},
         {"it is of type string",
          [](Now& n) { g.prop->propSetInt(n.properties, kOfxPropLabel, 0, 1); }},
         {"it is of type int",
          [](Now& n) {
              g.prop->propSetDouble(n.properties, kOfxImageEffectPropSupportsTiles, 0, 1);
          }},
         {"is out of range",
          [&](Now& n) { g.prop->propGetString(n.properties, kOfxPropLabel, 1, &lent); }},
         {"is out of range",
          [&](Now& n) { g.prop->propGetString(n.properties, kOfxPropLabel, -1, &lent); }},
         {"leaves a gap",
          [](Now& n) {
              put(n.properties, kOfxImageEffectPropSupportedPixelDepths, kOfxBitDepthByte, 2);
          }},
         {"the standard has no word",
          [](Now& n) {
              put(n.properties, kOfxImageEffectPropSupportedContexts, "OfxImageEffectContextFliter",
                  1);
          }},
         {"no name", [](Now& n) { g.prop->propSetInt(n.properties, nullptr, 0, 1); }},
         {"a null string",
          [](Now& n) { g.prop->propSetString(n.properties, kOfxPropLabel, 0, nullptr); }},
         {"propReset", [](Now& n) { g.prop->propReset(n.properties, kOfxPropLabel); }},
         {"not a property set", [](Now&) { g.prop->propSetInt(nullptr, kOfxPropLabel, 0, 1); }},
         {"knows no suite", [](Now&) { fetch<OfxPropertySuiteV1>("OfxPropertySiute"); }}});
    expect_each(kRender, {{"not a property set (any more)", [&](Now& n) {
                               g.effect->clipReleaseImage(n.source);
                               g.prop->propGetPointer(n.source, kOfxImagePropData, 0, &pixels);
                               n.source = nullptr;
                           }}});
}

TEST(wrong_descriptions_are_noticed) {
    expect_each(
        kInContext,
        {{"a type unknown to this host", [](Now& n) { define(n, "OfxParamTypeFloat", "x"); }},
         {"twice the name", [](Now& n) { define(n, kOfxParamTypeBoolean, "number"); }},
         {"this context has no clip",
          [](Now& n) { g.effect->clipDefine(n.effect, "Sauce", nullptr); }},
         {"it is of type double",
          [](Now& n) { g.prop->propSetInt(number(n, "x"), kOfxParamPropDefault, 0, 1); }},
         {"not a property of a OfxParamTypeString",
          [](Now& n) { g.prop->propSetDouble(text(n, "x"), kOfxParamPropMin, 0, 1); }},
         {"not a property of a OfxParamTypeDouble",
          [](Now& n) { put(number(n, "x"), kOfxParamPropChoiceOption, "One"); }},
         {"the standard has no word",
          [](Now& n) { put(text(n, "x"), kOfxParamPropStringMode, "OfxParamStringIsText"); }},
         {"has no OfxParamPropMin",
          [](Now& n) { define(n, kOfxParamTypeDouble, "without ranges"); }},
         {"has no OfxParamPropMin", [](Now& n) { define(n, kOfxParamTypeInteger, "x"); }},
         {"has no OfxParamPropMin", [](Now& n) { define(n, kOfxParamTypeRGB, "x"); }},
         {"are not nested", [](Now& n) { number(n, "x", 3); }},
         {"has no label",
          [](Now& n) { g.prop->propSetString(number(n, "x"), kOfxPropLabel, 0, ""); }},
         {"has no hint",
          [](Now& n) { g.prop->propSetString(number(n, "x"), kOfxParamPropHint, 0, ""); }},
         {"is no group", [](Now& n) { put(number(n, "x"), kOfxParamPropParent, "number"); }},
         {"before its parent",
          [](Now& n) {
              put(number(n, "x"), kOfxParamPropParent, "late");
              define(n, kOfxParamTypeGroup, "late");
          }},
         {"has no options", [](Now& n) { choice(n, "x", {}); }},
         {"options of one name", [](Now& n) { choice(n, "x", {"One", "One"}); }},
         {"default is none of its options", [](Now& n) { choice(n, "x", {"One", "Two"}, 2); }}});
    // Of what every description has, each once left out.
    for (const char* name :
         {kOfxPropLabel, kOfxImageEffectPluginPropGrouping, kOfxImageEffectPropSupportedContexts,
          kOfxImageEffectPropSupportedPixelDepths, kOfxImageEffectPluginRenderThreadSafety,
          kOfxImageEffectPropSupportedComponents, "Source", "Output", kOfxParamPropMin,
          kOfxParamPropMax, kOfxParamPropDisplayMin, kOfxParamPropDisplayMax}) {
        const std::string words = name == std::string(kOfxImageEffectPropSupportedComponents)
                                      ? "no components of clip"
                                      : name;
        expect(words, faults_of("", {}, {name}));
    }
    Config config;
    config.animates_strings = false;
    Host::get().configure(config);
    expect("animates a text", faults_of("", {}, {kOfxParamPropAnimates}));
}

TEST(calls_in_the_wrong_place_are_noticed) {
    OfxPropertySetHandle image = nullptr;
    double value = 0;
    expect_each(
        kDescribe,
        {{"only while describing in a context",
          [](Now& n) { define(n, kOfxParamTypeBoolean, "early"); }},
         {"clipDefine: only", [](Now& n) { g.effect->clipDefine(n.effect, "Source", nullptr); }},
         {"not an instance's parameters", [](Now& n) { handle_of(n, "number"); }},
         {"not an instance", [](Now& n) { clip_of(n, "Source"); }}});
    expect_each(
        kCreate,
        {{"no parameter nubmer", [](Now& n) { handle_of(n, "nubmer"); }},
         {"no clip Sauce", [](Now& n) { clip_of(n, "Sauce"); }},
         {"not a descriptor's parameters", [](Now& n) { define(n, kOfxParamTypeBoolean, "x"); }},
         {"of one that has none",
          [&](Now& n) { g.param->paramGetValue(handle_of(n, "group"), &value); }},
         {"one without a value",
          [](Now& n) { g.param->paramSetValue(handle_of(n, "group"), 1.0); }},
         {"clipGetImage: not while rendering",
          [&](Now& n) { g.effect->clipGetImage(clip_of(n, "Source"), 0, nullptr, &image); }},
         {"an unknown type",
          [](Now& n) { g.message->message(n.effect, "OfxMessageSad", "", "words"); }},
         {"multiThread: no function", [](Now&) { g.thread->multiThread(nullptr, 2, nullptr); }}});
    const Wrong no_time = {"paramGetValue: while rendering",
                           [&](Now& n) { g.param->paramGetValue(handle_of(n, "number"), &value); }};
    expect_each(kOfxImageEffectActionIsIdentity, {no_time});
    const Breach set_number = [](Now& n) { g.param->paramSetValue(handle_of(n, "number"), 0.5); };
    expect_each(
        kOfxActionInstanceChanged,
        {{"in answer to the plugin's own setting", set_number},
         {"number would be undone in a step of its own", set_number},
         {"or no label", [](Now& n) { g.param->paramEditBegin(n.params, ""); }},
         {"or no label", [](Now& n) { g.param->paramEditBegin(n.params, nullptr); }},
         {"paramEditBegin without its End", [](Now& n) { g.param->paramEditBegin(n.params, "x"); }},
         {"one has begun already",
          [](Now& n) {
              g.param->paramEditBegin(n.params, "x");
              g.param->paramEditBegin(n.params, "x");
          }},
         {"paramEditEnd: none has begun", [](Now& n) { g.param->paramEditEnd(n.params); }},
         {"nothing to undo was set", [](Now& n) {
              g.param->paramEditBegin(n.params, "x");
              g.param->paramEditEnd(n.params);
          }}});
    for (const char* action : {kCreate, kOfxActionEndInstanceChanged}) {
        expect("paramEditBegin: only while an instance changes",
               faults_of(action, [](Now& n) { g.param->paramEditBegin(n.params, "x"); }));
    }
    expect_each(kRender,
                {{"paramGetValue: while rendering",
                  [&](Now& n) { g.param->paramGetValue(handle_of(n, "number"), &value); }},
                 {"paramSetValue: not allowed",
                  [](Now& n) { g.param->paramSetValue(handle_of(n, "number"), 0.5); }},
                 {"paramGetDerivative: not expected",
                  [&](Now& n) { g.param->paramGetDerivative(handle_of(n, "number"), 0, &value); }},
                 {"called in a spawned thread", [](Now& n) {
                      const auto ask = [](unsigned, unsigned, void* data) {
                          handle_of(*static_cast<Now*>(data), "number");
                      };
                      g.thread->multiThread(ask, 2, &n);
                  }}});
}

TEST(preferences_that_change_unasked_are_noticed) {
    const auto follow_the_number = [](Now& n) {
        double value = 0;
        g.param->paramGetValue(handle_of(n, "number"), &value);
        g.prop->propSetInt(n.answer, kOfxImageEffectFrameVarying, 0, value < 0.5);
    };
    const char* const kPreferences = kOfxImageEffectActionGetClipPreferences;
    expect("another answer after a change of number", faults_of(kPreferences, follow_the_number));
    g.slave = "number";
    CHECK(faults_of(kPreferences, follow_the_number).empty());
    g.slave = "nubmer";
    expect("depend on nubmer, which is no parameter", faults_of("", {}));
    g.slave.clear();
}

TEST(wrong_renders_are_noticed) {
    const int row = 16 * 16;  // bytes of a row of the 16 float RGBA pixels
    expect_each(kRender,
                {{"1 images were not released", [](Now& n) { n.source = nullptr; }},
                 {"not an image of this render, or twice",
                  [](Now& n) { g.effect->clipReleaseImage(n.output); }},
                 {"the source was written", [](Now& n) { ++n.source_pixels[100]; }},
                 {"wrote outside the render window", [](Now& n) { ++n.output_pixels[0]; }},
                 {"wrote outside the render window",  // a pixel to the right of it
                  [&](Now& n) { ++n.output_pixels[4 * row + 12 * 16]; }},
                 {"wrote outside the render window", [](Now& n) { --n.output_pixels[-1]; }},
                 {"wrote outside the render window", [&](Now& n) { ++n.output_pixels[16 * row]; }},
                 {"not the same twice", [&](Now& n) {
                      n.output_pixels[4 * row + 4 * 16] = static_cast<unsigned char>(g.renders);
                  }}});
    // The same within the window is a picture like any other.
    CHECK(faults_of(kRender, [&](Now& n) { n.output_pixels[4 * row + 4 * 16] = 7; }).empty());
    expect("must be handled", faults_of("", {}, {}, kOfxStatReplyDefault));
    expect("not the same twice", faults_of(kRender, [](Now&) {
               g.answer = g.renders % 2 ? kOfxStatOK : kOfxStatFailed;
           }));
}

TEST(texts_that_are_kept_become_rubbish) {
    std::string at_once, later;
    faults_of(kOfxActionInstanceChanged, [&](Now& n) {
        char* lent = nullptr;
        g.prop->propGetString(n.properties, kOfxImageEffectPropContext, 0, &lent);
        at_once = lent;
        handle_of(n, "number");
        later = lent;
    });
    CHECK(at_once == kOfxImageEffectContextFilter);
    CHECK(!later.empty() && later.find_first_not_of('#') == std::string::npos);
}
