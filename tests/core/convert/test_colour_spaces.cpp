// Colour spaces by name: what hosts are asked for, and what lightness weighs.
#include "convert/colour_spaces.hpp"

#include <cmath>

#include "check.hpp"

using namespace palette4d;

namespace {

/// A space of ofx-native-v1.5_aces-v1.3_ocio-v2.3: its name, its label (which is OpenColorIO's name
/// for it), and the generic space of its encoding.
struct Known {
    const char* name;
    const char* label;
    const char* generic;
};
const char* const kSdr = "ofx_display_sdr";
const char* const kHdr = "ofx_display_hdr";
const char* const kLinear = "ofx_scene_linear";
const char* const kLog = "ofx_scene_log";

const Known kKnown[] = {
    {"srgb_display", "sRGB - Display", kSdr},
    {"displayp3_display", "Display P3 - Display", kSdr},
    {"rec1886_rec709_display", "Rec.1886 Rec.709 - Display", kSdr},
    {"rec1886_rec2020_display", "Rec.1886 Rec.2020 - Display", kSdr},
    {"rec2100_hlg_display", "Rec.2100-HLG - Display", kHdr},
    {"rec2100_pq_display", "Rec.2100-PQ - Display", kHdr},
    {"st2084_p3d65_display", "ST2084-P3-D65 - Display", kHdr},
    {"p3d65_display", "P3-D65 - Display", kSdr},
    {"p3d60_display", "P3-D60 - Display", kSdr},
    {"p3_dci_display", "P3-DCI - Display", kSdr},
    {"ACES2065-1", "ACES2065-1", kLinear},
    {"ACEScc", "ACEScc", kLog},
    {"ACEScct", "ACEScct", kLog},
    {"ACEScg", "ACEScg", kLinear},
    {"ADX10", "ADX10", kLog},
    {"ADX16", "ADX16", kLog},
    {"lin_p3d65", "Linear P3-D65", kLinear},
    {"lin_rec2020", "Linear Rec.2020", kLinear},
    {"lin_rec709_srgb", "Linear Rec.709 (sRGB)", kLinear},
    {"g18_rec709_tx", "Gamma 1.8 Rec.709 - Texture", kSdr},
    {"g22_ap1_tx", "Gamma 2.2 AP1 - Texture", kSdr},
    {"g22_rec709_tx", "Gamma 2.2 Rec.709 - Texture", kSdr},
    {"g24_rec709_tx", "Gamma 2.4 Rec.709 - Texture", kSdr},
    {"srgb_encoded_ap1_tx", "sRGB Encoded AP1 - Texture", kSdr},
    {"srgb_encoded_p3d65_tx", "sRGB Encoded P3-D65 - Texture", kSdr},
    {"srgb_tx", "sRGB - Texture", kSdr},
    {"camera_rec709", "Camera Rec.709", kSdr},
    {"lin_arri_wide_gamut_3", "Linear ARRI Wide Gamut 3", kLinear},
    {"arri_logc3_ei800", "ARRI LogC3 (EI800)", kLog},
    {"lin_arri_wide_gamut_4", "Linear ARRI Wide Gamut 4", kLinear},
    {"arri_logc4", "ARRI LogC4", kLog},
    {"lin_bmd_widegamut_gen5", "Linear BMD WideGamut Gen5", kLinear},
    {"bmdfilm_widegamut_gen5", "BMDFilm WideGamut Gen5", kLog},
    {"lin_davinci_widegamut", "Linear DaVinci WideGamut", kLinear},
    {"davinci_intermediate_widegamut", "DaVinci Intermediate WideGamut", kLog},
    {"lin_cinemagamut_d55", "Linear CinemaGamut D55", kLinear},
    {"canonlog2_cinemagamut_d55", "CanonLog2 CinemaGamut D55", kLog},
    {"canonlog3_cinemagamut_d55", "CanonLog3 CinemaGamut D55", kLog},
    {"lin_vgamut", "Linear V-Gamut", kLinear},
    {"vlog_vgamut", "V-Log V-Gamut", kLog},
    {"lin_redwidegamutrgb", "Linear REDWideGamutRGB", kLinear},
    {"log3g10_redwidegamutrgb", "Log3G10 REDWideGamutRGB", kLog},
    {"lin_sgamut3", "Linear S-Gamut3", kLinear},
    {"slog3_sgamut3", "S-Log3 S-Gamut3", kLog},
    {"lin_sgamut3cine", "Linear S-Gamut3.Cine", kLinear},
    {"slog3_sgamut3cine", "S-Log3 S-Gamut3.Cine", kLog},
    {"lin_venice_sgamut3", "Linear Venice S-Gamut3", kLinear},
    {"slog3_venice_sgamut3", "S-Log3 Venice S-Gamut3", kLog},
    {"lin_venice_sgamut3cine", "Linear Venice S-Gamut3.Cine", kLinear},
    {"slog3_venice_sgamut3cine", "S-Log3 Venice S-Gamut3.Cine", kLog},
};

using Names = std::vector<std::string>;

}  // namespace

