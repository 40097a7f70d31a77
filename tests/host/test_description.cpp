// What the node says about itself, and its life in the host.
#include <algorithm>
#include <fstream>
#include <string>

#include "harness.hpp"

using namespace strict;
using namespace test;

TEST(node_describes_itself) {
    Plugin plugin(bundle());
    CHECK(plugin.ofx().pluginApi == std::string(kOfxImageEffectPluginApi));
    CHECK(plugin.ofx().apiVersion == 1);
    CHECK(plugin.ofx().pluginIdentifier == std::string("org.palette4d.Palette4D"));
    CHECK(plugin.ofx().pluginVersionMajor == 1 && plugin.ofx().pluginVersionMinor == 7);
    CHECK(plugin.load() == kOfxStatOK);
    for (const char* context : {kOfxImageEffectContextFilter, kOfxImageEffectContextGeneral,
                                kOfxImageEffectContextPaint}) {
        const auto effect = plugin.describe(context);
        CHECK(effect != nullptr);
        if (!effect) continue;
        const OfxPropertySetStruct& p = effect->properties;
        CHECK(p.text(kOfxPropLabel) == "Palette4D");
        CHECK(p.values.at(kOfxImageEffectPropSupportedContexts).size() == 3);
        CHECK(p.values.at(kOfxImageEffectPropSupportedPixelDepths).size() == 2);
        CHECK(p.text(kOfxImageEffectPropSupportedPixelDepths, 0) == kOfxBitDepthFloat);
        CHECK(p.text(kOfxImageEffectPropSupportedPixelDepths, 1) == kOfxBitDepthByte);
        CHECK(p.text(kOfxImageEffectPluginRenderThreadSafety) == kOfxImageEffectRenderFullySafe);
        CHECK(p.number(kOfxImageEffectPluginPropHostFrameThreading) == 0);
        CHECK(p.number(kOfxImageEffectPropSupportsTiles) == 1);
        CHECK(p.number(kOfxImageEffectPropSupportsMultiResolution) == 1);
        CHECK(p.text("OfxImageEffectPropCPURenderSupported") == "true");
        CHECK(p.text("OfxImageEffectPropNoSpatialAwareness") == "true");
        CHECK(p.text(kOfxImageEffectPropColourManagementStyle) ==
              kOfxImageEffectColourManagementFull);
        CHECK(p.text(kOfxImageEffectPropColourManagementAvailableConfigs) ==
              "ofx-native-v1.5_aces-v1.3_ocio-v2.3");
        for (const auto& [name, clip] : effect->clips) {
            if (name == "Brush") continue;
            const OfxPropertySetStruct& c = clip->properties;
            CHECK(c.text(kOfxImageEffectPropSupportedComponents, 0) == kOfxImageComponentRGBA);
            CHECK(c.text(kOfxImageEffectPropSupportedComponents, 1) == kOfxImageComponentRGB);
            CHECK(c.text(kOfxImageEffectPropSupportedComponents, 2) == kOfxImageComponentAlpha);
        }
        // Saved in projects: none of these names may ever go.
        const auto& order = effect->params.order;
        for (const char* name :
             {"sidecar", "version", "clipFolder", "reload", "embed", "embedded", "revision",
              "strength", "frameOffset", "editsFrom", "resetHandles", "handle01", "handle01On",
              "handle01Id", "handle32", "handle32On", "handle32Id", "status", "pictureIn"}) {
            EXPECT(std::count(order.begin(), order.end(), name) == 1, std::string("no ") + name);
        }
        const auto& params = effect->params.params;
        const OfxPropertySetStruct& sidecar = params.at("sidecar")->properties;
        CHECK(sidecar.text(kOfxParamPropStringMode) == kOfxParamStringIsFilePath);
        CHECK(sidecar.number(kOfxParamPropStringFilePathExists) == 1);
        const OfxPropertySetStruct& strength = params.at("strength")->properties;
        CHECK(strength.number(kOfxParamPropMin) == 0 && strength.number(kOfxParamPropMax) == 1);
        CHECK(strength.number(kOfxParamPropDefault) == 1);
        CHECK(params.at("frameOffset")->properties.number(kOfxParamPropDefault) == 0);
        const OfxPropertySetStruct& status = params.at("status")->properties;
        CHECK(status.text(kOfxParamPropStringMode) == kOfxParamStringIsMultiLine);
        CHECK(status.number(kOfxParamPropEnabled) == 0);
    }
    CHECK(plugin.unload() == kOfxStatOK);
}

TEST(unknown_actions_are_left_to_the_host) {
    Plugin plugin(bundle());
    const auto instance = plugin.create();
    for (const char* action :
         {"OfxActionSomethingNew", kOfxImageEffectActionGetRegionOfDefinition,
          kOfxImageEffectActionGetRegionsOfInterest, kOfxImageEffectActionGetFramesNeeded,
          kOfxImageEffectActionBeginSequenceRender, kOfxImageEffectActionEndSequenceRender}) {
        CHECK(plugin.call(action, &instance->effect(), nullptr, nullptr) == kOfxStatReplyDefault);
    }
    CHECK(plugin.ofx().mainEntry(nullptr, nullptr, nullptr, nullptr) == kOfxStatReplyDefault);
    CHECK(plugin.call(kOfxActionPurgeCaches, &instance->effect(), nullptr, nullptr) == kOfxStatOK);
}

TEST(a_still_picture_varies_from_frame_to_frame) {
    Plugin plugin(bundle());
    const auto instance = plugin.create();
    bool varying = false;
    CHECK(instance->clip_preferences(varying) == kOfxStatOK);
    CHECK(varying);
}

