#include "convert/colour_spaces.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace palette4d {
namespace {

/// Chromaticities x and y of red, green, blue and white.
struct Gamut {
    double red[2], green[2], blue[2], white[2];
};

constexpr double kD65[2] = {0.3127, 0.3290};
constexpr Gamut with_d65(double rx, double ry, double gx, double gy, double bx, double by) {
    return {{rx, ry}, {gx, gy}, {bx, by}, {kD65[0], kD65[1]}};
}

// ITU-R BT.709 and BT.2020, SMPTE RP 431-2 and EG 432-1, Adobe RGB (1998), Academy S-2008-001 and
// S-2014-004, and the manufacturers' white papers.
constexpr Gamut kRec709 = with_d65(0.64, 0.33, 0.30, 0.60, 0.15, 0.06);
constexpr Gamut kRec2020 = with_d65(0.708, 0.292, 0.170, 0.797, 0.131, 0.046);
constexpr Gamut kP3 = with_d65(0.680, 0.320, 0.265, 0.690, 0.150, 0.060);
constexpr Gamut kP3D60 = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.32168, 0.33767}};
constexpr Gamut kP3Dci = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}};
constexpr Gamut kAdobeRgb = with_d65(0.64, 0.33, 0.21, 0.71, 0.15, 0.06);
constexpr Gamut kAp0 = {{0.7347, 0.2653}, {0, 1}, {0.0001, -0.0770}, {0.32168, 0.33767}};
constexpr Gamut kAp1 = {{0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};
constexpr Gamut kArri3 = with_d65(0.6840, 0.3130, 0.2210, 0.8480, 0.0861, -0.1020);
constexpr Gamut kArri4 = with_d65(0.7347, 0.2653, 0.1424, 0.8576, 0.0991, -0.0308);
constexpr Gamut kSony = with_d65(0.730, 0.280, 0.140, 0.855, 0.100, -0.050);
constexpr Gamut kSonyCine = with_d65(0.766, 0.275, 0.225, 0.800, 0.089, -0.087);
constexpr Gamut kVenice =
    with_d65(0.7404642643, 0.2793643748, 0.0892411454, 0.8938095286, 0.1104882367, -0.0525793331);
constexpr Gamut kVeniceCine =
    with_d65(0.7759018716, 0.2745023929, 0.1886829028, 0.8286849370, 0.1013373825, -0.0891875173);
constexpr Gamut kPanasonic = with_d65(0.730, 0.280, 0.165, 0.840, 0.100, -0.030);
constexpr Gamut kRed = with_d65(0.780308, 0.304253, 0.121595, 1.493994, 0.095612, -0.084589);
constexpr Gamut kDavinci = with_d65(0.8000, 0.3130, 0.1682, 0.9877, 0.0790, -0.1155);
constexpr Gamut kBlackmagic = with_d65(0.7177215, 0.3171181, 0.2280410, 0.8615690,  //
                                       0.1005841, -0.0820452);
constexpr Gamut kCanon = with_d65(0.740, 0.270, 0.170, 1.140, 0.080, -0.100);

enum class Kind { kSdr, kHdr, kLinear, kLog };
constexpr const char* kGeneric[] = {"ofx_display_sdr", "ofx_display_hdr", "ofx_scene_linear",
                                    "ofx_scene_log"};

/// A colour space of the standard's configuration, and its other names in sidecars and files.
struct Space {
    const char* name;  ///< null: not in the configuration; only its primaries are known
    Kind kind;
    bool core;
    const Gamut* gamut;
    const char* aliases;  ///< with spaces between them
};

constexpr Space kSpaces[] = {
    {"srgb_display", Kind::kSdr, true, &kRec709, "srgb srgb_rec709_display"},
    {"srgb_tx", Kind::kSdr, true, &kRec709,
     "srgb_texture srgb_rec709_scene srgb_encoded_rec709_srgb"},
    {"rec1886_rec709_display", Kind::kSdr, true, &kRec709,
     "rec709 bt709 rec1886 bt1886 g24_rec709_display"},
    {"g24_rec709_tx", Kind::kSdr, true, &kRec709,
     "g24_rec709 g24_rec709_scene gamma_2.4_rec709_texture gamma_2.4_encoded_rec709"},
    {"g22_rec709_tx", Kind::kSdr, true, &kRec709,
     "g22_rec709 g22_rec709_scene gamma_2.2_rec709_texture gamma_2.2_encoded_rec709"},
    {"g18_rec709_tx", Kind::kSdr, true, &kRec709,
     "g18_rec709 g18_rec709_scene gamma_1.8_rec709_texture gamma_1.8_encoded_rec709"},
    {"camera_rec709", Kind::kSdr, false, &kRec709, "rec709_camera"},
    {"rec1886_rec2020_display", Kind::kSdr, true, &kRec2020, "rec2020 bt2020"},
    {"displayp3_display", Kind::kSdr, true, &kP3, "displayp3 p3display"},
    {"srgb_encoded_p3d65_tx", Kind::kSdr, true, &kP3,
     "srgb_encoded_p3d65 srgb_p3d65 srgb_displayp3 srgb_p3d65_scene srgb_encoded_p3d65_texture"},
    {"p3d65_display", Kind::kSdr, true, &kP3, "p3d65 g26_p3d65_display gamma_2.6_p3d65_display"},
    {"p3d60_display", Kind::kSdr, false, &kP3D60, ""},
    {"p3_dci_display", Kind::kSdr, false, &kP3Dci, "dcip3 p3dci"},
    {"srgb_encoded_ap1_tx", Kind::kSdr, true, &kAp1,
     "srgb_encoded_ap1 srgb_ap1 srgb_ap1_scene srgb_encoded_ap1_texture"},
    {"g22_ap1_tx", Kind::kSdr, true, &kAp1,
     "g22_ap1 g22_ap1_scene gamma_2.2_ap1_texture gamma_2.2_encoded_ap1"},
    {"rec2100_pq_display", Kind::kHdr, true, &kRec2020, "rec2100pq pq st2084 smpte2084"},
    {"rec2100_hlg_display", Kind::kHdr, true, &kRec2020, "rec2100hlg hlg aribstdb67"},
    {"st2084_p3d65_display", Kind::kHdr, true, &kP3, "pq_p3d65_display"},
    {"lin_rec709_srgb", Kind::kLinear, true, &kRec709, "lin_rec709 lin_srgb lin_rec709_scene"},
    {"lin_rec2020", Kind::kLinear, true, &kRec2020, "lin_rec2020_scene"},
    {"lin_p3d65", Kind::kLinear, true, &kP3, "lin_displayp3 lin_p3d65_scene"},
    {"ACES2065-1", Kind::kLinear, true, &kAp0, "aces lin_ap0 lin_ap0_scene"},
    {"ACEScg", Kind::kLinear, true, &kAp1, "lin_ap1 lin_ap1_scene"},
    {"ACEScc", Kind::kLog, true, &kAp1, "acescc_ap1 acescc_ap1_scene"},
    {"ACEScct", Kind::kLog, true, &kAp1, "acescct_ap1 acescct_ap1_scene"},
    {"lin_arri_wide_gamut_3", Kind::kLinear, false, &kArri3, "lin_alexawide lin_awg3"},
    {"arri_logc3_ei800", Kind::kLog, false, &kArri3,
     "logc logc3 arri_logc arri_logc3 logc3ei800_alexawide"},
    {"lin_arri_wide_gamut_4", Kind::kLinear, false, &kArri4, "lin_awg4"},
    {"arri_logc4", Kind::kLog, false, &kArri4, "logc4"},
    {"lin_sgamut3", Kind::kLinear, false, &kSony, ""},
    {"slog3_sgamut3", Kind::kLog, false, &kSony, ""},
    {"lin_sgamut3cine", Kind::kLinear, false, &kSonyCine, ""},
    {"slog3_sgamut3cine", Kind::kLog, false, &kSonyCine, "slog3 slog3_sgamutcine"},
    {"lin_venice_sgamut3", Kind::kLinear, false, &kVenice, ""},
    {"slog3_venice_sgamut3", Kind::kLog, false, &kVenice, ""},
    {"lin_venice_sgamut3cine", Kind::kLinear, false, &kVeniceCine, ""},
    {"slog3_venice_sgamut3cine", Kind::kLog, false, &kVeniceCine, "slog3_venice_sgamutcine"},
    {"lin_vgamut", Kind::kLinear, false, &kPanasonic, ""},
    {"vlog_vgamut", Kind::kLog, false, &kPanasonic, "vlog"},
    {"lin_redwidegamutrgb", Kind::kLinear, false, &kRed, "lin_rwg"},
    {"log3g10_redwidegamutrgb", Kind::kLog, false, &kRed, "log3g10 rl3g10_rwg"},
    {"lin_davinci_widegamut", Kind::kLinear, false, &kDavinci, ""},
    {"davinci_intermediate_widegamut", Kind::kLog, false, &kDavinci, "davinci_intermediate di_wg"},
    {"lin_bmd_widegamut_gen5", Kind::kLinear, false, &kBlackmagic, ""},
    {"bmdfilm_widegamut_gen5", Kind::kLog, false, &kBlackmagic, "bmdfilm blackmagic_film_gen_5"},
    {"lin_cinemagamut_d55", Kind::kLinear, false, &kCanon, "lin_canoncgamutday"},
    {"canonlog2_cinemagamut_d55", Kind::kLog, false, &kCanon,
     "canonlog2 clog2 canonlog2_cgamutday"},
    {"canonlog3_cinemagamut_d55", Kind::kLog, false, &kCanon,
     "canonlog3 clog3 canonlog3_cgamutday"},
    {"ADX10", Kind::kLog, false, &kRec709, ""},
    {"ADX16", Kind::kLog, false, &kRec709, ""},
    {nullptr, Kind::kLog, false, &kRec2020, "apple_log"},
    {nullptr, Kind::kLinear, false, &kAdobeRgb, "lin_adobergb lin_adobergb_scene"},
    {nullptr, Kind::kSdr, false, &kAdobeRgb,
     "adobergb g22_adobergb g22_encoded_adobergb gamma_2.2_encoded_adobergb"},
};

/// Only letters and digits, in lower case, with "linear" shortened to "lin": "Linear Rec. 709",
/// "lin_rec709" and "LIN REC-709" match.
std::string plain(const std::string& text) {
    std::string result;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (std::isalnum(byte)) result += static_cast<char>(std::tolower(byte));
    }
    const std::string linear = "linear";
    if (result.size() > linear.size() && result.compare(0, linear.size(), linear) == 0) {
        result.erase(3, linear.size() - 3);
    }
    return result;
}

