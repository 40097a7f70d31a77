#include "colour.hpp"

#include <cctype>
#include <utility>

#include "files.hpp"
#include "outputs.hpp"

namespace palette4d::plugin {
namespace {

/// Letters and digits alone, small: "Rec. 709", "rec709" and "REC_709" are one.
std::string plain(const std::string& text) {
    std::string result;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (std::isalnum(byte)) result += static_cast<char>(std::tolower(byte));
    }
    return result;
}

constexpr const char* kDisplay = "ofx_display_sdr";
constexpr const char* kHighDynamicRange = "ofx_display_hdr";
constexpr const char* kLinear = "ofx_scene_linear";
constexpr const char* kLog = "ofx_scene_log";

/// Names of the standard's configuration, and what sidecars and files call the same.
struct Space {
    const char* name;
    const char* generic;
    std::vector<const char*> aliases;
};

const std::vector<Space>& spaces() {
    static const std::vector<Space> all = {
        {"srgb_display", kDisplay, {"srgb", "srgb_rec709_display"}},
        {"srgb_tx", kDisplay, {"srgb_rec709_scene", "srgb_texture"}},
        {"rec1886_rec709_display", kDisplay, {"rec709", "bt709", "rec1886", "bt1886"}},
        {"rec1886_rec2020_display", kDisplay, {"rec2020", "bt2020"}},
        {"displayp3_display", kDisplay, {"displayp3", "p3display"}},
        {"p3d65_display", kDisplay, {"p3d65"}},
        {"rec2100_pq_display", kHighDynamicRange, {"rec2100pq", "pq", "st2084", "smpte2084"}},
        {"rec2100_hlg_display", kHighDynamicRange, {"rec2100hlg", "hlg", "aribstdb67"}},
        {"lin_rec709_srgb", kLinear, {"linear rec709", "lin_rec709", "lin_rec709_scene"}},
        {"lin_rec2020", kLinear, {"linear rec2020", "lin_rec2020_scene"}},
        {"lin_p3d65", kLinear, {"linear p3d65", "lin_p3d65_scene"}},
        {"ACES2065-1", kLinear, {"aces", "lin_ap0", "lin_ap0_scene"}},
        {"ACEScg", kLinear, {"lin_ap1", "lin_ap1_scene"}},
        {"ACEScc", kLog, {}},
        {"ACEScct", kLog, {"acescct_ap1_scene"}},
        {"arri_logc3_ei800", kLog, {"logc", "logc3", "arri logc", "arri logc3"}},
        {"arri_logc4", kLog, {"logc4", "arri logc4"}},
        {"slog3_sgamut3", kLog, {"s-log3 s-gamut3"}},
        {"slog3_sgamut3cine", kLog, {"slog3", "s-log3 s-gamut3.cine"}},
        {"vlog_vgamut", kLog, {"vlog", "v-log"}},
        {"log3g10_redwidegamutrgb", kLog, {"log3g10"}},
        {"davinci_intermediate_widegamut", kLog, {"davinci intermediate", "di wg"}},
        {"bmdfilm_widegamut_gen5", kLog, {"bmdfilm", "blackmagic film gen 5"}},
        {"canonlog2_cinemagamut_d55", kLog, {"canonlog2", "clog2"}},
        {"canonlog3_cinemagamut_d55", kLog, {"canonlog3", "clog3"}},
    };
    return all;
}

}  // namespace

std::vector<std::string> colourspaces_of(const std::string& encoding) {
    const std::string wanted = plain(encoding);
    for (const Space& space : spaces()) {
        bool same = plain(space.name) == wanted;
        for (const char* alias : space.aliases) same = same || plain(alias) == wanted;
        if (same) return {space.name, space.generic};
    }
    // Nothing more is said of these: any space of the kind will do.
    if (wanted == "linear" || wanted == "scenelinear") return {kLinear};
    if (wanted == "log" || wanted == "logarithmic" || wanted == "printingdensity") return {kLog};
    return {};
}

void describe_colour(const Properties& node) {
    node.set_string(kOfxImageEffectPropColourManagementStyle, kOfxImageEffectColourManagementFull);
    node.set_string(kOfxImageEffectPropColourManagementAvailableConfigs, kOfxConfigIdentifier);
}

void prefer_colour(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args) {
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->getPropertySet ||
        suites.effect->getPropertySet(effect, &handle) != kOfxStatOK) {
        return;
    }
    const auto style =
        Properties(suites, handle).get_string(kOfxImageEffectPropColourManagementStyle);
    if (!style || style->empty() || *style == kOfxImageEffectColourManagementNone) return;
    const Params params(suites, effect);
    const Chosen chosen = chosen_sidecar(params, std::nullopt);
    if (!chosen.result.loaded) return;
    const Sidecar& sidecar = chosen.result.loaded->sidecar();
    const bool converts = sidecar.conversion && params.int_now(kParamPictureIn).value_or(0) != 1;
    const std::vector<std::string> wanted =
        colourspaces_of(converts ? sidecar.conversion->input_space : sidecar.clip.encoding);
    const std::string name = std::string(kOfxImageClipPropPreferredColourspaces) + "_" +
                             kOfxImageEffectSimpleSourceClipName;
    // The basic style knows the generic spaces alone.
    std::size_t first = 0;
    if (*style == kOfxImageEffectColourManagementBasic && wanted.size() > 1) first = 1;
    int index = 0;
    for (std::size_t i = first; i < wanted.size(); ++i) {
        index += out_args.set_string(name.c_str(), wanted[i].c_str(), index);
    }
}

OfxStatus output_colour(const Properties& out_args) {
    const std::string same = std::string("OfxColourspace_") + kOfxImageEffectSimpleSourceClipName;
    return out_args.set_string(kOfxImageClipPropColourspace, same.c_str()) ? kOfxStatOK
                                                                           : kOfxStatReplyDefault;
}

}  // namespace palette4d::plugin
