// The node in a host that hands over pictures in a GPU's memory: OpenCL, on this machine's
// processor where pocl is installed, and CUDA where there is a GPU. Without either these tests do
// nothing, and say so.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <thread>

#include "gpu_node.hpp"

using namespace strict;
using namespace test;

std::vector<std::unique_ptr<Gpu>> test::gpus() {
    Config config;
    config.gpus = true;
    Host::get().configure(config);
    std::vector<std::unique_ptr<Gpu>> all;
#if defined(__SANITIZE_THREAD__)
    return all;  // it does not know the locks of pocl's own threads
#endif
    if (auto gpu = opencl_gpu()) all.push_back(std::move(gpu));
    for (const Stream stream : {Stream::kOwn, Stream::kNone}) {
        if (auto gpu = cuda_gpu(stream)) all.push_back(std::move(gpu));
    }
    const char* const required = std::getenv("PALETTE4D_REQUIRE_GPU");
    EXPECT(!all.empty() || !required || std::strcmp(required, "1") != 0,
           "no GPU and no pocl, which PALETTE4D_REQUIRE_GPU=1 asks for");
    static bool told = false;
    if (all.empty() && !told) figure("no OpenCL (Debian: pocl-opencl-icd) and no CUDA: not tested");
    told = true;
    return all;
}

namespace {

/// What a host with GPUs can have: rows count upwards.
std::vector<Layout> gpu_layouts() {
    std::vector<Layout> all;
    for (Layout layout : layouts()) {
        layout.upside_down = false;
        all.push_back(layout);
    }
    return all;
}

bool is_rgba_float(const Layout& layout) {
    return layout.channels == 4 && layout.depth == Depth::kFloat;
}

}  // namespace

TEST(gpu_pictures_are_the_exact_ones) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        for (const Layout& layout : gpu_layouts()) {
            const Picture source = source_of(layout);
            node.compare(source, layout.bounds, is_rgba_float(layout));
            const OfxRectI& b = layout.bounds;
            node.compare(source, rect(b.x1 + 3, b.y1 + 5, b.x2 - 7, b.y2 - 2),
                         is_rgba_float(layout));
        }
    }
}

TEST(gpu_rows_of_any_length) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        Layout plain;
        plain.bounds = rect(-5, 1, 32, 20);
        const OfxRectI window = rect(-2, 3, 29, 18);
        const Picture straight = source_of(plain);
        const auto expected = node.draw(&straight, plain, window, nullptr);
        const auto kernel = node.draw(&straight, plain, window, gpu.get());
        for (const int padding : {4, 8, 60, 1, 2, 7}) {
            Layout layout = plain;
            layout.padding = padding;
            const Picture source = source_of(layout);
            const bool whole = padding % 4 == 0;
            CHECK(node.draw(&source, layout, window, gpu.get()) == (whole ? kernel : expected));
            EXPECT(node.by_kernel() == whole, node.status());
        }
    }
}

TEST(gpu_status_says_what_a_frame_takes) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        const Picture source = source_of({});
        const auto time = [&](const std::string& before, const std::string& after) {
            const std::string text = node.status();
            const std::size_t at = text.find(before), end = text.find(after, at + before.size());
            EXPECT(at != std::string::npos && end != std::string::npos, text);
            if (end == std::string::npos) return 0.0;
            return std::stod(text.substr(at + before.size(), end - at - before.size()));
        };
        Layout large;
        large.bounds = rect(0, 0, 640, 400);
        const Picture picture = source_of(large);
        for (int i = 0; i < 3; ++i) node.draw(&picture, large, large.bounds, gpu.get());
        const double kernel = time("GPU: " + gpu->device() + ", ", " ms a frame");
        CHECK(kernel < 10000);
        // It stays until it is measured again.
        for (int i = 0; i < 3; ++i) node.draw(&source, {}, Layout{}.bounds, gpu.get());
        CHECK(time("GPU: " + gpu->device() + ", ", " ms a frame") == kernel);
        node.set("gpu", 1);
        node.draw(&picture, large, large.bounds, gpu.get());
        CHECK(time("drawn on the processor and copied in ", " ms: GPU is Off") > 0);
    }
}

TEST(gpu_draws_a_window_beyond_the_source) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        Layout part;
        part.bounds = rect(4, 3, 11, 13);
        part.padding = 32;
        const Picture source = source_of(part);
        Layout whole;
        const auto here = node.draw(&source, whole, whole.bounds, nullptr);
        const auto there = node.draw(&source, whole, whole.bounds, gpu.get());
        CHECK(node.by_kernel());
        const auto a = floats(whole, here), b = floats(whole, there);
        for (std::size_t i = 0; i < a.size(); ++i) CHECK(!(std::abs(a[i] - b[i]) > kPromise));
        // And without a source: transparent black.
        const auto nothing = node.draw(nullptr, whole, whole.bounds, gpu.get());
        CHECK(std::all_of(nothing.begin(), nothing.end(), [](auto byte) { return byte == 0; }));
        CHECK(node.by_kernel());
    }
}

