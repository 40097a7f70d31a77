// What the node puts out besides the recoloured picture and mattes: the palette at its foot, kept
// lightness, a mix with the source; and what holds of all outputs.
#include <cmath>
#include <cstring>
#include <limits>

#include "harness.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

TEST(the_palette_stands_at_the_pictures_foot) {
    Ready node;
    Layout layout;
    layout.bounds = rect(-4, 10, 60, 58);  // 64 by 48: eight colours of 8 by 6
    for (const bool tiles : {false, true}) {
        Picture source(layout), recoloured(layout), output(layout);
        fill(source);
        node.set("output", 0);
        CHECK(node.instance->render(5, &source, recoloured, layout.bounds) == kOfxStatOK);
        node.set("output", 2);
        const int step = tiles ? 7 : 1000;
        for (int y = 10; y < 58; y += step) {
            for (int x = -4; x < 60; x += step) {
                CHECK(node.instance->render(5, &source, output,
                                            rect(x, y, std::min(x + step, 60),
                                                 std::min(y + step, 58))) == kOfxStatOK);
            }
        }
        const OfxRectI above = rect(-4, 16, 60, 58);
        CHECK(output.pixels(above) == recoloured.pixels(above));
        const palette4d::Slice slice = palette4d::slice_at(node.parsed.polytope, 15);
        const std::vector<Vec3> edited =
            palette4d::edited_colours(node.parsed.polytope, node.parsed.edits, slice);
        CHECK(edited != slice.rgb);
        for (int y = 10; y < 16; ++y) {
            for (int x = -4; x < 60; ++x) {
                const auto i = static_cast<std::size_t>((x + 4) / 8);
                const Vec3& colour = (y < 13 ? edited : slice.rgb)[i];
                const float* found = output.floats(x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    CHECK(found[c] == static_cast<float>(colour[c]));
                }
                CHECK(found[3] == 1);
            }
        }
        // A host that wants colours alone, for a LUT, gets no strip.
        node.instance->extra_arguments["OfxImageEffectPropNoSpatialAwareness"] =
            std::string("true");
        CHECK(node.instance->render(5, &source, output, layout.bounds) == kOfxStatOK);
        CHECK(output.pixels(layout.bounds) == recoloured.pixels(layout.bounds));
        node.instance->extra_arguments.clear();
    }
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
    CHECK(node.instance->render(3, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(layout.bounds) == source.pixels(layout.bounds));
}

TEST(lightness_is_kept) {
    Ready node;
    const double weights[][3] = {{0.2126390059, 0.7151686788, 0.0721923154},
                                 {0.2627002120, 0.6779980715, 0.0593017165},
                                 {0.2289745641, 0.6917385218, 0.0792869141},
                                 {0.2722287168, 0.6740817658, 0.0536895174},
                                 {0.299, 0.587, 0.114}};
    for (int space = 0; space < 5; ++space) {
        const auto& w = weights[space];
        CHECK(std::abs(w[0] + w[1] + w[2] - 1) < 1e-9);
        for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
            for (const double keep : {1.0, 0.25}) {
                Layout layout;
                layout.premultiplication = alpha;
                const Picture source = source_of(layout);
                Picture plain(layout), kept(layout);
                node.set("keepLightness", 0.0);
                CHECK(node.instance->render(4, &source, plain, layout.bounds) == kOfxStatOK);
                node.set("lightnessOf", 1 + space);
                node.set("keepLightness", keep);
                CHECK(node.instance->render(4, &source, kept, layout.bounds) == kOfxStatOK);
                const auto in = floats(layout, source.pixels(layout.bounds));
                const auto moved = floats(layout, plain.pixels(layout.bounds));
                const auto out = floats(layout, kept.pixels(layout.bounds));
                int changed = 0;
                for (std::size_t i = 0; i < in.size(); i += 4) {
                    CHECK(std::memcmp(&out[i + 3], &in[i + 3], 4) == 0);
                    if (std::memcmp(&in[i], &moved[i], 12) == 0) {
                        CHECK(std::memcmp(&in[i], &out[i], 12) == 0);
                        continue;
                    }
                    double y_in = 0, y_moved = 0, y_out = 0, size = 1;
                    for (std::size_t c = 0; c < 3; ++c) {
                        y_in += w[c] * in[i + c];
                        y_moved += w[c] * moved[i + c];
                        y_out += w[c] * out[i + c];
                        size = std::max(size, static_cast<double>(std::abs(in[i + c])));
                    }
                    const double expected = y_moved + keep * (y_in - y_moved);
                    CHECK(std::abs(y_out - expected) <= 1e-6 * size);
                    changed += std::abs(y_in - y_moved) > 1e-3;
                    // Differences between the channels are the edit's.
                    CHECK(std::abs((out[i] - out[i + 1]) - (moved[i] - moved[i + 1])) <=
                          1e-6 * size);
                }
                CHECK(changed > 20);
            }
        }
    }
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

TEST(mix_goes_from_the_source_to_what_is_put_out) {
    Ready node;
    for (const int output : {0, 1, 3}) {
        node.set("output", output);
        for (const Layout& layout : layouts()) {
            const Picture source = source_of(layout);
            Picture whole(layout), half(layout), none(layout);
            node.set("mix", 1.0);
            CHECK(node.instance->render(4, &source, whole, layout.bounds) == kOfxStatOK);
            node.set("mix", 0.5);
            CHECK(node.instance->render(4, &source, half, layout.bounds) == kOfxStatOK);
            node.set("mix", 0.0);
            CHECK(node.instance->render(4, &source, none, layout.bounds) == kOfxStatOK);
            CHECK(none.pixels(layout.bounds) == source.pixels(layout.bounds));
            std::string clip;
            double time = 0;
            CHECK(node.instance->is_identity(4, clip, time) == kOfxStatOK);
            const auto in = floats(layout, source.pixels(layout.bounds));
            const auto all = floats(layout, whole.pixels(layout.bounds));
            const auto mixed = floats(layout, half.pixels(layout.bounds));
            const double step = 2 * rounding(layout.depth) + 1e-6;
            for (std::size_t i = 0; i < in.size(); ++i) {
                if (!std::isfinite(in[i]) || !std::isfinite(all[i])) continue;
                // Integers do not tell what lies beyond them.
                const bool integers = layout.depth == Depth::kByte || layout.depth == Depth::kShort;
                if (integers && (all[i] == 0 || all[i] == 1)) continue;
                const double expected = (static_cast<double>(in[i]) + all[i]) / 2;
                EXPECT(std::abs(mixed[i] - expected) <= step * std::max(1.0, std::abs(expected)),
                       "found " + std::to_string(mixed[i]) + ", expected " +
                           std::to_string(expected) + " between " + std::to_string(in[i]) +
                           " and " + std::to_string(all[i]));
            }
        }
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

TEST(outputs_keep_their_bits_in_tiles_threads_and_repetition) {
    Ready node;
    Layout layout;
    layout.bounds = rect(0, 0, 70, 90);
    Picture source(layout);
    fill(source);
    node.set("keepLightness", 0.7);
    node.set("mix", 0.8);
    for (const int output : {0, 1, 2, 3}) {
        node.set("output", output);
        Picture whole(layout), tiled(layout);
        CHECK(node.instance->render(4.5, &source, whole, layout.bounds) == kOfxStatOK);
        for (int y = 0; y < 90; y += 11) {
            for (int x = 0; x < 70; x += 23) {
                const OfxRectI tile = rect(x, y, std::min(x + 23, 70), std::min(y + 11, 90));
                CHECK(node.instance->render(4.5, &source, tiled, tile) == kOfxStatOK);
            }
        }
        CHECK(whole.pixels(layout.bounds) == tiled.pixels(layout.bounds));
    }
}

TEST(settings_out_of_their_ranges_are_brought_in) {
    Ready node;
    const Layout layout;
    Picture source(layout);
    fill(source);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto render = [&] {
        Picture output(layout);
        CHECK(node.instance->render(4, &source, output, layout.bounds) == kOfxStatOK);
        return output.pixels(layout.bounds);
    };
    const auto plain = render();
    for (const char* name : {"strength", "mix"}) {
        for (const double value : {7.0, nan}) {
            node.set(name, value);
            CHECK(render() == plain);
        }
        node.set(name, -3.0);
        CHECK(render() == source.pixels(layout.bounds));
        node.set(name, 1.0);
    }
    for (const double value : {-1.0, nan}) {
        node.set("keepLightness", value);
        CHECK(render() == plain);
    }
    node.set("keepLightness", 0.0);
    for (const int value : {-1, 99}) {
        node.set("output", value);
        node.set("lightnessOf", value);
        node.set("matteIn", value);
        CHECK(render() == plain);
    }
}
