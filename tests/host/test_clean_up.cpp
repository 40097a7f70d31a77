// The clean-up of picks and their mattes in the node: tiles, regions of interest, depths and alpha,
// LUTs; against the core's whole pictures.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "harness.hpp"
#include "output/clean_up.hpp"
#include "tiles.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

namespace {

struct Picked : Ready {
    explicit Picked(bool moves = false)
        : Ready(test::write("picked.p4d.json", text_with_picks(moves))) {}
    palette4d::Drawing matte(const std::string& id, double frame = 12) const {
        const palette4d::Slice slice = palette4d::slice_at(parsed.polytope, frame);
        palette4d::Drawing drawing;
        drawing.options.output = palette4d::Output::kPick;
        drawing.reader = std::make_shared<const palette4d::Recolourer>(
            slice.rgb, slice.rgb, slice.faces, palette4d::matte_at(parsed.edits, id, frame));
        return drawing;
    }
};

Layout large(const OfxRectI& bounds, Depth depth = Depth::kFloat) {
    Layout layout;
    layout.bounds = bounds;
    layout.depth = depth;
    return layout;
}

/// Areas of the picked colours, and noise.
Picture scene_of(const Layout& layout) {
    Picture noise(layout), picture(layout);
    fill(noise, 7);
    const std::vector<float> odd = floats(layout, noise.pixels(layout.bounds));
    std::vector<float> values = odd;
    const auto channels = static_cast<std::size_t>(layout.channels);
    for (std::size_t i = 0; i < values.size() / channels; ++i) {
        const auto width = static_cast<std::size_t>(layout.width());
        const std::size_t area = (i % width / 19 + i / width / 23) % 3;
        const float colours[3][3] = {{0.7f, 0.3f, 0.25f}, {0.3f, 0.5f, 0.3f}, {0.2f, 0.3f, 0.7f}};
        float* const pixel = &values[i * channels];
        const bool premultiplied = layout.premultiplication == std::string(kOfxImagePreMultiplied);
        for (std::size_t c = 0; c < 3; ++c) {
            const float own = pixel[c];
            if (!std::isfinite(own) || std::abs(own) > 2) continue;
            pixel[c] = colours[area][c] + 0.1f * own;
            if (channels == 4 && premultiplied) pixel[c] *= pixel[3];
        }
    }
    const std::vector<unsigned char> bytes = stored(layout, values);
    const std::size_t row = static_cast<std::size_t>(layout.width() * layout.pixel_bytes());
    for (int y = 0; y < layout.height(); ++y) {
        std::memcpy(picture.at(layout.bounds.x1, layout.bounds.y1 + y),
                    &bytes[static_cast<std::size_t>(y) * row], row);
    }
    return picture;
}

}  // namespace

TEST(picks_are_cleaned_up_as_in_a_file) {
    for (const bool moves : {false, true}) {
        Picked node(moves);
        for (Layout layout : layouts()) {
            layout.bounds = rect(-9, 4, 78, 60);
            const Picture source = scene_of(layout);
            const std::vector<unsigned char> cleaned = node.render(source, 2);
            CHECK(cleaned == recoloured(node.parsed, 12, source, layout.bounds));
            for (const double amount : {0.0, 0.5}) {
                node.set("cleanUp", amount);
                const auto found = node.render(source, 2);
                CHECK(found == recoloured(node.parsed, 12, source, layout.bounds, 1, amount));
                CHECK(found != cleaned);
            }
            node.set("cleanUp", 1.0);
        }
    }
}

TEST(rows_of_floats_at_any_byte_are_cleaned_up) {
    Picked node;
    const Picture source = scene_of(large(rect(-9, 4, 78, 60)));
    const std::vector<unsigned char> expected = node.render(source, 2);
    Layout layout = source.layout();
    layout.padding = 2;
    Picture odd(layout), output(layout);
    const OfxRectI& bounds = layout.bounds;
    for (int y = bounds.y1; y < bounds.y2; ++y) {
        std::memcpy(odd.at(bounds.x1, y), source.at(bounds.x1, y),
                    static_cast<std::size_t>(layout.width() * layout.pixel_bytes()));
    }
    CHECK(node.instance->render(2, &odd, output, bounds) == kOfxStatOK);
    CHECK(output.pixels(bounds) == expected);
}