TEST(gpu_pictures_without_an_edit_keep_their_bits) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, sidecar("plain.p4d.json", false));
        for (const Layout& layout : gpu_layouts()) {
            const Picture source = source_of(layout);
            CHECK(node.draw(&source, layout, layout.bounds, gpu.get()) ==
                  source.pixels(layout.bounds));
            CHECK(node.by_kernel() == is_rgba_float(layout));
        }
        node.set("sidecar", std::string("nowhere.p4d.json"));
        const Picture source = source_of({});
        CHECK(node.draw(&source, {}, Layout{}.bounds, gpu.get()) == source.pixels(Layout{}.bounds));
    }
}

TEST(gpu_mattes_lightness_and_mix) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        node.set("cleanUp", 0.0);
        for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
            Layout layout;
            layout.premultiplication = alpha;
            const Picture source = source_of(layout);
            node.set("mix", 0.75);
            node.set("keepLightness", 0.5);
            node.set("strength", 0.8);
            for (const int output : {0, 1, 3, 4}) {
                for (const int in_alpha : {0, 1}) {
                    node.set("output", output);
                    node.set("matteIn", in_alpha);
                    node.compare(source, layout.bounds, true);
                }
            }
            node.set("output", 0);
        }
    }
}

TEST(gpu_pictures_in_another_colour_space) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("light.p4d.json", with_conversion(text_with_picks())));
        node.set("cleanUp", 0.0);
        for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
            Layout layout;
            layout.bounds = rect(-9, 4, 78, 60);
            layout.premultiplication = alpha;
            const Picture source = source_of(layout);
            for (const int space : {0, 1}) {
                node.set("pictureIn", space);
                for (const int output : {0, 1, 3, 4}) {
                    node.set("output", output);
                    node.compare(source, layout.bounds, true);
                }
                node.set("output", 0);
                CHECK(node.draw(&source, layout, layout.bounds, gpu.get()) !=
                      source.pixels(layout.bounds));
            }
            node.set("strength", 0.4);
            node.set("mix", 0.5);
            node.set("keepLightness", 0.5);
            node.compare(source, layout.bounds, true);
            for (const char* name : {"strength", "mix"}) node.set(name, 1.0);
            node.set("keepLightness", 0.0);
        }
        Both plain(*gpu, write("plain.p4d.json", with_conversion(sidecar_text(false))));
        const Picture source = source_of({});
        CHECK(plain.draw(&source, {}, Layout{}.bounds, gpu.get()) ==
              source.pixels(Layout{}.bounds));
    }
}

TEST(gpu_what_the_kernel_lacks_is_drawn_on_the_processor) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        Layout layout;
        layout.bounds = rect(-3, 2, 40, 37);
        layout.padding = 16;
        const Picture source = source_of(layout);
        const OfxRectI window = rect(0, 4, 33, 35);
        node.compare(source, window, true);
        node.set("output", 2);  // the palette in the picture
        node.compare(source, window, false);
        node.set("output", 0);
        node.set("gpu", 1);
        node.compare(source, window, false);
        node.set("gpu", 0);
        node.compare(source, window, true);
    }
}

TEST(gpu_pictures_with_a_brush) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        node.instance = node.plugin.create(kOfxImageEffectContextPaint);
        node.set("sidecar", node.path);
        Layout strokes;
        strokes.channels = 1;
        Picture brush(strokes);
        fill(brush, 5, false);
        const Picture source = source_of({});
        for (const Picture* with : {static_cast<const Picture*>(&brush), {}}) {
            node.instance->brush = with;
            const auto here = node.draw(&source, {}, Layout{}.bounds, nullptr);
            CHECK(node.draw(&source, {}, Layout{}.bounds, gpu.get()) == here);
        }
    }
}

TEST(gpu_two_contexts_and_sixteen_instances_at_once) {
    for (const auto& gpu : gpus()) {
        const bool cuda = gpu->device().find("CUDA") != std::string::npos;
        const auto other = cuda ? cuda_gpu() : opencl_gpu();
        Plugin plugin{bundle()};
        const std::string path = sidecar();
        Layout layout;
        layout.bounds = rect(0, 0, 64, 40);
        Picture source(layout);
        fill(source, 3, false);
        std::vector<std::unique_ptr<Instance>> instances;
        for (int i = 0; i < 16; ++i) {
            instances.push_back(plugin.create());
            instances.back()->set("sidecar", path);
        }
        Picture expected(layout);
        instances[0]->gpu = gpu.get();
        CHECK(instances[0]->render(3, &source, expected, layout.bounds) == kOfxStatOK);
        std::atomic<int> wrong{0};
        std::vector<std::thread> threads;
        for (std::size_t t = 0; t < 4; ++t) {
            threads.emplace_back([&, t] {
                const auto own = cuda ? cuda_gpu() : opencl_gpu();
                for (std::size_t round = 0; round < 40; ++round) {
                    Instance& instance = *instances[t * 4 + round % 4];
                    instance.gpu = round % 3 == 0 ? own.get() : (t % 2 ? gpu : other).get();
                    Picture output(layout);
                    wrong += instance.render(3, &source, output, layout.bounds) != kOfxStatOK;
                    wrong += output.pixels(layout.bounds) != expected.pixels(layout.bounds);
                }
            });
        }
        for (std::thread& thread : threads) thread.join();
        CHECK(wrong == 0);
        instances.clear();
        plugin.unload();
    }
}