/// Whether one of some names, which blanks part, is the wanted plain one. A stream would ask for
/// the locale what a blank is, and in Windows' runtime library another one may free that answer.
bool has_name(std::string_view names, const std::string& wanted) {
    while (!names.empty()) {
        const std::size_t end = std::min(names.find(' '), names.size());
        if (plain(std::string(names.substr(0, end))) == wanted) return true;
        names.remove_prefix(std::min(end + 1, names.size()));
    }
    return false;
}

const Space* space_of(const std::string& encoding) {
    const std::string wanted = plain(encoding);
    for (const Space& space : kSpaces) {
        if ((space.name && plain(space.name) == wanted) || has_name(space.aliases, wanted)) {
            return &space;
        }
    }
    return nullptr;
}

/// The amounts of the primaries that make white (SMPTE RP 177-1993). Each primary has luminance 1,
/// so the amounts are their shares of white's luminance.
Vec3 weights_of(const Gamut& gamut) {
    // Columns X, Z and 1 of each primary, divided by its Y; Cramer's rule.
    const auto column = [](const double (&c)[2]) -> Vec3 {
        return {c[0] / c[1], (1 - c[0] - c[1]) / c[1], 1};
    };
    const auto determinant = [](const Vec3& a, const Vec3& b, const Vec3& c) {
        return a[0] * (b[1] * c[2] - c[1] * b[2]) - b[0] * (a[1] * c[2] - c[1] * a[2]) +
               c[0] * (a[1] * b[2] - b[1] * a[2]);
    };
    const Vec3 r = column(gamut.red), g = column(gamut.green), b = column(gamut.blue);
    const Vec3 w = column(gamut.white);
    const double all = determinant(r, g, b);
    return {determinant(w, g, b) / all, determinant(r, w, b) / all, determinant(r, g, w) / all};
}

}  // namespace

