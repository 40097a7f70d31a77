// The clean-up of picks on a GPU: whole pictures, tiles, render scales, alpha, colour spaces,
// threads.
#include <algorithm>
#include <atomic>
#include <functional>
#include <map>
#include <thread>

#include "gpu_node.hpp"
#include "tiles.hpp"

using namespace strict;
using namespace test;

namespace {

/// Areas of the picked colours, and noise.
Picture areas_of(const Layout& layout, bool odd_values = false) {
    Picture picture(layout);
    fill(picture, 7, odd_values);
    const bool premultiplied = layout.premultiplication == std::string(kOfxImagePreMultiplied);
    constexpr float kColours[3][3] = {{0.7f, 0.3f, 0.25f}, {0.3f, 0.5f, 0.3f}, {0.2f, 0.3f, 0.7f}};
    const OfxRectI& b = layout.bounds;
    for (int y = b.y1; y < b.y2; ++y) {
        for (int x = b.x1; x < b.x2; ++x) {
            float* const pixel = picture.floats(x, y);
            const int area = ((x - b.x1) / 19 + (y - b.y1) / 23) % 3;
            for (int c = 0; c < 3; ++c) {
                if (!std::isfinite(pixel[c]) || std::abs(pixel[c]) > 2) continue;
                pixel[c] = kColours[area][c] + 0.1f * pixel[c];
                if (premultiplied) pixel[c] *= pixel[3];
            }
        }
    }
    return picture;
}

Layout layout_of(const OfxRectI& bounds) {
    Layout layout;
    layout.bounds = bounds;
    return layout;
}

}  // namespace

TEST(gpu_picks_are_cleaned_up) {
    for (const auto& gpu : gpus()) {
        for (const bool moves : {false, true}) {
            Both node(*gpu, write("picks.p4d.json", text_with_picks(moves)));
            for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
                Layout layout = layout_of(rect(-9, 4, 78, 60));
                layout.premultiplication = alpha;
                const Picture source = areas_of(layout, true);
                for (const double amount : {1.0, 0.5}) {
                    node.set("cleanUp", amount);
                    for (const int output : {0, 1, 3, 4}) {
                        node.set("output", output);
                        node.compare(source, layout.bounds, true);
                        node.compare(source, rect(3, 11, 70, 38), true);
                    }
                    node.set("output", 0);
                    node.set("strength", 0.8);
                    node.set("keepLightness", 0.4);
                    node.compare(source, layout.bounds, true);
                    node.set("strength", 1.0);
                    node.set("keepLightness", 0.0);
                }
                const auto cleaned = node.draw(&source, layout, layout.bounds, gpu.get());
                node.set("cleanUp", 0.0);
                CHECK(node.draw(&source, layout, layout.bounds, gpu.get()) != cleaned);
            }
        }
    }
}

TEST(gpu_cleans_up_at_each_render_scale) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        for (const double scale : {0.25, 0.7, 16.0}) {
            Layout layout = layout_of(rect(-20, -7, 101, 66));
            layout.scale = scale;
            const Picture source = areas_of(layout);
            node.compare(source, layout.bounds, true);
            node.compare(source, rect(30, 2, 55, 31), true);
        }
    }
}

TEST(gpu_tiles_with_their_region_of_interest_are_the_whole_picture) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        const Layout layout = layout_of(rect(-30, 11, 133, 94));
        const Picture source = areas_of(layout);
        const auto whole = floats(layout, node.draw(&source, layout, layout.bounds, nullptr));
        Picture tiles(layout);
        each_tile(layout.bounds, [&](const OfxRectI& window, std::array<double, 4> region) {
            CHECK(node.instance->region_of_interest(3, 1, region) == kOfxStatOK);
            const Picture part = part_of(source, within(region, layout.bounds), 16);
            node.instance->gpu = gpu.get();
            CHECK(node.instance->render(3, &part, tiles, window) == kOfxStatOK);
            node.instance->gpu = nullptr;
            CHECK(node.by_kernel());
            // A host that gives less: what there is, as on the processor.
            const OfxRectI fewer =
                within({double(window.x1), double(window.y1), window.x1 + 30.0, window.y1 + 40.0},
                       layout.bounds);
            const Picture less = part_of(source, fewer, 16);
            Picture here(layout), there(layout);
            CHECK(node.instance->render(3, &less, here, window) == kOfxStatOK);
            node.instance->gpu = gpu.get();
            CHECK(node.instance->render(3, &less, there, window) == kOfxStatOK);
            node.instance->gpu = nullptr;
            const auto a = floats(layout, here.pixels(window)),
                       b = floats(layout, there.pixels(window));
            for (std::size_t i = 0; i < a.size(); ++i) {
                CHECK(!(std::abs(a[i] - b[i]) > kPromise * std::max(1.0f, std::abs(a[i]))));
            }
        });
        const auto drawn = floats(layout, tiles.pixels(layout.bounds));
        for (std::size_t i = 0; i < whole.size(); ++i) {
            CHECK(!(std::abs(whole[i] - drawn[i]) > kPromise * std::max(1.0f, std::abs(whole[i]))));
        }
    }
}

