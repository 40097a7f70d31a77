// That the strict host notices what it says it does, one breach of the standard at a time. A check
// that nothing can fail is worth nothing.
#include "harness.hpp"
#include "strict_guest.hpp"

using namespace guest;
using namespace strict;
using namespace test;

namespace {

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
          [&](Now& n) { g.param->paramGetValueAtTime(handle_of(n, "group"), 0, &value); }},
         {"clipGetImage: not while rendering",
          [&](Now& n) { g.effect->clipGetImage(clip_of(n, "Source"), 0, nullptr, &image); }},
         {"an unknown type",
          [](Now& n) { g.message->message(n.effect, "OfxMessageSad", "", "words"); }},
         {"multiThread: no function", [](Now&) { g.thread->multiThread(nullptr, 2, nullptr); }}});
    const Breach get_number = [&](Now& n) {
        g.param->paramGetValue(handle_of(n, "number"), &value);
    };
    const Breach set_number = [](Now& n) { g.param->paramSetValue(handle_of(n, "number"), 0.5); };
    expect_each(
        kOfxActionInstanceChanged,
        {{"in answer to the plugin's own setting", set_number},
         {"one without a value",
          [](Now& n) { g.param->paramSetValue(handle_of(n, "group"), 1.0); }},
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
    const Breach remove_keys = [](Now& n) { g.param->paramDeleteAllKeys(handle_of(n, "number")); };
    for (const char* action :
         {kCreate, kOfxActionSyncPrivateData, kOfxActionBeginInstanceChanged,
          kOfxActionEndInstanceChanged, kRender, kOfxImageEffectActionIsIdentity,
          kOfxImageEffectActionGetClipPreferences}) {
        expect("paramGetValue: not allowed", faults_of(action, get_number));
        expect("paramSetValue: not allowed", faults_of(action, set_number));
        expect("paramDeleteAllKeys: not allowed", faults_of(action, remove_keys));
    }
    for (const char* action : {kCreate, kOfxActionEndInstanceChanged}) {
        expect("paramEditBegin: only while an instance changes",
               faults_of(action, [](Now& n) { g.param->paramEditBegin(n.params, "x"); }));
    }
    expect_each(
        kOfxActionInstanceChanged,
        {{"clipGetImage: not while rendering",
          [&](Now& n) { g.effect->clipGetImage(clip_of(n, "Source"), 0, nullptr, &image); }},
         {"progressStart without its End",
          [](Now& n) {
              fetch<OfxProgressSuiteV1>(kOfxProgressSuite)->progressStart(n.effect, "x");
          }},
         {"progressUpdate: no instance, out of turn", [](Now& n) {
              fetch<OfxProgressSuiteV1>(kOfxProgressSuite)->progressUpdate(n.effect, 0);
          }}});
    expect_each(
        kRender,
        {{"another time's, without temporal access",
          [&](Now& n) { g.effect->clipGetImage(clip_of(n, "Source"), 5, nullptr, &image); }},
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
        g.param->paramGetValueAtTime(handle_of(n, "number"), 0, &value);
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

TEST(a_lock_that_an_action_waits_for_is_noticed) {
    Config config;
    config.natron = true;
    Host::get().configure(config);
    const auto set_in_a_step = [](Now& n) {
        if (g.param->paramEditBegin(n.params, "x") != kOfxStatOK) return;
        g.param->paramSetValue(handle_of(n, "number"), 0.5);
        g.param->paramEditEnd(n.params);
    };
    g.slave = "number";
    expect("waits for its lock for ever", faults_of(kOfxActionInstanceChanged, set_in_a_step));
    g.slave.clear();
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