TEST(gpu_pictures_of_one_pixel_one_row_and_one_column) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        for (const OfxRectI& bounds :
             {rect(-7, 3, -6, 4), rect(0, 0, 32768, 1), rect(5, 0, 6, 32768)}) {
            Layout layout;
            layout.bounds = bounds;
            node.compare(source_of(layout), bounds, true);
        }
    }
}

TEST(gpu_draws_while_anything_takes_the_sidecars_place) {
    // Each picture is the edited one or the source, and never a mixture.
    for (const auto& gpu : gpus()) {
        Plugin plugin{bundle()};
        const std::string path = sidecar(), whole = sidecar_text();
        Layout layout;
        layout.bounds = rect(0, 0, 64, 40);
        Picture source(layout);
        fill(source, 3, false);
        std::vector<std::unique_ptr<Instance>> instances;
        for (int i = 0; i < 4; ++i) {
            instances.push_back(plugin.create());
            instances.back()->set("sidecar", path);
            instances.back()->gpu = gpu.get();
        }
        Picture drawn(layout);
        CHECK(instances[0]->render(3, &source, drawn, layout.bounds) == kOfxStatOK);
        const auto edited = drawn.pixels(layout.bounds), plain = source.pixels(layout.bounds);
        CHECK(edited != plain);
        std::atomic<bool> done{false};
        std::atomic<int> wrong{0}, seen[2] = {};
        std::vector<std::thread> threads;
        for (std::size_t t = 0; t < 4; ++t) {
            threads.emplace_back([&, t] {
                while (!done) {
                    Picture output(layout);
                    const bool ok =
                        instances[t]->render(3, &source, output, layout.bounds) == kOfxStatOK;
                    const auto pixels = output.pixels(layout.bounds);
                    ++(!ok                ? wrong
                       : pixels == edited ? seen[0]
                       : pixels == plain  ? seen[1]
                                          : wrong);
                }
            });
        }
        const auto began = std::chrono::steady_clock::now();
        for (int swap = 0; std::chrono::steady_clock::now() - began < std::chrono::seconds(1) ||
                           ((!seen[0] || !seen[1]) && swap < 10000);
             ++swap) {
            std::error_code refused;  // by Windows, while somebody reads the old file
            std::filesystem::remove_all(path, refused);
            if (swap % 5 == 1) write("clip.p4d.json", whole.substr(0, 500));
            if (swap % 5 == 2) write("clip.p4d.json", sidecar_text(false));
            if (swap % 5 == 3) std::filesystem::create_directory(path, refused);
            if (swap % 5 == 4) write("clip.p4d.json", whole);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        done = true;
        for (std::thread& thread : threads) thread.join();
        std::filesystem::remove_all(path);
        CHECK(wrong == 0);
        CHECK(seen[0] > 0 && seen[1] > 0);
        instances.clear();
        plugin.unload();
    }
}

TEST(gpu_a_queue_that_is_none_is_an_error_of_the_gpu) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu);
        const Picture source = source_of({});
        Picture output({});
        node.instance->extra_arguments["OfxImageEffectPropOpenCLEnabled"] = 1;
        CHECK(node.instance->render(3, &source, output, Layout{}.bounds) == 1002);
        node.instance->extra_arguments.clear();
        CHECK(node.instance->render(3, &source, output, Layout{}.bounds) == kOfxStatOK);
    }
}

TEST(a_host_without_gpus_has_no_parameter_for_them) {
    Plugin plain{bundle()};
    CHECK(plain.create()->effect().params.params.count("gpu") == 0);
    Config config;
    config.gpus = true;
    Host::get().configure(config);
    Plugin plugin{bundle()};
    CHECK(plugin.create()->effect().params.params.count("gpu") == 1);
    CHECK(plugin.describe(kOfxImageEffectContextFilter)
              ->properties.text("OfxImageEffectPropOpenCLRenderSupported") == "true");
}

#if !defined(_WIN32)
TEST(metal_is_offered_only_where_that_is_asked_for) {
    for (const std::string value : {"", "0", "1"}) {
        setenv("PALETTE4D_METAL", value.c_str(), 1);
        Plugin plugin{bundle()};
        plugin.create();
        const auto node = plugin.describe(kOfxImageEffectContextFilter);
        const std::string said = node->properties.text("OfxImageEffectPropMetalRenderSupported");
        CHECK((said == "true") == (value == "1"));
    }
    unsetenv("PALETTE4D_METAL");
}
#endif