TEST(gpu_cleans_up_in_another_colour_space) {
    for (const auto& gpu : gpus()) {
        Both node(*gpu, write("light.p4d.json", with_conversion(text_with_picks())));
        for (const char* alpha : {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied}) {
            Layout layout = layout_of(rect(-9, 4, 78, 60));
            layout.premultiplication = alpha;
            const Picture source = areas_of(layout);
            for (const int output : {0, 4}) {
                node.set("output", output);
                node.compare(source, layout.bounds, true);
            }
            node.set("output", 0);
        }
    }
}

TEST(gpu_threads_and_queues_share_no_passes) {
    for (const auto& gpu : gpus()) {
        const bool cuda = gpu->device().find("CUDA") != std::string::npos;
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        std::vector<Picture> sources;
        std::vector<std::vector<unsigned char>> expected;
        for (const int size : {40, 64, 96}) {
            const Layout layout = layout_of(rect(0, 0, size, size / 2));
            sources.push_back(areas_of(layout));
            expected.push_back(node.draw(&sources.back(), layout, layout.bounds, gpu.get()));
        }
        std::vector<std::unique_ptr<Instance>> instances;
        for (int i = 0; i < 6; ++i) {
            instances.push_back(node.plugin.create());
            instances.back()->set("sidecar", node.path);
        }
        std::atomic<int> wrong{0};
        std::vector<std::thread> threads;
        for (std::size_t t = 0; t < instances.size(); ++t) {
            threads.emplace_back([&, t] {
                const auto own = cuda ? cuda_gpu() : opencl_gpu();
                Instance& instance = *instances[t];
                for (std::size_t round = 0; round < 20; ++round) {
                    instance.gpu = round % 2 ? own.get() : gpu.get();
                    const std::size_t i = (t + round) % sources.size();
                    const Layout& layout = sources[i].layout();
                    Picture output(layout);
                    wrong += instance.render(3, &sources[i], output, layout.bounds) != kOfxStatOK;
                    wrong += output.pixels(layout.bounds) != expected[i];
                }
            });
        }
        for (std::thread& thread : threads) thread.join();
        CHECK(wrong == 0);
        instances.clear();
    }
}

TEST(gpu_frames_that_nobody_waits_for_share_no_passes) {
    for (const auto& gpu : gpus()) {
        const bool cuda = gpu->device().find("CUDA") != std::string::npos;
        Both node(*gpu, write("picks.p4d.json", text_with_picks()));
        std::atomic<int> wrong{0};
        const auto draw = [&](Instance& instance, const Picture& source,
                              const std::vector<unsigned char>& expected) {
            // CUDA's stream of a thread has the same handle in each of them.
            const auto own = cuda ? cuda_gpu(Stream::kOfThread) : opencl_gpu();
            std::vector<Picture> outputs(8, Picture(source.layout()));
            std::map<const Picture*, void*> memory;
            const auto allocate = [&](const Picture& of) {
                Picture& picture = const_cast<Picture&>(of);
                memory[&of] = own->allocate(picture.rest(), picture.rest_size());
            };
            allocate(source);
            for (const Picture& output : outputs) allocate(output);
            instance.gpu = own.get();
            for (int round = 0; round < 5; ++round) {
                for (Picture& output : outputs) {
                    wrong += instance.render_there(3, source, output, memory) != kOfxStatOK;
                }
                for (Picture& output : outputs) {
                    own->download(memory[&output], output.rest(), output.rest_size());
                    wrong += output.pixels(output.layout().bounds) != expected;
                }
            }
            for (const auto& [picture, at] : memory) own->release(at);
        };
        std::vector<std::unique_ptr<Instance>> instances;
        std::vector<Picture> sources;
        std::vector<std::vector<unsigned char>> expected;
        for (int t = 0; t < 4; ++t) {
            // So large that frames of several threads run at once, and each of another size.
            const Layout layout = layout_of(rect(0, 0, (cuda ? 640 : 64) - 8 * t, cuda ? 360 : 36));
            sources.push_back(areas_of(layout));
            expected.push_back(node.draw(&sources.back(), layout, layout.bounds, gpu.get()));
            instances.push_back(node.plugin.create());
            instances.back()->set("sidecar", node.path);
        }
        std::vector<std::thread> threads;
        for (std::size_t t = 0; t < instances.size(); ++t) {
            threads.emplace_back(draw, std::ref(*instances[t]), std::cref(sources[t]),
                                 std::cref(expected[t]));
        }
        for (std::thread& thread : threads) thread.join();
        CHECK(wrong == 0);
        instances.clear();
    }
}