/// A part of a picture as a picture of its own.
Picture cropped(const Picture& from, const OfxRectI& bounds, double scale) {
    Layout layout = from.layout();
    layout.bounds = bounds;
    layout.scale = scale;
    Picture part(layout);
    for (int y = bounds.y1; y < bounds.y2; ++y) {
        std::memcpy(part.at(bounds.x1, y), from.at(bounds.x1, y),
                    static_cast<std::size_t>(layout.width() * layout.pixel_bytes()));
    }
    return part;
}

TEST(windows_lie_in_the_project_where_it_alone_has_the_clips_size) {
    for (const double scale : {1.0, 0.5}) {
        Picked node;
        node.set("cleanUp", 0.0);
        auto& properties = node.instance->effect().properties;
        const OfxRectI clip = scale == 1 ? rect(3, -2, 67, 46) : rect(2, -1, 34, 23);
        const Picture all = scene_of(large(rect(-10, -9, 90, 80)));
        const Picture part = cropped(all, clip, scale);
        Picture reference(part.layout());
        CHECK(node.instance->render(2, &part, reference, clip) == kOfxStatOK);
        properties.put_all(kOfxImageEffectPropProjectSize, {128.0, 48.0});
        properties.put_all(kOfxImageEffectPropProjectOffset,
                           {2 * clip.x1 / scale, clip.y1 / scale});
        properties.put(kOfxImageEffectPropProjectPixelAspectRatio, 2.0);
        // Overscan, and an element in its bounding box.
        for (const OfxRectI& bounds : {rect(-10, -9, 90, 80), rect(5, 1, 30, 20)}) {
            const Picture source = cropped(all, bounds, scale);
            Picture drawn(source.layout());
            CHECK(node.instance->render(2, &source, drawn, bounds) == kOfxStatOK);
            const OfxRectI both = {std::max(bounds.x1, clip.x1), std::max(bounds.y1, clip.y1),
                                   std::min(bounds.x2, clip.x2), std::min(bounds.y2, clip.y2)};
            CHECK(drawn.pixels(both) == reference.pixels(both));
            // A project of another size says nothing.
            properties.put_all(kOfxImageEffectPropProjectSize, {1920.0, 1080.0});
            CHECK(node.instance->render(2, &source, drawn, bounds) == kOfxStatOK);
            CHECK(drawn.pixels(both) != reference.pixels(both));
            properties.put_all(kOfxImageEffectPropProjectSize, {128.0, 48.0});
        }
    }
}

TEST(windows_lie_in_a_proxy_of_the_clip_in_a_project_of_its_size) {
    Picked node;
    node.set("cleanUp", 0.0);
    const OfxRectI half = rect(0, 0, 32, 24);
    const Picture source = cropped(scene_of(large(rect(-10, -9, 90, 80))), half, 1);
    Picture reference(source.layout()), drawn(source.layout());
    CHECK(node.instance->render(2, &source, reference, half) == kOfxStatOK);
    auto& properties = node.instance->effect().properties;
    properties.put_all(kOfxImageEffectPropProjectSize, {64.0, 48.0});
    properties.put_all(kOfxImageEffectPropProjectOffset, {0.0, 0.0});
    properties.put(kOfxImageEffectPropProjectPixelAspectRatio, 1.0);
    CHECK(node.instance->render(2, &source, drawn, half) == kOfxStatOK);
    CHECK(drawn.pixels(half) == reference.pixels(half));
}

