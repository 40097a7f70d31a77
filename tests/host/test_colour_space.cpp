// A palette in another colour space than the picture: the node goes there and back.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "harness.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

namespace {

struct ConvertingNode : Ready {
    explicit ConvertingNode(bool edited = true)
        : Ready(write("light.p4d.json", with_conversion(sidecar_text(edited)))) {}
};

Layout layout_of(Depth depth, int channels, const char* premultiplication) {
    Layout layout;
    layout.bounds = rect(-7, 3, 30, 40);
    layout.depth = depth;
    layout.channels = channels;
    layout.premultiplication = premultiplication;
    layout.padding = 8;
    return layout;
}

/// Light from below 0 to far above 1, alpha among it.
Picture light(const Layout& layout) {
    Picture picture(layout, 0x33);
    fill(picture, 5);
    if (layout.depth != Depth::kFloat) return picture;
    for (int y = layout.bounds.y1; y < layout.bounds.y2; ++y) {
        for (int x = layout.bounds.x1; x < layout.bounds.x2; ++x) {
            float* p = picture.floats(x, y);
            for (int c = 0; c < 3; ++c) {
                if (p[c] > 0.2f && p[c] < 10) p[c] = 0.02f * std::exp2(9 * p[c]);
            }
        }
    }
    return picture;
}

}  // namespace

TEST(the_picture_goes_to_the_palettes_space_and_back) {
    ConvertingNode node;
    palette4d::Sidecar plain = node.parsed;
    plain.conversion = nullptr;
    for (const Depth depth : kDepths) {
        for (const int channels : {3, 4}) {
            for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
                if (channels == 3 && alpha == std::string(kOfxImagePreMultiplied)) continue;
                const Layout layout = layout_of(depth, channels, alpha);
                const Picture source = light(layout);
                for (const double strength : {1.0, 0.3}) {
                    node.instance->set("strength", strength);
                    node.instance->set("pictureIn", 0);
                    const auto converted =
                        recoloured(node.parsed, 14, source, layout.bounds, strength);
                    CHECK(node.render(source, 4) == converted);
                    CHECK(converted != source.pixels(layout.bounds));
                    node.instance->set("pictureIn", 1);
                    const auto own = recoloured(plain, 14, source, layout.bounds, strength);
                    CHECK(node.render(source, 4) == own);
                    CHECK(own != converted);
                }
            }
        }
    }
}

TEST(an_unedited_palette_in_another_space_returns_every_bit) {
    ConvertingNode node(false);
    const Layout layout = layout_of(Depth::kFloat, 4, kOfxImagePreMultiplied);
    const Picture source = light(layout);
    CHECK(node.render(source, 4) == source.pixels(layout.bounds));
}

TEST(without_a_conversion_the_choice_changes_nothing) {
    Ready node;
    const Picture source = light(layout_of(Depth::kFloat, 3, kOfxImageOpaque));
    const auto one = node.render(source, 4);
    node.set("pictureIn", 1);
    CHECK(node.render(source, 4) == one);
}

TEST(mattes_and_mix_see_the_palettes_numbers) {
    ConvertingNode node;
    const auto& steps = node.parsed.conversion->steps;
    const Layout layout = layout_of(Depth::kFloat, 3, kOfxImageOpaque);
    const Picture source = light(layout);
    Picture converted(layout);
    for (int y = layout.bounds.y1; y < layout.bounds.y2; ++y) {
        for (int x = layout.bounds.x1; x < layout.bounds.x2; ++x) {
            const float* p = source.floats(x, y);
            const Vec3 own = steps.to_palette({p[0], p[1], p[2]});
            const bool finite = std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
            for (std::size_t c = 0; c < 3; ++c) {
                converted.floats(x, y)[c] = finite ? static_cast<float>(own[c]) : p[c];
            }
        }
    }
    for (const int output : {1, 3}) {  // weight, outside
        node.instance->set("output", output);
        node.instance->set("pictureIn", 0);
        const auto by_input = node.render(source, 4);
        node.instance->set("pictureIn", 1);
        CHECK(node.render(converted, 4) == by_input);
    }
    // Mix is one of the picture's own numbers.
    node.instance->set("output", 0);
    node.instance->set("pictureIn", 0);
    Picture whole(layout), half(layout);
    CHECK(node.instance->render(4, &source, whole, layout.bounds) == kOfxStatOK);
    node.instance->set("mix", 0.5);
    CHECK(node.instance->render(4, &source, half, layout.bounds) == kOfxStatOK);
    const float *from = source.floats(10, 20), *to = whole.floats(10, 20);
    for (std::size_t c = 0; c < 3; ++c) {
        const double middle = (static_cast<double>(from[c]) + to[c]) / 2;
        CHECK(std::abs(half.floats(10, 20)[c] - middle) <= 1e-6 * std::max(1.0, middle));
    }
}

TEST(the_palette_at_the_foot_has_the_pictures_numbers) {
    ConvertingNode node;
    node.instance->set("output", 2);
    Layout layout;
    layout.bounds = rect(0, 0, 64, 48);  // eight colours of 8 by 6
    const Picture source = light(layout);
    Picture output(layout);
    CHECK(node.instance->render(5, &source, output, layout.bounds) == kOfxStatOK);
    const palette4d::Slice slice = palette4d::slice_at(node.parsed.polytope, 15);
    for (std::size_t i = 0; i < slice.rgb.size(); ++i) {
        const Vec3 shown = node.parsed.conversion->steps.to_clip(slice.rgb[i]);
        const float* found = output.floats(static_cast<int>(i) * 8 + 3, 4);
        for (std::size_t c = 0; c < 3; ++c) CHECK(found[c] == static_cast<float>(shown[c]));
    }
}

TEST(the_status_names_both_spaces) {
    ConvertingNode node;
    CHECK(node.instance->changed("sidecar") == kOfxStatOK);
    EXPECT(node.says("the picture in ACEScg; the palette is in ACEScct"),
           node.instance->text("status"));
}

TEST(a_host_that_negotiates_colour_is_asked_for_what_the_picture_is_to_be_in) {
    constexpr const char* kWanted = "OfxImageClipPropPreferredColourspaces_Source";
    ConvertingNode node;
    node.instance->effect().properties.put(kOfxImageEffectPropColourManagementStyle,
                                           std::string(kOfxImageEffectColourManagementFull));
    for (const bool palette : {false, true}) {
        node.instance->set("pictureIn", palette ? 1 : 0);
        OfxPropertySetStruct out(kOutArgs);
        CHECK(node.instance->clip_preferences(out) == kOfxStatOK);
        CHECK(out.text(kWanted, 0) == (palette ? "ACEScct" : "ACEScg"));
    }
}
