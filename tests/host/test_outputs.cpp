// What the node puts out besides the recoloured picture, against the core's palette weights in
// double precision.
#include <cmath>
#include <cstring>
#include <limits>

#include "harness.hpp"
#include "palette4d/handles.hpp"
#include "palette4d/lineage.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

namespace {

constexpr double kTolerance = 2e-4;  ///< the core's single precision, and rounding to float

struct Node {
    Plugin plugin{bundle()};
    std::string path = sidecar();
    palette4d::Sidecar parsed = palette4d::read_sidecar(path);
    std::unique_ptr<Instance> instance = plugin.create();
    Node() { instance->set("sidecar", path); }
    void set(const char* name, Value value) { instance->set(name, std::move(value)); }
};

/// Float or byte pixels as floats.
std::vector<float> floats(const Layout& layout, const std::vector<unsigned char>& pixels) {
    std::vector<float> values(layout.depth == Depth::kByte ? pixels.size() : pixels.size() / 4);
    if (layout.depth == Depth::kByte) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = pixels[i] / 255.0f;
    } else {
        std::memcpy(values.data(), pixels.data(), pixels.size());
    }
    return values;
}

bool finite(const Vec3& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

/// The matte of one straight colour, worked out anew.
class Reference {
public:
    Reference(const palette4d::Sidecar& sidecar, double frame, int handle)
        : slice_(palette4d::slice_at(sidecar.polytope, frame)),
          lineage_(sidecar.polytope, sidecar.edits, handle),
          body_(slice_.rgb, slice_.faces) {}
    double weight(const Vec3& p) const {
        std::vector<double> weights(slice_.rgb.size());
        body_.project(p, weights.data(), workspace_);
        double sum = 0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            if (lineage_.holds(slice_.where[i])) sum += weights[i];
        }
        return std::min(std::max(sum, 0.0), 1.0);
    }
    double outside(const Vec3& p, double reach) const {
        std::vector<double> weights(slice_.rgb.size());
        const double away = body_.project(p, weights.data(), workspace_).distance;
        return std::min(std::max((away - 1e-3) / reach, 0.0), 1.0);
    }

private:
    palette4d::Slice slice_;
    palette4d::Lineage lineage_;
    palette4d::PaletteBody body_;
    mutable palette4d::PaletteBody::Workspace workspace_;
};

/// Compares a matte of a whole picture, in grey or in alpha.
template <class Matte>
void check_matte(const Layout& layout, const Picture& source, const Picture& output, bool in_alpha,
                 const Matte& matte, double tolerance) {
    const std::vector<float> in = floats(layout, source.pixels(layout.bounds));
    const std::vector<float> out = floats(layout, output.pixels(layout.bounds));
    const auto channels = static_cast<std::size_t>(layout.channels);
    const bool premultiplied = channels == 4 && layout.premultiplication == kOfxImagePreMultiplied;
    const bool opaque = channels == 4 && layout.premultiplication == kOfxImageOpaque;
    if (layout.depth == Depth::kByte) tolerance += 0.5 / 255;
    double lowest = 1, highest = 0;
    for (std::size_t i = 0; i < in.size() / channels; ++i) {
        const float* p = &in[i * channels];
        // Of an opaque picture alpha is 1, whatever stands in it.
        const double alpha = channels == 4 && !(opaque && in_alpha) ? p[3] : 1.0;
        const double divisor = premultiplied ? alpha : 1.0;
        const Vec3 straight = {p[0] / divisor, p[1] / divisor, p[2] / divisor};
        const double m = divisor == 0 || !finite(straight) ? 0 : matte(straight);
        lowest = std::min(lowest, m);
        highest = std::max(highest, m);
        const float* found = &out[i * channels];
        for (std::size_t c = 0; c < channels; ++c) {
            double expected = c == 3 ? alpha : (premultiplied ? alpha : 1) * m;
            if (in_alpha && channels == 4) {
                expected = c == 3 ? alpha * m : premultiplied ? p[c] * m : p[c];
            }
            if (!std::isfinite(expected)) continue;
            // The result is a float, of whatever size.
            const double limit = tolerance * std::max(1.0, std::abs(expected / (m > 0 ? m : 1)));
            EXPECT(std::abs(found[c] - expected) <= limit,
                   "pixel " + std::to_string(i) + " channel " + std::to_string(c) + ": found " +
                       std::to_string(found[c]) + ", expected " + std::to_string(expected));
        }
    }
    // A matte that is the same everywhere would prove nothing.
    CHECK(lowest < 0.05 && highest > 0.5);
}

std::vector<Layout> layouts() {
    std::vector<Layout> all;
    for (const Depth depth : {Depth::kFloat, Depth::kByte}) {
        for (const int channels : {3, 4}) {
            for (const char* alpha :
                 {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied, kOfxImageOpaque}) {
                if (channels == 3 && alpha != std::string(kOfxImageUnPreMultiplied)) continue;
                Layout layout;
                layout.bounds = rect(-9, 4, 22, 31);
                layout.depth = depth;
                layout.channels = channels;
                layout.premultiplication = alpha;
                layout.padding = 12;
                layout.upside_down = channels == 4;
                all.push_back(layout);
            }
        }
    }
    return all;
}

/// A picture whose premultiplied colours go with its alpha.
Picture source_of(const Layout& layout) {
    Picture source(layout, 0x22);
    fill(source, 3);
    if (layout.premultiplication != kOfxImagePreMultiplied) return source;
    for (int y = layout.bounds.y1; y < layout.bounds.y2; ++y) {
        for (int x = layout.bounds.x1; x < layout.bounds.x2; ++x) {
            for (int c = 0; c < 3; ++c) {
                if (layout.depth == Depth::kByte) {
                    unsigned char* p = source.at(x, y);
                    p[c] = static_cast<unsigned char>(p[c] * p[3] / 255);
                } else {
                    source.floats(x, y)[c] *= source.floats(x, y)[3];
                }
            }
        }
    }
    return source;
}

}  // namespace

