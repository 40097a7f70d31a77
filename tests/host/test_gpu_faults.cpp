// The node with a driver that fails: each of its calls of OpenCL is refused in turn, by a library
// between it and the real one (opencl_faults.cpp).
#include <cstdlib>

#if defined(__linux__)
#include <dlfcn.h>
#include <link.h>
#include <unistd.h>
#endif

#include <fstream>

#include "gpu_node.hpp"

using namespace strict;
using namespace test;

namespace {

struct Faults {
    bool (*open)(const char*) = nullptr;
    void (*set)(long first, int error, bool all) = nullptr;
    long (*calls)() = nullptr;
    long (*alive)() = nullptr;
};

#if defined(__linux__)
/// Before anything loads OpenCL. The library lies beside this program.
Faults loaded() {
    Faults faults;
    void* const real = dlopen("libOpenCL.so.1", RTLD_NOW);
    link_map* map = nullptr;
    Dl_info own{};
    if (!real || dlinfo(real, RTLD_DI_LINKMAP, &map) ||
        !dladdr(reinterpret_cast<void*>(&loaded), &own)) {
        return faults;
    }
    const std::string path = map->l_name;
    dlclose(real);  // the name is free again
    const std::filesystem::path folder = std::filesystem::path(own.dli_fname).parent_path();
    void* const library =
        dlopen((folder / "libpalette4d_opencl_faults.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) return faults;
    const auto find = [&](const char* name, auto& function) {
        function =
            reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
    };
    find("palette4d_faults_set", faults.set);
    find("palette4d_faults_calls", faults.calls);
    find("palette4d_faults_alive", faults.alive);
    find("palette4d_faults_open", faults.open);
    if (!faults.open || !faults.open(path.c_str())) faults.open = nullptr;
    return faults;
}
#else
Faults loaded() { return {}; }
#endif

const Faults g_faults = loaded();

/// A new context of OpenCL; null where there is none, or no faults.
std::unique_ptr<Gpu> new_context() {
    if (gpus().empty() || !g_faults.open) return nullptr;
    return opencl_gpu();
}

constexpr int kOutOfMemory = -4, kOutOfResources = -5, kBuildFailure = -11;
constexpr int kErrors[] = {kOutOfMemory, kOutOfResources, kBuildFailure};
constexpr OfxStatus kGpuFailed = 1002;

/// Whether two pictures are within the promise of each other.
bool near(const Layout& layout, const std::vector<unsigned char>& one,
          const std::vector<unsigned char>& two) {
    const auto a = floats(layout, one), b = floats(layout, two);
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (std::memcmp(&a[i], &b[i], sizeof(float)) == 0) continue;
        if (!(std::abs(static_cast<double>(a[i]) - b[i]) < kPromise)) return false;
    }
    return true;
}

struct Faulty : Both {
    Layout layout{};
    Picture source{layout};
    std::vector<unsigned char> expected;
    /// With picks that are cleaned up, which takes all kernels.
    explicit Faulty(Gpu& on) : Both(on, write("picks.p4d.json", text_with_picks())) {
        fill(source, 4, false);
        expected = draw(&source, layout, layout.bounds, nullptr);
    }
    OfxStatus render(Gpu& on, Picture& output) {
        instance->gpu = &on;
        const OfxStatus status = instance->render(3, &source, output, layout.bounds);
        instance->gpu = nullptr;
        return status;
    }
    /// Renders a right picture; whether the kernel drew it.
    bool right(Gpu& on) {
        Picture output(layout);
        CHECK(render(on, output) == kOfxStatOK);
        CHECK(near(layout, output.pixels(layout.bounds), expected));
        return by_kernel();
    }
    /// The calls of the first render in a new context, and of one after it.
    std::pair<long, long> calls_of_renders() {
        const auto fresh = new_context();
        g_faults.set(0, 0, false);
        right(*fresh);
        const long first = g_faults.calls();
        g_faults.set(0, 0, false);
        right(*fresh);
        return {first, g_faults.calls()};
    }
};

/// Bytes of this process.
long resident() {
#if defined(__linux__)
    long pages = 0, rest = 0;
    std::ifstream("/proc/self/statm") >> rest >> pages;
    return pages * sysconf(_SC_PAGESIZE);
#else
    return 0;
#endif
}

}  // namespace

TEST(gpu_each_call_of_the_driver_refused_in_turn) {
    const auto gpu = new_context();
    if (!gpu) return;
    {
        Faulty node(*gpu);
        const long calls = node.calls_of_renders().first;
        EXPECT(calls > 20, std::to_string(calls));
        long copied = 0, failed = 0;
        for (long call = 1; call <= calls; ++call) {
            for (long i = call % every(3); i < 3; i += every(3)) {
                const int error = kErrors[i];
                const auto fresh = new_context();
                Picture output(node.layout);
                g_faults.set(call, error, false);
                const OfxStatus status = node.render(*fresh, output);
                g_faults.set(0, 0, false);
                EXPECT(status == kOfxStatOK || status == kGpuFailed, std::to_string(status));
                failed += status != kOfxStatOK;
                if (status != kOfxStatOK) continue;
                CHECK(near(node.layout, output.pixels(node.layout.bounds), node.expected));
                const std::string said = node.status();
                if (said.find("copied") == std::string::npos) continue;
                ++copied;
                const bool told =
                    said.find("failed with error " + std::to_string(error)) != std::string::npos ||
                    said.find("too little constant memory") != std::string::npos;
                EXPECT(told, said);
                // That context is not asked again; others are.
                CHECK(!node.right(*fresh));
                EXPECT(node.status().find(said.substr(said.rfind(": "))) != std::string::npos,
                       node.status());
                CHECK(node.right(*gpu));
            }
        }
        figure(std::to_string(calls) + " calls refused: " + std::to_string(copied) +
               " pictures were copied, " + std::to_string(failed) + " without a queue failed");
        CHECK(copied >= 20);
        CHECK(failed <= 3 * 4);
    }
    CHECK(g_faults.alive() == 0);
}

TEST(gpu_copies_keep_their_memory_for_the_next_frame) {
    const auto gpu = new_context();
    if (!gpu) return;
    {
        Faulty node(*gpu);
        node.set("gpu", 1);
        const auto [first, next] = node.calls_of_renders();
        // A buffer, its mapping and its queue, for the source and for the result.
        EXPECT(first >= next + 2 * 3, std::to_string(first) + " " + std::to_string(next));
        CHECK(!node.right(*gpu));
        const long objects = g_faults.alive();
        for (int i = 0; i < 20; ++i) node.right(*gpu);
        CHECK(g_faults.alive() == objects);
        // Each refused: then the memory is ordinary, or there is no picture.
        long failed = 0;
        for (long call = 1; call <= first; ++call) {
            const auto fresh = new_context();
            Picture output(node.layout);
            g_faults.set(call, kOutOfMemory, false);
            const OfxStatus status = node.render(*fresh, output);
            g_faults.set(0, 0, false);
            EXPECT(status == kOfxStatOK || status == kGpuFailed, std::to_string(status));
            failed += status != kOfxStatOK;
            const auto drawn = output.pixels(node.layout.bounds);
            CHECK(status != kOfxStatOK || near(node.layout, drawn, node.expected));
            node.right(*fresh);
        }
        // The queue's context and device, two copies and what they wait for.
        EXPECT(failed <= 6, std::to_string(failed));
    }
    CHECK(g_faults.alive() == 0);
}

TEST(gpu_a_context_goes_with_its_last_node) {
    const auto one = new_context(), two = new_context();
    if (!one) return;
    Faulty first(*one);
    first.right(*one);
    const long objects = g_faults.alive();
    CHECK(objects > 0);
    {
        Faulty second(*two);
        second.right(*two);
        second.right(*one);
        CHECK(g_faults.alive() == 2 * objects);
        second.instance.reset();
        // Without another action: the first node goes on with its context.
        CHECK(g_faults.alive() == objects);
        g_faults.set(0, 0, false);
        CHECK(first.right(*one));
    }
    Faulty third(*one);
    CHECK(third.right(*one));
    CHECK(first.right(*one));
    first.instance.reset();
    CHECK(g_faults.alive() == objects);
    third.instance.reset();
    CHECK(g_faults.alive() == 0);
}

TEST(gpu_tables_of_the_last_frame_stay_on_the_device) {
    const auto gpu = new_context();
    if (!gpu) return;
    Faulty node(*gpu);
    // The first frames are timed, which takes calls.
    for (int frame = 0; frame < 4; ++frame) node.right(*gpu);
    const auto calls = [&](double strength) {
        node.set("strength", strength);
        Picture output(node.layout);
        g_faults.set(0, 0, false);
        CHECK(node.render(*gpu, output) == kOfxStatOK);
        return g_faults.calls();
    };
    const long same = calls(1);
    CHECK(calls(0.5) == same + 1);  // the table; the grids are the same
    CHECK(calls(0.5) == same);
    CHECK(calls(1) == same + 1);
    CHECK(node.right(*gpu));
}

TEST(gpu_a_lost_device) {
    const auto gpu = new_context();
    if (!gpu) return;
    {
        Faulty node(*gpu);
        const long calls = node.calls_of_renders().first;
        for (long call = 1; call <= calls; call += every(3)) {
            const auto fresh = new_context();
            if (call % 2) node.right(*fresh);  // lost at a later frame
            g_faults.set(call, kOutOfResources, true);
            for (int again = 0; again < 3; ++again) {
                Picture output(node.layout);
                const OfxStatus status = node.render(*fresh, output);
                if (status == kOfxStatOK) {
                    CHECK(near(node.layout, output.pixels(node.layout.bounds), node.expected));
                } else {
                    EXPECT(status == kGpuFailed, std::to_string(status));
                }
            }
            g_faults.set(0, 0, false);
            CHECK(node.right(*gpu));
        }
    }
    CHECK(g_faults.alive() == 0);
}

TEST(gpu_a_new_context_at_an_old_ones_address) {
    const auto gpu = new_context();
    if (!gpu) return;
    Faulty node(*gpu);
    for (int round = 0; round < 12; ++round) {
        auto first = new_context();
        Picture output(node.layout);
        g_faults.set(5, kOutOfMemory, true);  // before there is a program
        node.render(*first, output);
        g_faults.set(0, 0, false);
        first.reset();
        const auto second = new_context();
        CHECK(node.right(*second));
    }
}

TEST(gpu_memory_stays_flat) {
    const auto gpu = new_context();
    if (!gpu) return;
    // All of it where every call is asked for.
    const long frames = 10000 / every(10), contexts = 100 / every(4);
    {
        Faulty node(*gpu);
        const auto draw = [&](long count) {
            for (long i = 0; i < count; ++i) {
                Picture output(node.layout);
                CHECK(node.render(*gpu, output) == kOfxStatOK);
            }
        };
        draw(frames / 5);
        const long objects = g_faults.alive(), before = resident();
        draw(frames);
        const long grown = resident() - before;
        CHECK(g_faults.alive() == objects);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they keep what was freed
        EXPECT(grown < 4 << 20, std::to_string(grown));
#endif
        for (long i = 0; i < contexts; ++i) {
            const auto fresh = new_context();
            CHECK(node.right(*fresh));
            // A program and its context, the passes' memory and its queue, the table and the grids.
            EXPECT(g_faults.alive() <= 6 * 8, std::to_string(g_faults.alive()));
        }
        figure(std::to_string(frames) + " frames: " + std::to_string(grown / 1024) + " KB more; " +
               std::to_string(contexts) + " contexts: " + std::to_string(g_faults.alive()) +
               " objects");
    }
    CHECK(g_faults.alive() == 0);
}