TEST(tiles_with_their_region_of_interest_are_the_whole_picture) {
    for (const bool moves : {false, true}) {
        Picked node(moves);
        for (const Depth depth : {Depth::kFloat, Depth::kByte}) {
            const Layout layout = large(rect(-30, 11, 133, 94), depth);
            const Picture source = scene_of(layout);
            for (const int output : {0, 4}) {
                node.set("output", output);
                const auto whole = node.render(source, 2);
                Picture tiles(layout);
                each_tile(layout.bounds, [&](const OfxRectI& window, std::array<double, 4> region) {
                    CHECK(node.instance->region_of_interest(2, 1, region) == kOfxStatOK);
                    const Picture part = part_of(source, within(region, layout.bounds));
                    CHECK(node.instance->render(2, &part, tiles, window) == kOfxStatOK);
                });
                CHECK(tiles.pixels(layout.bounds) == whole);
            }
        }
    }
}

TEST(the_region_of_interest_is_what_the_filter_sees) {
    Picked node;
    const int support =
        palette4d::clean_up_support(palette4d::clean_up_cell(1, node.parsed.edits.height));
    const Layout layout = large(rect(0, 0, 200, 200));
    const Picture source = scene_of(layout);
    const auto whole = node.render(source, 2);
    // What lies beyond changes nothing.
    Picture other = source;
    const OfxRectI window = rect(80, 83, 99, 90);
    const OfxRectI seen =
        rect(window.x1 - support, window.y1 - support, window.x2 + support, window.y2 + support);
    for (int y = 0; y < 200; ++y) {
        for (int x = 0; x < 200; ++x) {
            if (x >= seen.x1 && x < seen.x2 && y >= seen.y1 && y < seen.y2) continue;
            const float strange[4] = {0.8f, 0.2f, 0.2f, 1};
            std::memcpy(other.at(x, y), strange, sizeof strange);
        }
    }
    Picture first(layout), second(layout);
    CHECK(node.instance->render(2, &source, first, window) == kOfxStatOK);
    CHECK(node.instance->render(2, &other, second, window) == kOfxStatOK);
    CHECK(first.pixels(window) == second.pixels(window));
    // A host that ignores the region: no crash, and a picture.
    const Picture part = part_of(source, window);
    CHECK(node.instance->render(2, &part, first, window) == kOfxStatOK);

    const auto region_at = [&](double scale, OfxStatus expected) {
        std::array<double, 4> region = {10, 20, 30, 40};
        CHECK(node.instance->region_of_interest(2, scale, region) == expected);
        return region;
    };
    const std::array<double, 4> same = {10, 20, 30, 40};
    const std::array<double, 4> more = {10.0 - support, 20.0 - support, 30.0 + support,
                                        40.0 + support};
    CHECK(region_at(1, kOfxStatOK) == more);
    // At half size the cells are half as large: the same region of the full picture.
    CHECK(region_at(0.5, kOfxStatOK) == more);
    node.set("cleanUp", 0.0);
    CHECK(region_at(1, kOfxStatReplyDefault) == same);
    node.set("cleanUp", 1.0);
    node.set("output", 1);  // the weight of a handle has no picks
    CHECK(region_at(1, kOfxStatReplyDefault) == same);
    node.set("output", 0);
    node.set("sidecar", sidecar());
    CHECK(region_at(1, kOfxStatReplyDefault) == same);
}

TEST(a_lut_is_not_cleaned_up) {
    Picked node;
    const Picture source = scene_of(large(rect(0, 0, 64, 48)));
    const auto cleaned = node.render(source, 2);
    node.set("cleanUp", 0.0);
    const auto plain = node.render(source, 2);
    CHECK(cleaned != plain);
    node.set("cleanUp", 1.0);
    node.instance->extra_arguments["OfxImageEffectPropNoSpatialAwareness"] = std::string("true");
    CHECK(node.render(source, 2) == plain);
}

