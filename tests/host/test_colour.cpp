// Colour management of OFX 1.5, and hosts without it.
#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

constexpr const char* kWanted = "OfxImageClipPropPreferredColourspaces_Source";

/// What the node wants its source in, in a host that has negotiated a style.
std::vector<std::string> wanted(const std::string& encoding, const char* style) {
    Plugin plugin(bundle());
    const auto node = plugin.create();
    std::string text = sidecar_text();
    const std::string old = R"("encoding": "linear")";
    text.replace(text.find(old), old.size(), R"("encoding": ")" + encoding + "\"");
    node->set("sidecar", write("clip.p4d.json", text));
    if (style) {
        node->effect().properties.put(kOfxImageEffectPropColourManagementStyle, std::string(style));
    }
    OfxPropertySetStruct out(kOutArgs);
    CHECK(node->clip_preferences(out) == kOfxStatOK);
    CHECK(out.number(kOfxImageEffectFrameVarying) == 1);
    std::vector<std::string> names;
    for (std::size_t i = 0; out.has(kWanted) && i < out.values.at(kWanted).size(); ++i) {
        names.push_back(out.text(kWanted, i));
    }
    return names;
}

using Names = std::vector<std::string>;

}  // namespace

TEST(the_sidecars_encoding_is_wanted) {
    const char* full = kOfxImageEffectColourManagementFull;
    CHECK(wanted("sRGB", full) == Names({"srgb_display", "ofx_display_sdr"}));
    CHECK(wanted("Rec.709", full) == Names({"rec1886_rec709_display", "ofx_display_sdr"}));
    CHECK(wanted("linear Rec.709", full) == Names({"lin_rec709_srgb", "ofx_scene_linear"}));
    CHECK(wanted("ACEScct", full) == Names({"ACEScct", "ofx_scene_log"}));
    CHECK(wanted("arri_logc4", full) == Names({"arri_logc4", "ofx_scene_log"}));
    CHECK(wanted("linear", full) == Names({"ofx_scene_linear"}));
    CHECK(wanted("sRGB", kOfxImageEffectColourManagementBasic) == Names({"ofx_display_sdr"}));
    CHECK(wanted("linear", kOfxImageEffectColourManagementBasic) == Names({"ofx_scene_linear"}));
    // An encoding that nobody knows is left to the host.
    for (const char* unknown : {"unknown", "", "my own log"}) CHECK(wanted(unknown, full).empty());
}

TEST(without_negotiation_nothing_is_wanted) {
    CHECK(wanted("sRGB", nullptr).empty());
    CHECK(wanted("sRGB", kOfxImageEffectColourManagementNone).empty());
    Config config;
    config.missing_properties = {kOfxImageEffectPropColourManagementStyle,
                                 kOfxImageEffectPropColourManagementAvailableConfigs, kWanted,
                                 kOfxImageClipPropColourspace};
    Host::get().configure(config);
    CHECK(wanted("sRGB", kOfxImageEffectColourManagementFull).empty());
    Plugin plugin(bundle());
    std::string name;
    CHECK(plugin.create()->output_colourspace(name) == kOfxStatReplyDefault);
}

TEST(hosts_ask_again_when_a_sidecar_is_chosen) {
    Plugin plugin(bundle());
    const auto node = plugin.create();
    node->effect().properties.put(kOfxImageEffectPropColourManagementStyle,
                                  std::string(kOfxImageEffectColourManagementFull));
    const auto named = [&] {
        OfxPropertySetStruct out(kOutArgs);
        CHECK(node->clip_preferences(out) == kOfxStatOK);
        return out.text(kWanted);
    };
    // Each change is told, and an answer that it changes unannounced would be a fault.
    const auto set = [&](const char* param, Value value) {
        node->set(param, std::move(value));
        CHECK(node->changed(param) == kOfxStatOK);
        return named();
    };
    const std::string path = sidecar("chosen.p4d.json");
    CHECK(set("strength", 0.5).empty());
    CHECK(set("sidecar", path) == "ofx_scene_linear");
    // Another encoding, seen when the file is reloaded.
    std::string text = sidecar_text();
    const std::string old = R"("encoding": "linear")";
    write("chosen.p4d.json", text.replace(text.find(old), old.size(), R"("encoding": "sRGB")"));
    CHECK(node->changed("reload") == kOfxStatOK);
    CHECK(named() == "srgb_display");
    // A moved one, found in the clip's folder.
    CHECK(set("sidecar", std::string("/nowhere/chosen.p4d.json")) == "srgb_display");
    CHECK(set("clipFolder", std::string("/nowhere")).empty());
    CHECK(set("clipFolder", folder().u8string()) == "srgb_display");
}

TEST(the_output_is_in_the_sources_space) {
    Plugin plugin(bundle());
    const auto node = plugin.create();
    std::string name;
    CHECK(node->output_colourspace(name) == kOfxStatOK);
    CHECK(name == "OfxColourspace_Source");
}
