// Pictures through the node against the core, byte for byte.
#include <cstring>
#include <thread>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

/// Renders a window and compares; the rest of the picture is watched by the host.
void compare(Instance& instance, const palette4d::Sidecar& parsed, const Layout& in,
             const Layout& out, const OfxRectI& window, double time, double strength = 1) {
    Picture source(in, 0x11), output(out);
    fill(source, static_cast<unsigned>(in.width() * 7 + window.x1));
    CHECK(instance.render(time, &source, output, window) == kOfxStatOK);
    const auto expected = recoloured(parsed, 10 + time, source, window, strength);
    CHECK(output.pixels(window) == expected);
    // Were nothing recoloured, the comparison would mean nothing.
    if (strength > 0 && window.x2 - window.x1 > 3) CHECK(source.pixels(window) != expected);
}

}  // namespace

TEST(every_layout_gives_the_cores_bytes) {
    Ready node;
    const OfxRectI bounds[] = {rect(0, 0, 37, 53), rect(-19, -30, 18, 23), rect(1000, 5, 1037, 58)};
    for (const OfxRectI& b : bounds) {
        for (const Depth depth : kDepths) {
            for (const int channels : {3, 4}) {
                for (const bool premultiplied : {false, true}) {
                    if (premultiplied && channels == 3) continue;
                    for (int odd = 0; odd < 8; ++odd) {
                        Layout in, out;
                        in.bounds = out.bounds = b;
                        in.channels = out.channels = channels;
                        in.depth = out.depth = depth;
                        in.premultiplication = out.premultiplication =
                            premultiplied ? kOfxImagePreMultiplied : kOfxImageUnPreMultiplied;
                        in.upside_down = odd & 1;
                        out.upside_down = odd & 2;
                        in.padding = odd & 4 ? 20 : 0;
                        out.padding = odd & 4 ? 4 : 52;
                        compare(*node.instance, node.parsed, in, out, b, 4);
                    }
                }
            }
        }
    }
}

TEST(every_layout_in_the_general_context) {
    Ready node(sidecar(), kOfxImageEffectContextGeneral);
    for (const Layout& layout : layouts()) {
        const Picture source = source_of(layout);
        const auto found = node.render(source, 4);
        CHECK(found == recoloured(node.parsed, 14, source, layout.bounds));
        CHECK(found != source.pixels(layout.bounds));
    }
}

TEST(opaque_and_unknown_premultiplication_leave_alpha_aside) {
    Ready node;
    for (const char* name : {kOfxImageOpaque, "OfxImageSomethingNew", ""}) {
        Layout layout;
        layout.premultiplication = name;
        compare(*node.instance, node.parsed, layout, layout, layout.bounds, 1);
    }
}

TEST(render_windows_and_tiles) {
    Ready node;
    Layout layout;
    layout.bounds = rect(-8, 3, 56, 73);
    layout.padding = 12;
    layout.upside_down = true;
    for (const OfxRectI& window : {rect(-8, 3, -7, 4), rect(55, 72, 56, 73), rect(0, 10, 40, 11),
                                   rect(5, 3, 6, 73), rect(10, 20, 43, 61)}) {
        compare(*node.instance, node.parsed, layout, layout, window, 2);
    }
    // Tiles make the same picture as one render.
    Picture source(layout), whole(layout), tiled(layout);
    fill(source);
    CHECK(node.instance->render(5, &source, whole, layout.bounds) == kOfxStatOK);
    for (int y = 3; y < 73; y += 9) {
        for (int x = -8; x < 56; x += 13) {
            const OfxRectI tile = rect(x, y, std::min(x + 13, 56), std::min(y + 9, 73));
            CHECK(node.instance->render(5, &source, tiled, tile) == kOfxStatOK);
        }
    }
    CHECK(whole.pixels(layout.bounds) == tiled.pixels(layout.bounds));
    // Nothing to do.
    Picture untouched(layout);
    CHECK(node.instance->render(5, &source, untouched, rect(7, 7, 7, 9)) == kOfxStatOK);
    CHECK(untouched.storage() == Picture(layout).storage());
}

