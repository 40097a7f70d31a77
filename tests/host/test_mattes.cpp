// Which handle's weight a matte shows, and what a matte in alpha asks of the host. Its pixels:
// test_outputs.cpp.
#include "harness.hpp"

using namespace strict;
using namespace test;

TEST(a_slots_id_is_the_weights_handle_and_a_missing_one_is_said) {
    Ready node;
    node.set("output", 1);
    const Layout layout;
    Picture source(layout), by_place(layout), by_id(layout);
    fill(source);
    node.set("weightOf", 7);
    CHECK(node.instance->render(2, &source, by_place, layout.bounds) == kOfxStatOK);
    node.set("weightOf", 31);
    node.set("handle31Id", std::string("v6"));
    CHECK(node.instance->render(2, &source, by_id, layout.bounds) == kOfxStatOK);
    CHECK(by_id.storage() == by_place.storage());
    for (const int slot : {18, 33, 100000, 0, -4}) {
        node.set("weightOf", slot);
        CHECK(node.render(source, 2) == source.pixels(layout.bounds));
        const std::string said = node.instance->effect().persistent_message;
        EXPECT(said.find("expected one of its 17") != std::string::npos, said);
    }
}

TEST(a_matte_in_alpha_asks_for_an_alpha_that_counts) {
    Ready node;
    const auto preferred = [&](const char* components, const char* alpha, int output, int in) {
        auto& source = node.instance->effect().clips.at("Source")->properties;
        source.put(kOfxImageEffectPropComponents, std::string(components));
        source.put(kOfxImageEffectPropPreMultiplication, std::string(alpha));
        // Told each time: that the answer changes for any other reason would be a fault.
        for (const auto& [param, value] : {std::pair{"output", output}, {"matteIn", in}}) {
            node.set(param, value);
            CHECK(node.instance->changed(param) == kOfxStatOK);
        }
        OfxPropertySetStruct out(kOutArgs);
        CHECK(node.instance->clip_preferences(out) == kOfxStatOK);
        CHECK(out.text("OfxImageClipPropComponents_Source") ==
              out.text("OfxImageClipPropComponents_Output"));
        return std::pair(out.text("OfxImageClipPropComponents_Output"),
                         out.text(kOfxImageEffectPropPreMultiplication));
    };
    const char* const rgb = kOfxImageComponentRGB;
    const char* const rgba = kOfxImageComponentRGBA;
    const char* const lone = kOfxImageComponentAlpha;
    using Answer = std::pair<std::string, std::string>;
    for (const int matte : {1, 3}) {
        CHECK(preferred(rgb, kOfxImageOpaque, matte, 1) == Answer(rgba, kOfxImageUnPreMultiplied));
        CHECK(preferred(rgba, kOfxImageOpaque, matte, 1) == Answer(rgba, kOfxImageUnPreMultiplied));
        CHECK(preferred(rgba, kOfxImagePreMultiplied, matte, 1) ==
              Answer(rgba, kOfxImagePreMultiplied));
        CHECK(preferred(rgb, kOfxImageOpaque, matte, 0) == Answer(rgb, kOfxImageOpaque));
        CHECK(preferred(lone, kOfxImageUnPreMultiplied, matte, 1) ==
              Answer(lone, kOfxImageUnPreMultiplied));
    }
    for (const int picture : {0, 2}) {
        CHECK(preferred(rgb, kOfxImageOpaque, picture, 1) == Answer(rgb, kOfxImageOpaque));
    }
}
