// A node in a host with GPUs, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "harness.hpp"
#include "strict_gpu.hpp"

namespace test {

/// Of the processor's pictures, in code values.
constexpr double kPromise = 1e-4;

/// The devices of this machine, each in a context of its own.
std::vector<std::unique_ptr<strict::Gpu>> gpus();

/// A node that draws a picture here and on a GPU.
struct Both : Ready {
    strict::Gpu& gpu;
    explicit Both(strict::Gpu& on, const std::string& of = test::sidecar()) : Ready(of), gpu(on) {}
    /// What is kept for a GPU goes with this action.
    ~Both() {
        instance.reset();
        plugin.unload();
    }
    std::vector<unsigned char> draw(const strict::Picture* source, const strict::Layout& layout,
                                    const OfxRectI& window, strict::Gpu* on, double time = 3) {
        strict::Picture output(layout);
        instance->gpu = on;
        CHECK(instance->render(time, source, output, window) == kOfxStatOK);
        instance->gpu = nullptr;
        return output.pixels(window);
    }
    std::string status() {
        CHECK(instance->changed("", "", kOfxChangeTime) == kOfxStatOK);
        return instance->text("status");
    }
    bool by_kernel() {
        const std::string text = status();
        return text.find("GPU: " + gpu.device()) != std::string::npos &&
               text.find("copied") == std::string::npos;
    }
    /// Both ways: near each other where the kernel draws, else equal.
    void compare(const strict::Picture& source, const OfxRectI& window, bool kernel) {
        const strict::Layout& layout = source.layout();
        const auto here = draw(&source, layout, window, nullptr);
        const auto there = draw(&source, layout, window, &gpu);
        EXPECT(by_kernel() == kernel, status());
        if (!kernel) {
            CHECK(here == there);
            return;
        }
        const auto a = floats(layout, here), b = floats(layout, there);
        const auto from = floats(layout, source.pixels(window));
        const bool premultiplied = layout.premultiplication == std::string(kOfxImagePreMultiplied);
        const auto choice = [&](const char* name) { return std::get<int>(instance->value(name)); };
        const bool converts =
            parsed.conversion && choice("output") == 0 && choice("pictureIn") == 0;
        double worst = 0;
        const auto compared = [&](double x, double y) {
            if (std::memcmp(&x, &y, sizeof x) == 0) return;
            const double error = std::abs(x - y) / std::max(1.0, std::abs(x));
            worst = std::max(worst, std::isfinite(error) ? error : 1);
        };
        for (std::size_t i = 0; i < a.size(); i += 4) {
            if (std::memcmp(&a[i], &b[i], 4 * sizeof(float)) == 0) continue;
            // A matte is computed: of what is no number, processors keep other bits.
            const auto as_good = [&](std::size_t c) {
                return std::memcmp(&a[c], &b[c], sizeof(float)) == 0 ||
                       (choice("output") != 0 && std::isnan(a[c]) && std::isnan(b[c]));
            };
            if (as_good(i) && as_good(i + 1) && as_good(i + 2) && as_good(i + 3)) continue;
            // Beyond that the closest colour is a matter of rounding here, too.
            if (std::any_of(&from[i], &from[i] + 3, [](float c) { return std::abs(c) > 1e4f; })) {
                for (std::size_t c = i; c < i + 4; ++c) {
                    CHECK(std::isfinite(b[c]) || std::isnan(a[c]) || a[c] == b[c]);
                }
                continue;
            }
            // At the edge of a window or of what is cleaned up steps are so small that some round
            // to none here, and to one unit in the last place there.
            const auto changed = [&](std::size_t c) {
                const bool rounded = from[c] != b[c] && std::nextafter(from[c], b[c]) == b[c];
                return !rounded && std::memcmp(&b[c], &from[c], sizeof(float)) != 0;
            };
            EXPECT(std::memcmp(&a[i], &from[i], 4 * sizeof(float)) != 0 ||
                       !(changed(i) || changed(i + 1) || changed(i + 2) || changed(i + 3)),
                   "an untouched pixel changed");
            for (std::size_t c = i; c < i + 4 && !converts; ++c) {
                EXPECT(std::memcmp(&a[c], &from[c], sizeof(float)) != 0 || !changed(c),
                       "an untouched number changed");
            }
            compared(a[i + 3], b[i + 3]);
            const auto in_palette = [&](const float* pixel) -> palette4d::Vec3 {
                if (!converts) return {pixel[0], pixel[1], pixel[2]};
                return parsed.conversion->steps.to_palette(
                    palette4d::straight_colour(pixel, premultiplied));
            };
            const palette4d::Vec3 x = in_palette(&a[i]), y = in_palette(&b[i]);
            for (std::size_t c = 0; c < 3; ++c) compared(x[c], y[c]);
        }
        EXPECT(worst < kPromise, std::to_string(worst));
    }
};

}  // namespace test