TEST(rows_of_floats_at_any_byte) {
    Shown node;
    const std::vector<unsigned char> expected = node.render();
    Layout odd = node.layout;
    odd.padding = 2;
    Picture source(odd), output(odd);
    const OfxRectI& b = odd.bounds;
    for (int y = b.y1; y < b.y2; ++y) {
        const int bytes = odd.width() * odd.pixel_bytes();
        std::memcpy(source.at(b.x1, y), node.source.at(b.x1, y), static_cast<std::size_t>(bytes));
    }
    CHECK(node.instance->render(2, &source, output, b) == kOfxStatOK);
    CHECK(output.pixels(b) == expected);
}

TEST(a_window_beyond_the_output_is_cut) {
    Ready node;
    Layout layout;
    Picture source(layout), output(layout);
    fill(source);
    // The host's own check of the window wants it inside: ask the plugin directly.
    CHECK(node.instance->render(0, &source, output, layout.bounds) == kOfxStatOK);
    OfxPropertySetStruct in(kInArgs);
    in.put(kOfxPropTime, 0.0);
    in.put_all(kOfxImageEffectPropRenderWindow, {-100000, -5, 100000, 2147483647});
    std::set<OfxPropertySetHandle> images;
    Picture again(layout);
    activity().output = &again;
    activity().source = &source;
    activity().images = &images;
    CHECK(node.plugin.call(kOfxImageEffectActionRender, &node.instance->effect(), &in, nullptr) ==
          kOfxStatOK);
    activity() = {};
    CHECK(images.empty());
    CHECK(again.storage() == output.storage());
}

TEST(times_offsets_and_strengths) {
    Shown node;
    const Layout& layout = node.layout;
    // Before, inside, between frames, and after the clip, which holds its ends.
    for (const double time : {-5.0, 0.0, 0.5, 3.999, 5.0, 7.0 + 1.0 / 3.0, 10.0, 11.0, 1e9}) {
        compare(*node.instance, node.parsed, layout, layout, layout.bounds, time);
    }
    for (const double strength : {0.0, 0.25, 1.0}) {
        node.instance->set("strength", strength);
        compare(*node.instance, node.parsed, layout, layout, layout.bounds, 3.25, strength);
    }
    // Hosts do not keep to the range.
    for (const double strength : {-3.0, 7.0}) {
        node.instance->set("strength", strength);
        compare(*node.instance, node.parsed, layout, layout, layout.bounds, 3,
                strength > 0 ? 1 : 0);
    }
    node.instance->animate("strength", {{0, 0.0}, {4, 1.0}});
    compare(*node.instance, node.parsed, layout, layout, layout.bounds, 1, 0.25);
    node.instance->animate("strength", {});
    node.instance->set("strength", 1.0);

    for (const double offset : {-2.0, 0.5, 6.0, 1e5}) {
        node.set("frameOffset", offset);
        CHECK(node.render(2) == node.edited(10 + 2 + offset));
    }
    CHECK(node.message().empty());
    // No number at all: the picture passes through, with a word.
    node.set("frameOffset", std::numeric_limits<double>::quiet_NaN());
    CHECK(node.render(2) == node.unchanged());
    CHECK(!node.message().empty());
}

TEST(drafts_and_playback_show_what_a_final_render_writes) {
    Ready node;
    Layout layout;
    layout.bounds = rect(0, 0, 1920, 8);
    layout.definition = rect(0, 0, 1920, 1080);
    Picture source(layout);
    fill(source);
    const auto expected = recoloured(node.parsed, 12, source, layout.bounds);
    for (const char* said :
         {kOfxImageEffectPropInteractiveRenderStatus, kOfxImageEffectPropRenderQualityDraft}) {
        node.instance->extra_arguments = {{said, 1}};
        CHECK(node.render(source, 2) == expected);
    }
}

