// The node's mattes: the weight of a handle, and what the palette does not enclose, against the
// core's palette weights in double precision.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "harness.hpp"
#include "model/handles.hpp"
#include "model/lineage.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

namespace {

constexpr double kTolerance = 2e-4;  ///< the core's single precision, and rounding to float

bool finite(const Vec3& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

bool is_number(const Vec3& p) {
    return !std::isnan(p[0]) && !std::isnan(p[1]) && !std::isnan(p[2]);
}

/// The matte of one straight colour, computed again.
class Reference {
public:
    Reference(const palette4d::Sidecar& sidecar, double frame, int handle)
        : slice_(palette4d::slice_at(sidecar.polytope, frame)),
          lineage_(sidecar.polytope, sidecar.edits, handle),
          body_(slice_.rgb, slice_.faces) {}
    double weight(const Vec3& p) const {
        if (!finite(p)) return 0;
        std::vector<double> weights(slice_.rgb.size());
        body_.project(p, weights.data(), workspace_);
        double sum = 0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            if (lineage_.holds(slice_.where[i])) sum += weights[i];
        }
        return std::min(std::max(sum, 0.0), 1.0);
    }
    double outside(const Vec3& p, double reach) const {
        if (!finite(p)) return 1;
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
    tolerance += rounding(layout.depth);
    double lowest = 1, highest = 0;
    for (std::size_t i = 0; i < in.size() / channels; ++i) {
        const float* p = &in[i * channels];
        // Of an opaque picture alpha is 1, whatever stands in it.
        const double alpha = channels == 4 && !(opaque && in_alpha) ? p[3] : 1.0;
        const double divisor = premultiplied ? alpha : 1.0;
        const Vec3 straight = {p[0] / divisor, p[1] / divisor, p[2] / divisor};
        const double m = divisor == 0 || !is_number(straight) ? 0 : matte(straight);
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

}  // namespace

TEST(the_weight_of_a_handle) {
    Ready node;
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
    Ready node;
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
        Picture output(layout);
        CHECK(node.instance->render(2, &source, output, layout.bounds) == kOfxStatOK);
        CHECK(output.pixels(layout.bounds) == source.pixels(layout.bounds));
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

TEST(what_the_palette_does_not_enclose) {
    Ready node;
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

TEST(what_is_infinite_is_outside_and_what_is_no_number_is_not) {
    Ready node;
    node.set("output", 3);
    Layout layout;
    Picture source(layout), output(layout);
    fill(source);
    const float infinite = HUGE_VALF, not_a_number = std::nanf("");
    const float cases[4][3] = {{infinite, 0.5f, 0.5f},
                               {0.5f, -infinite, infinite},
                               {not_a_number, 0.5f, 0.5f},
                               {infinite, not_a_number, 0.5f}};
    for (int x = 0; x < 4; ++x) {
        std::copy_n(cases[x], 3, source.floats(x, 0));
        source.floats(x, 0)[3] = 1;
    }
    CHECK(node.instance->render(0, &source, output, layout.bounds) == kOfxStatOK);
    for (int x = 0; x < 4; ++x) {
        for (int c = 0; c < 3; ++c) CHECK(output.floats(x, 0)[c] == (x < 2 ? 1 : 0));
    }
}

TEST(inside_is_black_to_the_last_bit) {
    Ready node;
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
    Ready node;
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
