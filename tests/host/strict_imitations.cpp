#include "strict_imitations.hpp"

namespace strict {
namespace {

const std::string kMessageSuite2 = std::string(kOfxMessageSuite) + "/2";

/// Properties of later versions of the standard than a host's own.
std::set<std::string> later_than(int minor) {
    std::set<std::string> names;
    if (minor < 2) {
        names.insert({kOfxPropVersion, kOfxPropVersionLabel, kOfxPropPluginDescription,
                      kOfxParamPropPersistant});
    }
    if (minor < 3) names.insert({kOfxParamPropScriptName});
    if (minor < 4) names.insert({"OfxImageEffectPropCPURenderSupported"});
    if (minor < 5) {
        names.insert(
            {"OfxImageEffectPropNoSpatialAwareness", kOfxImageEffectPropColourManagementStyle,
             kOfxImageEffectPropColourManagementAvailableConfigs, kOfxImageClipPropColourspace,
             "OfxImageClipPropPreferredColourspaces_Source"});
    }
    return names;
}

Layout picture(int x1, int y1, int x2, int y2, Depth depth, const char* alpha) {
    Layout layout;
    layout.bounds = {x1, y1, x2, y2};
    layout.depth = depth;
    layout.premultiplication = alpha;
    return layout;
}

Imitation resolve() {
    Imitation host;
    host.name = "Resolve";
    host.config.api_minor = 4;
    host.config.missing_properties = later_than(4);
    host.config.tiles = host.config.multi_resolution = false;
    host.config.animates_strings = false;
    // Its message suite of version 2 has the functions of version 1 alone.
    host.config.null_functions = {"setPersistentMessage", "clearPersistentMessage"};
    host.layouts = {picture(0, 0, 48, 27, Depth::kFloat, kOfxImagePreMultiplied),
                    picture(0, 0, 48, 27, Depth::kFloat, kOfxImageOpaque)};
    return host;
}

Imitation nuke() {
    Imitation host;
    host.name = "Nuke";
    host.config.api_minor = 2;
    host.config.missing_properties = later_than(2);
    host.config.missing_suites = {};
    host.config.secret_stays = true;
    host.config.frame_range = {1010, 1020};
    // Boxes off the origin, and premultiplied, as there.
    host.layouts = {picture(-12, 7, 40, 31, Depth::kFloat, kOfxImagePreMultiplied),
                    picture(100, 100, 131, 119, Depth::kFloat, kOfxImageUnPreMultiplied)};
    return host;
}

Imitation natron() {
    Imitation host;
    host.name = "Natron";
    host.context = kOfxImageEffectContextGeneral;
    host.config.api_minor = 4;
    host.config.missing_properties = later_than(4);
    host.config.frame_range = {10, 20};
    host.config.frame_rate = 24;
    host.config.natron = true;
    host.config.project = "/nowhere/a project";
    host.tile = 16;
    for (const double scale : {1.0, 0.5, 0.25}) {
        Layout layout =
            picture(static_cast<int>(-8 * scale), static_cast<int>(16 * scale),
                    static_cast<int>(56 * scale), static_cast<int>(64 * scale),
                    scale == 0.5 ? Depth::kByte : Depth::kFloat, kOfxImagePreMultiplied);
        layout.scale = scale;
        layout.padding = 16;
        host.layouts.push_back(layout);
    }
    host.layouts.push_back(host.layouts[0]);
    host.layouts.back().channels = 3;
    return host;
}

Imitation fusion() {
    Imitation host;
    host.name = "Fusion";
    host.config.api_minor = 0;
    host.config.missing_properties = later_than(0);
    host.config.missing_properties.insert(kOfxImagePropRegionOfDefinition);
    host.config.missing_suites = {kMessageSuite2};
    host.config.tiles = host.config.multi_resolution = false;
    host.layouts = {picture(0, 0, 33, 21, Depth::kFloat, kOfxImagePreMultiplied),
                    picture(0, 0, 33, 21, Depth::kByte, kOfxImagePreMultiplied)};
    return host;
}

Imitation melt() {
    Imitation host;
    host.name = "melt";
    host.config.api_minor = 4;
    host.config.missing_properties = later_than(4);
    host.config.missing_properties.insert(
        {kOfxImageEffectPropFrameRange, kOfxImageEffectPropFrameRate});
    host.tells_changes = false;
    host.fresh_instances = true;
    for (const Depth depth : {Depth::kFloat, Depth::kByte}) {
        Layout layout = picture(0, 0, 46, 34, depth, kOfxImageUnPreMultiplied);
        layout.upside_down = true;
        host.layouts.push_back(layout);
    }
    return host;
}

}  // namespace

const std::vector<Imitation>& imitations() {
    static const std::vector<Imitation> all = {resolve(), nuke(), natron(), fusion(), melt()};
    return all;
}

}  // namespace strict