TEST(every_space_of_the_standards_configuration_is_known) {
    for (const Known& space : kKnown) {
        const Names wanted = {space.name, space.generic};
        check::report(colourspaces_of(space.name) == wanted, __FILE__, __LINE__, space.name);
        check::report(colourspaces_of(space.label) == wanted, __FILE__, __LINE__, space.label);
        check::report(colourspaces_of(space.name, true).back() == space.generic, __FILE__, __LINE__,
                      space.name);
    }
    // What OpenColorIO's later configs call some of them.
    CHECK(colourspaces_of("sRGB Encoded Rec.709 (sRGB)") == Names({"srgb_tx", kSdr}));
    CHECK(colourspaces_of("Gamma 2.4 Encoded Rec.709") == Names({"g24_rec709_tx", kSdr}));
    CHECK(colourspaces_of("Gamma 2.6 P3-D65 - Display") == Names({"p3d65_display", kSdr}));
    CHECK(colourspaces_of("LIN_REC709") == Names({"lin_rec709_srgb", kLinear}));
}

TEST(hosts_of_core_spaces_alone_are_asked_for_those) {
    CHECK(colourspaces_of("ACEScct", true) == Names({"ACEScct", kLog}));
    CHECK(colourspaces_of("ARRI LogC4", true) == Names({kLog}));
    CHECK(colourspaces_of("Linear S-Gamut3", true) == Names({kLinear}));
    for (const char* unknown : {"", "my own", "Apple Log", "linearity"}) {
        CHECK(colourspaces_of(unknown).empty() && colourspaces_of(unknown, true).empty());
    }
}

TEST(luminance_weighs_as_the_spaces_makers_say) {
    // The second rows of their matrices to CIE XYZ, as published.
    const std::pair<const char*, Vec3> rows[] = {
        {"sRGB", {0.2126, 0.7152, 0.0722}},
        {"Rec.2020", {0.2627, 0.6780, 0.0593}},
        {"P3-D65 - Display", {0.22897, 0.69174, 0.07929}},
        {"ACES2065-1", {0.3439664498, 0.7281660966, -0.0721325464}},
        {"ACEScct", {0.2722287168, 0.6740817658, 0.0536895174}},
        {"Linear ARRI Wide Gamut 3", {0.291954, 0.823841, -0.115795}},
        {"S-Log3 S-Gamut3", {0.2709796708, 0.7866064112, -0.0575860820}},
        {"S-Log3 S-Gamut3.Cine", {0.2150757820, 0.8850685017, -0.1001442837}},
        {"V-Log V-Gamut", {0.260686, 0.774894, -0.035580}},
        {"Linear REDWideGamutRGB", {0.286694, 0.842979, -0.129673}},
        {"Linear DaVinci WideGamut", {0.274118, 0.873631, -0.147749}},
        {"adobergb", {0.29734, 0.62736, 0.07529}},
        {"Rec.601", {0.299, 0.587, 0.114}},
        {"unknown", {0.2126, 0.7152, 0.0722}},
    };
    for (const auto& [name, row] : rows) {
        const Vec3 found = luminance_weights(name);
        for (std::size_t c = 0; c < 3; ++c)
            check::report(std::abs(found[c] - row[c]) < 6e-5, __FILE__, __LINE__, name);
    }
    for (const Known& space : kKnown) {
        const Vec3 w = luminance_weights(space.name);
        check::report(std::abs(w[0] + w[1] + w[2] - 1) < 1e-12, __FILE__, __LINE__, space.name);
    }
}