TEST(status_says_what_was_loaded) {
    Plugin plugin(bundle());
    const auto instance = plugin.create();
    CHECK(instance->text("status") == "No sidecar chosen");
    const std::string path = sidecar();
    instance->set("sidecar", path);
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status") ==
          "box: frames 10-20 at 24 fps, 16 handles, 3 edits\n"
          "file " +
              path +
              "\n"
              "expects the picture in linear\ntime 0 is frame 10");
    instance->set("sidecar", (folder() / "gone.p4d.json").u8string());
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status").find("gone.p4d.json") != std::string::npos);
    CHECK(instance->text("status").find("does not exist") != std::string::npos);
    instance->set("sidecar", write("broken.p4d.json", "{\"schema\": 5}"));
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status").find("broken.p4d.json") != std::string::npos);
    CHECK(instance->text("status").find("expected") != std::string::npos);
    instance->set("sidecar", std::string());
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status") == "No sidecar chosen");
}

TEST(names_from_a_sidecar_do_not_act_on_terminals) {
    Plugin plugin(bundle());
    const auto instance = plugin.create();
    std::string text = sidecar_text();
    const std::string name = "\"box\"";
    const std::string hostile =
        "\"\\u001b[2J\xc2\x9b"
        "31m\xe2\x80\xae\xd8\x9c\xe2\x80\x8f\xc3\xa9\"";
    std::string lines = text;
    text.replace(text.find(name), name.size(), hostile);
    instance->set("sidecar", write("hostile.p4d.json", text));
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status").find(
              "\\u001b[2J\\u009b31m\\u202e\\u061c\\u200f\xc3\xa9: frames") == 0);
    lines.replace(lines.find(name), name.size(), "\"box\\nfile /forged\"");
    instance->set("sidecar", write("lines.p4d.json", lines));
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status").find("box\\nfile /forged: frames") == 0);
    instance->set("sidecar", (folder() / "gone\x1b[2J.p4d.json").u8string());
    CHECK(instance->changed("sidecar") == kOfxStatOK);
    CHECK(instance->text("status").find('\x1b') == std::string::npos);
    CHECK(instance->text("status").find("gone\\u001b[2J.p4d.json") != std::string::npos);
}

TEST(a_reopened_project_shows_its_handles) {
    // Nothing may be set while an instance is created, but the host has what it saved, and labels
    // are no values.
    Plugin plugin(bundle());
    CHECK(plugin.load() == kOfxStatOK);
    const auto descriptor = plugin.describe(kOfxImageEffectContextGeneral);
    Instance instance(plugin, *descriptor, kOfxImageEffectContextGeneral);
    instance.set("sidecar", sidecar());
    instance.set("status", std::string("as it was saved"));
    CHECK(instance.create() == kOfxStatOK);
    CHECK(instance.sync() == kOfxStatReplyDefault);
    CHECK(instance.text("status") == "as it was saved");
    CHECK(instance.properties("handle17").text(kOfxPropLabel) == "s1, stop at 15");
    CHECK(instance.properties("handle18").number(kOfxParamPropSecret) == 1);
    CHECK(instance.changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(instance.text("status").find("box: frames 10-20") == 0);
}

TEST(load_and_unload_repeat) {
    const std::string path = sidecar();
    const palette4d::Sidecar parsed = palette4d::read_sidecar(path);
    for (int binary = 0; binary < 3; ++binary) {
        Plugin plugin(bundle());
        for (int round = 0; round < 4; ++round) {
            {
                // Loaded again by each instance, as MLT does.
                const auto first = plugin.create();
                const auto second = plugin.create(kOfxImageEffectContextGeneral);
                Picture source{Layout()}, output{Layout()};
                fill(source);
                for (Instance* instance : {first.get(), second.get()}) {
                    instance->set("sidecar", path);
                    CHECK(instance->render(3, &source, output, output.layout().bounds) ==
                          kOfxStatOK);
                    CHECK(output.pixels(output.layout().bounds) ==
                          recoloured(parsed, 13, source, output.layout().bounds));
                }
            }
            CHECK(plugin.unload() == kOfxStatOK);
        }
    }
#if defined(__linux__)
    // Nothing of the library stays, for which its static objects must be destroyed by now.
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        EXPECT(line.find("/Palette4D.ofx") == std::string::npos, line);
    }
#endif
}

TEST(identity_is_reported) {
    Plugin plugin(bundle());
    const auto instance = plugin.create();
    std::string clip;
    double time = 0;
    const auto identity = [&](double at) {
        const OfxStatus status = instance->is_identity(at, clip, time);
        CHECK(status == kOfxStatOK || status == kOfxStatReplyDefault);
        if (status == kOfxStatOK) CHECK(clip == "Source" && time == at);
        return status == kOfxStatOK;
    };
    CHECK(identity(2.5));  // no sidecar
    instance->set("sidecar", sidecar());
    CHECK(!identity(2.5));
    instance->set("strength", 0.0);
    CHECK(identity(2.5));
    instance->animate("strength", {{0, 0.0}, {10, 1.0}});
    CHECK(identity(0));
    CHECK(!identity(0.25));
    instance->animate("strength", {});
    instance->set("strength", 1.0);
    instance->set("sidecar", sidecar("plain.p4d.json", false));
    CHECK(identity(2.5));
    instance->set("sidecar", std::string("/nowhere/at/all.p4d.json"));
    CHECK(!identity(2.5));  // there is a message to show
    // The same where all that is wrong is a handle that is in use and not there.
    instance->set("sidecar", sidecar("plain.p4d.json", false));
    instance->set("handle05Id", std::string("v99"));
    CHECK(identity(2.5));
    instance->set("handle05On", 1);
    CHECK(!identity(2.5));
    instance->set("mix", 0.0);
    CHECK(identity(2.5));
}
