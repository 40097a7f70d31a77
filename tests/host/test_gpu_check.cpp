// What tools/gpu_check.sh measures on a machine with a GPU: the node's errors from double precision
// and its speed, for the sidecars in the folder PALETTE4D_GPU_CHECK. Without it nothing is done.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <random>

#include "harness.hpp"
#include "model/vec3.hpp"
#include "strict_gpu.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;
using palette4d::operator+;
using palette4d::operator*;

namespace {

std::vector<std::string> sidecars_to_check() {
    const char* const given = std::getenv("PALETTE4D_GPU_CHECK");
    std::vector<std::string> all;
    if (!given) return all;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::u8path(given))) {
        if (entry.path().extension() == ".json") all.push_back(entry.path().u8string());
    }
    std::sort(all.begin(), all.end());
    return all;
}

std::vector<std::unique_ptr<Gpu>> gpus_to_check() {
    Config config;
    config.gpus = true;
    config.processors = 16;
    Host::get().configure(config);
    std::vector<std::unique_ptr<Gpu>> all;
    for (const Stream stream : {Stream::kOwn, Stream::kNone}) {
        if (auto gpu = cuda_gpu(stream)) all.push_back(std::move(gpu));
    }
    if (auto gpu = opencl_gpu()) all.push_back(std::move(gpu));
    return all;
}

struct Checked : Ready {
    explicit Checked(const std::string& of) : Ready(of) { set("cleanUp", 0.0); }
    const palette4d::ColourConversion* conversion() const {
        return parsed.conversion ? &parsed.conversion->steps : nullptr;
    }
    Vec3 in_palette(const float* pixel) const {
        const Vec3 colour{pixel[0], pixel[1], pixel[2]};
        return conversion() ? conversion()->to_palette(colour) : colour;
    }
    bool picks() const { return !parsed.edits.picks.empty(); }
    bool by_kernel() {
        CHECK(instance->changed("", "", kOfxChangeTime) == kOfxStatOK);
        const std::string status = instance->text("status");
        const bool so =
            status.find("GPU: ") != std::string::npos && status.find("copied") == std::string::npos;
        EXPECT(so, status);
        return so;
    }
};

/// Colours anywhere around the palette, and at 1e-8 to 1e-2 from its faces, edges and vertices.
void fill_near(Picture& picture, const Checked& node) {
    const palette4d::Slice slice = palette4d::slice_at(node.parsed.polytope, 15);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-0.2, 1.2), share(0, 1);
    std::normal_distribution<double> away(0, 1);
    const OfxRectI& b = picture.layout().bounds;
    for (int y = b.y1; y < b.y2; ++y) {
        for (int x = b.x1; x < b.x2; ++x) {
            Vec3 colour{any(random), any(random), any(random)};
            if (y % 2 == 0) {
                const auto& face = slice.faces[random() % slice.faces.size()];
                double i = share(random), j = x % 3 == 0 ? 0.0 : share(random),
                       k = x % 3 == 1 ? 0.0 : share(random);
                const double sum = i + j + k, step = std::pow(10, -2.0 - 6 * share(random));
                colour = (i / sum) * slice.rgb[static_cast<std::size_t>(face[0])] +
                         (j / sum) * slice.rgb[static_cast<std::size_t>(face[1])] +
                         (k / sum) * slice.rgb[static_cast<std::size_t>(face[2])] +
                         step * Vec3{away(random), away(random), away(random)};
            }
            if (node.conversion()) colour = node.conversion()->to_clip(colour);
            for (std::size_t c = 0; c < 3; ++c)
                picture.floats(x, y)[c] = static_cast<float>(colour[c]);
            picture.floats(x, y)[3] = 1;
        }
    }
}

