// What the node puts out besides the recoloured picture: mattes, the palette at the picture's foot,
// kept lightness, a mix with the source. tests/core/output/test_drawing.cpp has what they are;
// these tests have depths, layouts, tiles and parameters.
#include <cmath>
#include <limits>

#include "convert/colour_spaces.hpp"
#include "harness.hpp"
#include "model/lineage.hpp"

using namespace strict;
using namespace test;
using palette4d::DrawingOptions;
using palette4d::Output;

namespace {

/// What the core draws of the sidecar at a frame; a matte of the weight is of handle 8, v7.
palette4d::Drawing drawing_of(const palette4d::Sidecar& sidecar, double frame,
                              const DrawingOptions& options) {
    const palette4d::Slice slice = palette4d::slice_at(sidecar.polytope, frame);
    palette4d::Drawing drawing;
    drawing.options = options;
    drawing.original = slice.rgb;
    drawing.edited = palette4d::edited_colours(sidecar.polytope, sidecar.edits, slice);
    if (!options.is_matte()) {
        drawing.edit =
            std::make_shared<const palette4d::Recolourer>(slice.rgb, drawing.edited, slice.faces);
        return drawing;
    }
    const auto reader = options.output == Output::kOutside
                            ? palette4d::surface_reader(slice)
                            : palette4d::weight_reader(
                                  slice, palette4d::Lineage(sidecar.polytope, sidecar.edits, 7));
    drawing.reader = std::make_shared<const palette4d::Recolourer>(slice.rgb, reader, slice.faces);
    return drawing;
}

}  // namespace

TEST(every_output_is_the_cores_in_every_layout) {
    struct Case {
        DrawingOptions options;
        std::vector<std::pair<const char*, Value>> parameters;
    };
    std::vector<Case> cases;
    const auto add = [&](std::vector<std::pair<const char*, Value>> parameters) {
        cases.push_back({{}, std::move(parameters)});
        return &cases.back().options;
    };
    const char* const spaces[] = {"Rec.709", "Rec.2020", "P3-D65", "ACEScg", "Rec.601"};
    for (int space = 0; space < 5; ++space) {
        DrawingOptions* kept = add({{"keepLightness", 0.7}, {"lightnessOf", 1 + space}});
        kept->keep = 0.7;
        kept->lightness = palette4d::luminance_weights(spaces[space]);
    }
    for (const int alpha : {0, 1}) {
        for (const double mix : {1.0, 0.5}) {
            for (const auto output : {Output::kWeight, Output::kPalette, Output::kOutside}) {
                DrawingOptions* options = add({{"output", static_cast<int>(output)},
                                               {"weightOf", 8},
                                               {"outsideReach", 0.4},
                                               {"matteIn", alpha},
                                               {"mix", mix}});
                options->output = output;
                options->in_alpha = alpha;
                options->reach = 0.4;
                options->mix = mix;
            }
        }
    }
    add({{"mix", 0.5}})->mix = 0.5;
    Ready node;
    for (const Layout& layout : layouts()) {
        const OfxRectI& b = layout.bounds;
        const Picture source = source_of(layout);
        for (const Case& one : cases) {
            node.instance = node.plugin.create();
            node.set("sidecar", node.path);
            for (const auto& [name, value] : one.parameters) node.set(name, value);
            Picture seen = source, tiled(layout);
            // Of an opaque picture alpha is 1, whatever stands in it.
            const bool opaque = layout.channels == 4 &&
                                layout.premultiplication == std::string(kOfxImageOpaque) &&
                                one.options.is_matte() && one.options.in_alpha;
            for (int y = b.y1; opaque && y < b.y2; ++y) {
                for (int x = b.x1; x < b.x2; ++x) {
                    const auto full = stored(layout, {1.0f});
                    std::copy(full.begin(), full.end(), seen.at(x, y) + 3 * layout.number_bytes());
                }
            }
            for (int y = b.y1; y < b.y2; y += 11) {
                for (int x = b.x1; x < b.x2; x += 23) {
                    const OfxRectI tile =
                        rect(x, y, std::min(x + 23, b.x2), std::min(y + 11, b.y2));
                    CHECK(node.instance->render(4, &source, tiled, tile) == kOfxStatOK);
                }
            }
            const auto found = tiled.pixels(b);
            EXPECT(found == drawn(drawing_of(node.parsed, 14, one.options), seen, b),
                   "case " + std::to_string(&one - cases.data()) + " in a layout of depth " +
                       std::to_string(static_cast<int>(layout.depth)) + ", " +
                       std::to_string(layout.channels) + " channels, " + layout.premultiplication);
            CHECK(found != source.pixels(b));
        }
    }
}

