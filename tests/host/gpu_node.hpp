// A node in a host with GPUs, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "harness.hpp"
#include "strict_gpu.hpp"

namespace test {

/// Of *Exact*, in code values.
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
        double worst = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
            if (std::memcmp(&a[i], &b[i], sizeof(float)) == 0) continue;
            // Beyond that the closest colour is a matter of rounding here, too.
            const float* const pixel = &from[i - i % 4];
            if (std::any_of(pixel, pixel + 3, [](float c) { return std::abs(c) > 1e4f; })) {
                CHECK(std::isfinite(b[i]));
                continue;
            }
            EXPECT(std::memcmp(&a[i], &from[i], sizeof(float)) != 0, "an untouched number changed");
            const double size = std::max(1.0, std::abs(static_cast<double>(a[i])));
            const double error = std::abs(static_cast<double>(a[i]) - b[i]) / size;
            worst = std::max(worst, std::isfinite(error) ? error : 1);
        }
        EXPECT(worst < kPromise, std::to_string(worst));
    }
};

}  // namespace test