/// Colours as clips have them: areas within the palette, with grain.
void fill_within(Picture& picture, const Checked& node) {
    const palette4d::Slice slice = palette4d::slice_at(node.parsed.polytope, 15);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> share(0, 1), grain(-0.01f, 0.01f);
    const OfxRectI& b = picture.layout().bounds;
    for (int y = b.y1; y < b.y2; y += 40) {
        for (int x = b.x1; x < b.x2; x += 60) {
            Vec3 colour{};
            double shares = 0;
            for (int n = 0; n < 4; ++n) {
                const double part = share(random) + 1e-3;
                colour = colour + part * slice.rgb[random() % slice.rgb.size()];
                shares += part;
            }
            colour = (1 / shares) * colour;
            if (node.conversion()) colour = node.conversion()->to_clip(colour);
            for (int v = y; v < std::min(y + 40, b.y2); ++v) {
                for (int u = x; u < std::min(x + 60, b.x2); ++u) {
                    float* const pixel = picture.floats(u, v);
                    for (std::size_t c = 0; c < 3; ++c) {
                        pixel[c] = static_cast<float>(colour[c]) + grain(random);
                    }
                    pixel[3] = 1;
                }
            }
        }
    }
}

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

std::string name_of(const std::string& path) {
    return std::filesystem::u8path(path).stem().stem().u8string();
}

}  // namespace

TEST(gpu_check_errors) {
    for (const std::string& path : sidecars_to_check()) {
        Layout layout;
        layout.bounds = rect(0, 0, 512, 384);
        for (const auto& gpu : gpus_to_check()) {
            Checked node(path);
            const double frame = 15;
            const auto slice = palette4d::slice_at(node.parsed.polytope, frame);
            Picture source(layout), output(layout);
            fill_near(source, node);
            node.instance->gpu = gpu.get();
            // The host's time 0 is the clip's first frame.
            CHECK(node.instance->render(frame - static_cast<double>(node.parsed.clip.first),
                                        &source, output, layout.bounds) == kOfxStatOK);
            node.by_kernel();
            const palette4d::Recolourer exact(
                slice.rgb,
                palette4d::edited_colours(node.parsed.polytope, node.parsed.edits, slice),
                slice.faces, palette4d::picks_at(node.parsed.edits, frame));
            const std::vector<float> from = floats(layout, source.pixels(layout.bounds)),
                                     found = floats(layout, output.pixels(layout.bounds));
            std::vector<float> expected(from.size());
            palette4d::RecolourOptions options;
            options.precision = palette4d::Precision::kDouble;
            options.threads = 0;
            options.conversion = node.conversion();
            const int width = layout.width(), height = layout.height();
            exact.apply({from.data(), width, height, 4, width * 16},
                        {expected.data(), width, height, 4, width * 16}, options);
            double worst = 0, sum = 0, moved = 0;
            for (std::size_t i = 0; i < from.size(); i += 4) {
                const Vec3 was = node.in_palette(&from[i]), is = node.in_palette(&found[i]),
                           right = node.in_palette(&expected[i]);
                for (std::size_t c = 0; c < 3; ++c) {
                    const double error = std::abs(is[c] - right[c]);
                    worst = std::max(worst, std::isfinite(error) ? error : 1e9);
                    sum += error;
                    moved = std::max(moved, std::abs(right[c] - was[c]));
                }
            }
            char line[256];
            std::snprintf(line, sizeof line, "%-12s %-40s largest error %.2e, mean %.2e",
                          name_of(path).c_str(), gpu->device().c_str(), worst,
                          sum / static_cast<double>(from.size() / 4 * 3));
            figure(line);
            CHECK(worst < 1e-4);
            CHECK(moved > 0.05);
        }
    }
}