std::vector<std::string> colourspaces_of(const std::string& encoding, bool core) {
    if (const Space* space = space_of(encoding)) {
        if (!space->name) return {};
        const char* generic = kGeneric[static_cast<int>(space->kind)];
        if (core && !space->core) return {generic};
        return {space->name, generic};
    }
    // These names say no more than the kind, so any space of that kind will do.
    const std::string wanted = plain(encoding);
    if (wanted == "linear" || wanted == "scenelinear") return {kGeneric[2]};
    if (wanted == "log" || wanted == "logarithmic" || wanted == "printingdensity") {
        return {kGeneric[3]};
    }
    return {};
}

std::shared_ptr<const ColourConversion> from_linear(const std::string& encoding) {
    const Space* space = space_of(encoding);
    const std::string wanted = plain(encoding);
    if (wanted == "linear" || wanted == "scenelinear" || (space && space->kind == Kind::kLinear)) {
        return std::make_shared<const ColourConversion>();
    }
    if (!space || space->kind != Kind::kSdr) return nullptr;
    const std::string name = space->name ? space->name : space->aliases;
    const auto starts = [&](const char* with) { return name.rfind(with, 0) == 0; };
    // IEC 61966-2-1, ITU-R BT.709, BT.1886 and SMPTE RP 431-2.
    double gamma = 2.2, offset = 0;
    if (starts("srgb") || starts("displayp3")) gamma = 2.4, offset = 0.055;
    if (starts("camera_rec709")) gamma = 1 / 0.45, offset = 0.099;
    if (starts("rec1886") || starts("g24")) gamma = 2.4;
    if (starts("p3")) gamma = 2.6;
    if (starts("g18")) gamma = 1.8;
    const bool mirrored = offset == 0;
    return std::make_shared<const ColourConversion>(std::vector<ConversionStep>{
        GammaStep{{gamma, gamma, gamma}, {offset, offset, offset}, mirrored, /*inverse=*/true}});
}

Vec3 luminance_weights(const std::string& encoding) {
    // Its luma weights are rounded, and not those of its primaries (ITU-R BT.601).
    if (plain(encoding) == "rec601" || plain(encoding) == "bt601") return {0.299, 0.587, 0.114};
    const Space* space = space_of(encoding);
    return weights_of(space ? *space->gamut : kRec709);
}

}  // namespace palette4d