TEST(the_weight_of_a_handle) {
    Node node;
    node.set("output", 1);
    for (const int slot : {1, 8, 12, 17}) {
        node.set("weightOf", slot);
        for (const Layout& layout : layouts()) {
            for (const bool in_alpha : {false, true}) {
                node.set("matteIn", int{in_alpha});
                const Picture source = source_of(layout);
                Picture output(layout);
                CHECK(node.instance->render(4, &source, output, layout.bounds) == kOfxStatOK);
                const Reference reference(node.parsed, 14, slot - 1);
                check_matte(
                    layout, source, output, in_alpha,
                    [&](const Vec3& p) { return reference.weight(p); }, kTolerance);
            }
        }
    }
}

TEST(the_weights_of_all_handles_of_a_frame_make_one) {
    Node node;
    node.set("output", 1);
    const Layout layout;
    Picture source(layout);
    fill(source, 9, false);
    std::vector<double> sum(static_cast<std::size_t>(layout.width() * layout.height()));
    for (int slot = 1; slot <= 8; ++slot) {  // v0 to v7, the first ends of all edges
        node.set("weightOf", slot);
        Picture output(layout);
        CHECK(node.instance->render(3.5, &source, output, layout.bounds) == kOfxStatOK);
        const auto out = floats(layout, output.pixels(layout.bounds));
        for (std::size_t i = 0; i < sum.size(); ++i) {
            CHECK(out[4 * i] == out[4 * i + 1] && out[4 * i] == out[4 * i + 2]);
            sum[i] += out[4 * i];
        }
    }
    for (const double total : sum) CHECK(std::abs(total - 1) < 8 * kTolerance);
}

TEST(a_slots_id_is_the_weights_handle_and_a_missing_one_is_said) {
    Node node;
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
        Picture output(layout);
        CHECK(node.instance->render(2, &source, output, layout.bounds) == kOfxStatOK);
        CHECK(output.pixels(layout.bounds) == source.pixels(layout.bounds));
        const std::string said = node.instance->effect().persistent_message;
        EXPECT(said.find("expected one of its 17") != std::string::npos, said);
    }
}

TEST(a_matte_in_alpha_asks_for_an_alpha_that_counts) {
    Node node;
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

TEST(what_the_palette_does_not_enclose) {
    Node node;
    node.set("output", 3);
    for (const double reach : {0.05, 0.4}) {
        node.set("outsideReach", reach);
        for (const Layout& layout : layouts()) {
            for (const bool in_alpha : {false, true}) {
                node.set("matteIn", int{in_alpha});
                const Picture source = source_of(layout);
                Picture output(layout);
                CHECK(node.instance->render(6, &source, output, layout.bounds) == kOfxStatOK);
                const Reference reference(node.parsed, 16, 0);
                check_matte(
                    layout, source, output, in_alpha,
                    [&](const Vec3& p) { return reference.outside(p, reach); },
                    2 * kTolerance / reach);
            }
        }
    }
}

TEST(inside_is_black_to_the_last_bit) {
    Node node;
    node.set("output", 3);
    Layout layout;
    Picture source(layout), output(layout);
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
            for (int c = 0; c < 4; ++c) {
                source.floats(x, y)[c] = 0.15f + 0.04f * static_cast<float>((x + y * c) % 16);
            }
        }
    }
    CHECK(node.instance->render(0, &source, output, layout.bounds) == kOfxStatOK);
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) CHECK(output.floats(x, y)[0] == 0);
    }
}

TEST(halves_of_bytes_are_rounded_to_the_even_one) {
    Node node;
    node.set("output", 3);
    node.set("mix", 0.5);  // all inside, so that half of the byte comes out
    Layout layout;
    layout.bounds = rect(0, 0, 100, 1);
    layout.depth = Depth::kByte;
    layout.channels = 3;
    Picture source(layout), output(layout);
    for (int x = 0; x < 100; ++x) std::memset(source.at(x, 0), 51 + x, 3);
    CHECK(node.instance->render(0, &source, output, layout.bounds) == kOfxStatOK);
    int halves = 0;
    for (int x = 0; x < 100; ++x) {
        const float half = static_cast<float>(static_cast<float>(51 + x) / 255.0f * 0.5) * 255.0f;
        halves += half - std::floor(half) == 0.5f;
        EXPECT(*output.at(x, 0) == static_cast<int>(std::nearbyint(half)),
               std::to_string(half) + " became " + std::to_string(*output.at(x, 0)));
    }
    CHECK(halves > 20);
}

TEST(the_palette_stands_at_the_pictures_foot) {
    Node node;
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
    Node node;
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
    Node node;
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
    Node node;
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
    Node node;
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
            const double step = layout.depth == Depth::kByte ? 1.01 / 255 : 1e-6;
            for (std::size_t i = 0; i < in.size(); ++i) {
                if (!std::isfinite(in[i]) || !std::isfinite(all[i])) continue;
                // Bytes do not tell what lies beyond them.
                if (layout.depth == Depth::kByte && (all[i] == 0 || all[i] == 1)) continue;
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
    Node node;
    for (const int output : {0, 1, 2, 3}) {
        node.set("output", output);
        for (const Depth depth : {Depth::kFloat, Depth::kByte}) {
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
    Node node;
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
    Node node;
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