TEST(gpu_check_clean_up) {
    for (const std::string& path : sidecars_to_check()) {
        Layout layout;
        layout.bounds = rect(0, 0, 512, 384);
        for (const auto& gpu : gpus_to_check()) {
            Checked node(path);
            if (!node.picks()) break;
            node.set("cleanUp", 1.0);
            Picture source(layout), here(layout), there(layout);
            fill_near(source, node);
            CHECK(node.instance->render(5, &source, here, layout.bounds) == kOfxStatOK);
            node.instance->gpu = gpu.get();
            CHECK(node.instance->render(5, &source, there, layout.bounds) == kOfxStatOK);
            node.by_kernel();
            double worst = 0;
            for (int y = 0; y < 384; ++y) {
                for (int x = 0; x < 512; ++x) {
                    const Vec3 one = node.in_palette(here.floats(x, y)),
                               two = node.in_palette(there.floats(x, y));
                    for (std::size_t c = 0; c < 3; ++c) {
                        const double error = std::abs(one[c] - two[c]);
                        worst = std::max(worst, std::isfinite(error) ? error : 1e9);
                    }
                }
            }
            char line[256];
            std::snprintf(line, sizeof line, "%-12s %-40s cleaned up, off the processor %.2e",
                          name_of(path).c_str(), gpu->device().c_str(), worst);
            figure(line);
            CHECK(worst < 1e-4);
        }
    }
}

TEST(gpu_check_speed) {
    for (const std::string& path : sidecars_to_check()) {
        Layout layout;
        layout.bounds = rect(0, 0, 3840, 2160);
        Picture source(layout), within(layout), output(layout);
        bool filled = false;
        for (const auto& gpu : gpus_to_check()) {
            Checked node(path);
            if (!filled) {
                fill_near(source, node);
                fill_within(within, node);
            }
            filled = true;
            std::map<const Picture*, void*> memory;
            for (Picture* picture : {&source, &output}) {
                memory[picture] = gpu->allocate(picture->rest(), picture->rest_size());
            }
            node.instance->gpu = gpu.get();
            const auto draw = [&](double time) {
                CHECK(node.instance->render_there(time, source, output, memory) == kOfxStatOK);
            };
            // On a processor a frame takes seconds.
            const auto began = std::chrono::steady_clock::now();
            draw(5);
            gpu->finish();
            const double first = milliseconds_since(began);
            const int frames = first > 2000 ? 1 : 100;
            const auto measured = [&](const auto& each) {
                for (int i = 0; i < std::min(frames, 5); ++i) each(i);
                gpu->finish();
                const auto start = std::chrono::steady_clock::now();
                for (int i = 0; i < frames; ++i) each(i);
                gpu->finish();
                return milliseconds_since(start) / frames;
            };
            const double still = measured([&](int) { draw(5); });
            const double playing = measured([&](int i) { draw(1 + i % 9 + 0.01 * i); });
            node.set("cleanUp", 1.0);
            const double cleaned = node.picks() ? measured([&](int) { draw(5); }) : 0;
            node.set("cleanUp", 0.0);
            gpu->upload(memory[&source], within.rest(), within.rest_size());
            const double clip = measured([&](int) { draw(5); });
            const auto copies = [&](int i) {
                if (i % 10) return;  // some are enough
                gpu->upload(memory[&source], source.rest(), source.rest_size());
                draw(5);
                gpu->download(memory[&output], output.rest(), output.rest_size());
            };
            const double times = frames > 1 ? 10 : 1;
            const double copied = times * measured(copies);
            const bool pins = gpu->pin(source.rest(), source.rest_size()) &&
                              gpu->pin(output.rest(), output.rest_size());
            const double pinned = pins ? times * measured(copies) : copied;
            node.by_kernel();
            char line[256];
            std::snprintf(line, sizeof line,
                          "%-12s %-40s UHD %7.2f ms a frame, %7.2f as in clips, %7.2f cleaned up, "
                          "%7.2f through time, %7.2f with copies, %7.2f %s; the first %.0f ms",
                          name_of(path).c_str(), gpu->device().c_str(), still, clip, cleaned,
                          playing, copied, pinned, pins ? "of pinned memory" : "again", first);
            figure(line);
            for (Picture* picture : {&source, &output}) {
                if (pins) gpu->unpin(picture->rest());
            }
            for (const auto& [picture, at] : memory) gpu->release(at);
        }
    }
}