TEST(a_lut_gets_no_palette_at_its_foot) {
    Shown node;
    node.set("output", 2);
    CHECK(node.render(5) != node.edited(15));
    // A host that wants colours alone.
    node.instance->extra_arguments["OfxImageEffectPropNoSpatialAwareness"] = std::string("true");
    CHECK(node.render(5) == node.edited(15));
}

TEST(the_palette_of_an_unedited_sidecar_is_shown_too) {
    Ready node;
    node.set("sidecar", sidecar("plain.p4d.json", false));
    node.set("output", 2);
    std::string clip;
    double time = 0;
    CHECK(node.instance->is_identity(3, clip, time) == kOfxStatReplyDefault);
    Layout layout;
    layout.bounds = rect(0, 0, 64, 48);
    Picture source(layout), output(layout);
    fill(source);
    CHECK(node.instance->render(3, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(rect(0, 6, 64, 48)) == source.pixels(rect(0, 6, 64, 48)));
    CHECK(output.pixels(rect(0, 0, 64, 6)) != source.pixels(rect(0, 0, 64, 6)));
    // For a LUT there is nothing to do.
    node.instance->extra_arguments["OfxImageEffectPropNoSpatialAwareness"] = std::string("true");
    CHECK(node.render(source, 3) == source.pixels(layout.bounds));
}

TEST(lightness_is_that_of_the_pictures_own_space) {
    Ready node;
    node.set("keepLightness", 1.0);
    const Layout layout;
    const Picture source = source_of(layout);
    const auto rendered = [&](int lightness_of) {
        Picture output(layout);
        node.set("lightnessOf", lightness_of);
        CHECK(node.instance->render(4, &source, output, layout.bounds) == kOfxStatOK);
        return floats(layout, output.pixels(layout.bounds));
    };
    const std::pair<const char*, int> spaces[] = {
        {"linear", 1}, {"Rec.2020", 2}, {"P3-D65", 3}, {"ACEScct", 4}, {"my own", 1}};
    for (const auto& [encoding, choice] : spaces) {
        std::string text = sidecar_text();
        const std::string old = R"("encoding": "linear")";
        text.replace(text.find(old), old.size(), R"("encoding": ")" + std::string(encoding) + "\"");
        node.set("sidecar", write(std::string(encoding) + ".p4d.json", text));
        const auto by_itself = rendered(0), chosen = rendered(choice), other = rendered(5);
        double off = 0, differs = 0;
        for (std::size_t i = 0; i < by_itself.size(); ++i) {
            if (!std::isfinite(by_itself[i]) || std::abs(by_itself[i]) > 10) continue;
            off = std::max<double>(off, std::abs(by_itself[i] - chosen[i]));
            differs = std::max<double>(differs, std::abs(by_itself[i] - other[i]));
        }
        EXPECT(off == 0 && differs > 1e-3, encoding);
    }
}

TEST(an_alpha_clip_passes) {
    Ready node;
    for (const int output : {0, 1, 2, 3}) {
        node.set("output", output);
        for (const Depth depth : kDepths) {
            Layout layout;
            layout.channels = 1;
            layout.depth = depth;
            Picture source(layout), result(layout);
            fill(source);
            CHECK(node.instance->render(4, &source, result, layout.bounds) == kOfxStatOK);
            CHECK(result.pixels(layout.bounds) == source.pixels(layout.bounds));
        }
    }
}

TEST(settings_out_of_their_ranges_are_brought_in) {
    Shown node;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto plain = node.render();
    for (const char* name : {"strength", "mix"}) {
        for (const double value : {7.0, nan}) {
            node.set(name, value);
            CHECK(node.render() == plain);
        }
        node.set(name, -3.0);
        CHECK(node.render() == node.unchanged());
        node.set(name, 1.0);
    }
    for (const double value : {-1.0, nan}) {
        node.set("keepLightness", value);
        CHECK(node.render() == plain);
    }
    node.set("keepLightness", 0.0);
    for (const int value : {-1, 99}) {
        node.set("output", value);
        node.set("lightnessOf", value);
        node.set("matteIn", value);
        CHECK(node.render() == plain);
    }
}
