#include "colour_management.hpp"

#include <string>
#include <vector>

#include "convert/colour_spaces.hpp"
#include "output_params.hpp"
#include "sidecar_choice.hpp"

namespace palette4d::node {
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
    const Chosen chosen = chosen_sidecar(params);
    if (!chosen.result.loaded) return;
    const Sidecar& sidecar = chosen.result.loaded->sidecar();
    const bool in_palette_space = params.int_at(kParamPictureIn, Params::kAnyTime).value_or(0) == 1;
    const bool linear = linear_picture(params, sidecar, Params::kAnyTime) != nullptr;
    const std::vector<std::string> wanted =
        colourspaces_of(linear ? "scene_linear" : encoding_of(sidecar, in_palette_space),
                        *style == kOfxImageEffectColourManagementCore);
    const std::string name = std::string(kOfxImageClipPropPreferredColourspaces) + "_" +
                             kOfxImageEffectSimpleSourceClipName;
    // The basic style knows only the generic spaces, which come last.
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

}  // namespace palette4d::node