TEST(an_unedited_palette_returns_every_bit) {
    Ready node(sidecar("plain.p4d.json", false));
    for (const Layout& layout : layouts()) {
        const Picture source = source_of(layout);
        CHECK(node.render(source, 3) == source.pixels(layout.bounds));
    }
}

TEST(an_edit_that_moves_nothing_here_returns_every_byte) {
    // Only the last frame is edited: at the first one the palette is as it was, and at strength
    // near 0 every byte must come back from its journey through float.
    Ready node;
    Layout layout;
    layout.depth = Depth::kByte;
    layout.bounds = rect(0, 0, 256, 4);
    Picture source(layout), output(layout);
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 256; ++x) {
            for (int c = 0; c < 4; ++c) source.at(x, y)[c] = static_cast<unsigned char>(x + 85 * c);
        }
    }
    node.instance->set("strength", 1e-9);
    CHECK(node.render(source, 3) == source.pixels(layout.bounds));
}

TEST(a_source_smaller_than_the_window_is_framed_in_black) {
    Ready node;
    for (const Depth depth : kDepths) {
        for (const bool passing : {false, true}) {
            node.instance->set("strength", passing ? 0.0 : 1.0);
            for (const OfxRectI& b : {rect(5, 4, 20, 31), rect(-9, -9, 3, 60), rect(30, 30, 90, 90),
                                      rect(-5, -5, 50, 50), rect(100, 0, 110, 10)}) {
                Layout in, out;
                in.depth = out.depth = depth;
                in.bounds = b;
                out.bounds = rect(0, 0, 40, 44);
                Picture source(in), output(out);
                fill(source);
                CHECK(node.instance->render(1, &source, output, out.bounds) == kOfxStatOK);
                const OfxRectI covered = rect(std::max(b.x1, 0), std::max(b.y1, 0),
                                              std::min(b.x2, 40), std::min(b.y2, 44));
                Picture expected(out, 0);
                if (covered.x1 < covered.x2 && covered.y1 < covered.y2) {
                    const auto inner =
                        recoloured(node.parsed, 11, source, covered, passing ? 0 : 1);
                    const std::size_t row =
                        static_cast<std::size_t>((covered.x2 - covered.x1) * out.pixel_bytes());
                    for (int y = covered.y1; y < covered.y2; ++y) {
                        std::copy_n(inner.data() + row * static_cast<std::size_t>(y - covered.y1),
                                    row, expected.at(covered.x1, y));
                    }
                }
                CHECK(output.pixels(out.bounds) == expected.pixels(out.bounds));
            }
        }
    }
}

TEST(other_outputs_are_framed_in_black_too) {
    Ready node;
    Layout in, out;
    in.bounds = rect(5, 4, 20, 31);
    out.bounds = rect(0, 0, 40, 44);
    Picture source(in);
    fill(source);
    const std::pair<const char*, Value> settings[] = {
        {"output", 3}, {"output", 1}, {"keepLightness", 1.0}, {"mix", 0.5}};
    for (const auto& [name, value] : settings) {
        const Value before = node.instance->value(name);
        node.instance->set(name, value);
        Picture output(out), alone(in), expected(out, 0);
        CHECK(node.instance->render(1, &source, output, out.bounds) == kOfxStatOK);
        CHECK(node.instance->render(1, &source, alone, in.bounds) == kOfxStatOK);
        for (int y = in.bounds.y1; y < in.bounds.y2; ++y) {
            std::copy_n(alone.at(in.bounds.x1, y), in.width() * in.pixel_bytes(),
                        expected.at(in.bounds.x1, y));
        }
        CHECK(output.pixels(out.bounds) == expected.pixels(out.bounds));
        node.instance->set(name, before);
    }
}