TEST(colours_far_from_picked_ones_keep_their_bits) {
    Picked node;
    const Layout layout = large(rect(0, 0, 160, 64));
    Picture source(layout);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 160; ++x) {
            const float red[4] = {0.75f, 0.25f, 0.25f, 1};
            const float green[4] = {0.25f, 0.6f + 0.01f * static_cast<float>(x * y % 7), -0.0f, 1};
            std::memcpy(source.at(x, y), x < 80 ? red : green, sizeof red);
        }
    }
    Picture output(layout);
    const int support =
        palette4d::clean_up_support(palette4d::clean_up_cell(1, node.parsed.edits.height));
    CHECK(node.instance->render(2, &source, output, layout.bounds) == kOfxStatOK);
    const OfxRectI near = rect(0, 0, 80, 64), far = rect(80 + support, 0, 160, 64);
    CHECK(output.pixels(near) != source.pixels(near));
    CHECK(output.pixels(far) == source.pixels(far));
}

TEST(the_matte_of_a_pick) {
    Picked node;
    node.set("output", 4);
    for (const int number : {1, 3, 4}) {
        node.set("pick", number);
        for (Layout layout : layouts()) {
            layout.bounds = rect(-9, 4, 50, 40);
            const Picture source = scene_of(layout);
            const palette4d::Drawing drawing = node.matte("p" + std::to_string(number));
            CHECK(node.render(source, 2) == drawn(drawing, source, layout.bounds));
        }
    }
    // White at a picked colour, black far away.
    const Layout layout = large(rect(0, 0, 64, 64));
    for (const bool picked : {true, false}) {
        Picture source(layout);
        node.set("pick", 1);
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                const float colour[4] = {picked ? 0.75f : 0.25f, picked ? 0.25f : 0.75f, 0.25f, 1};
                std::memcpy(source.at(x, y), colour, sizeof colour);
            }
        }
        Picture output(layout);
        CHECK(node.instance->render(2, &source, output, layout.bounds) == kOfxStatOK);
        for (int c = 0; c < 3; ++c) {
            CHECK(std::abs(output.floats(30, 30)[c] - (picked ? 1.0f : 0.0f)) < 1e-5f);
        }
    }
}

TEST(a_pick_that_is_not_there_is_said) {
    Picked node;
    node.set("output", 4);
    node.set("pick", 2);
    const Picture source = scene_of(large(rect(0, 0, 16, 16)));
    CHECK(node.render(source, 2) == source.pixels(source.layout().bounds));
    const std::string& message = node.instance->effect().persistent_message;
    EXPECT(message ==
               "Matte of a pick: the sidecar has no pick p2, expected one of p1, p3, p4; "
               "choose another number as Pick",
           message);
}

TEST(premultiplied_pictures_are_cleaned_up_by_their_straight_colours) {
    Picked node;
    Layout layout = large(rect(0, 0, 90, 70));
    Picture straight = scene_of(layout), premultiplied(layout);
    for (int y = 0; y < 70; ++y) {
        for (int x = 0; x < 90; ++x) {
            float* const from = straight.floats(x, y);
            for (int c = 0; c < 3; ++c) {
                if (!std::isfinite(from[c]) || std::abs(from[c]) > 2) from[c] = 0.5f;
            }
            from[3] = 0.25f + 0.5f * static_cast<float>((x + y) % 2);  // exact products
            float* const to = premultiplied.floats(x, y);
            for (int c = 0; c < 3; ++c) to[c] = from[c] * from[3];
            to[3] = from[3];
        }
    }
    Picture first(layout);
    CHECK(node.instance->render(2, &straight, first, layout.bounds) == kOfxStatOK);
    layout.premultiplication = kOfxImagePreMultiplied;
    Picture given(layout), second(layout);
    for (int y = 0; y < 70; ++y) {
        std::memcpy(given.at(0, y), premultiplied.at(0, y), 90 * sizeof(float[4]));
    }
    CHECK(node.instance->render(2, &given, second, layout.bounds) == kOfxStatOK);
    for (int y = 0; y < 70; ++y) {
        for (int x = 0; x < 90; ++x) {
            const float alpha = second.floats(x, y)[3];
            for (int c = 0; c < 3; ++c) {
                CHECK(std::abs(second.floats(x, y)[c] - alpha * first.floats(x, y)[c]) < 1e-5f);
            }
        }
    }
}