TEST(images_that_are_parts_are_parts_of_the_one_picture) {
    Ready node;
    Layout whole;
    whole.bounds = rect(-4, 10, 60, 58);
    Picture source(whole), all(whole);
    fill(source);
    for (const int shown : {0, 2}) {  // the palette's strip stands where the picture ends
        node.instance->set("output", shown);
        CHECK(node.instance->render(1, &source, all, whole.bounds) == kOfxStatOK);
        for (const OfxRectI& part : {rect(-4, 10, 28, 34), rect(28, 10, 60, 34),
                                     rect(-4, 34, 28, 58), rect(7, 13, 41, 15)}) {
            Layout tile = whole;
            tile.bounds = part;
            tile.definition = whole.bounds;
            Picture output(tile);
            CHECK(node.instance->render(1, &source, output, part) == kOfxStatOK);
            CHECK(output.pixels(part) == all.pixels(part));
        }
    }
}

TEST(no_source_is_transparent_black) {
    Shown node;
    Picture output(node.layout);
    CHECK(node.instance->render(1, nullptr, output, node.layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(node.layout.bounds) == Picture(node.layout, 0).pixels(node.layout.bounds));
}

TEST(unequal_layouts_are_refused_in_black) {
    Ready node;
    Layout in, out;
    in.channels = 3;
    Picture source(in), output(out);
    fill(source);
    CHECK(node.instance->render(1, &source, output, out.bounds) == kOfxStatFailed);
    CHECK(output.pixels(out.bounds) == Picture(out, 0).pixels(out.bounds));
}

TEST(an_abort_ends_the_render_soon) {
    Config config;
    config.processors = 1;
    Host::get().configure(config);
    Ready node;
    Layout layout;
    layout.bounds = rect(0, 0, 16, 1600);
    Picture source(layout), output(layout);
    fill(source);
    node.instance->effect().abort_after = 3;
    CHECK(node.instance->render(1, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(node.instance->effect().abort_polls == 4);
    CHECK(output.pixels(rect(0, 1500, 16, 1600)) ==
          Picture(layout).pixels(rect(0, 1500, 16, 1600)));
}

TEST(many_threads_two_instances) {
    Ready node;
    const auto other = node.plugin.create(kOfxImageEffectContextGeneral);
    other->set("sidecar", sidecar("plain.p4d.json", false));
    std::vector<std::thread> threads;
    std::atomic<int> wrong{0};
    for (int t = 0; t < 12; ++t) {
        threads.emplace_back([&, t] {
            Layout layout;
            layout.bounds = rect(0, 0, 33, 70);
            layout.depth = t % 3 ? Depth::kFloat : Depth::kByte;
            Picture source(layout), output(layout);
            fill(source, static_cast<unsigned>(t));
            for (int frame = 0; frame < 12; ++frame) {
                // Threads meet on frames, and pass more of them than the cache holds.
                const double time = (frame + t) % 60 * 0.25;
                Instance& instance = t % 4 == 3 ? *other : *node.instance;
                wrong += instance.render(time, &source, output, layout.bounds) != kOfxStatOK;
                const auto expected =
                    t % 4 == 3 ? source.pixels(layout.bounds)
                               : recoloured(node.parsed, 10 + time, source, layout.bounds);
                wrong += output.pixels(layout.bounds) != expected;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
}

TEST(a_fresh_instance_for_every_frame_in_many_threads) {
    // As MLT does it: Load, Describe and CreateInstance in all threads at once.
    Ready node;
    std::vector<std::thread> threads;
    std::atomic<int> wrong{0};
    for (int t = 0; t < 8; ++t) {
        threads.emplace_back([&, t] {
            const Layout layout;
            Picture source(layout), output(layout);
            fill(source, static_cast<unsigned>(t));
            for (int frame = 0; frame < 10; ++frame) {
                const auto instance = node.plugin.create();
                instance->set("sidecar", node.path);
                wrong += instance->render(frame, &source, output, layout.bounds) != kOfxStatOK;
                wrong += output.pixels(layout.bounds) !=
                         recoloured(node.parsed, 10 + frame, source, layout.bounds);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
}
