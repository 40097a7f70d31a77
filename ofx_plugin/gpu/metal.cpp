// Metal: the host's queue, and buffers in place of pixels. Written from Apple's documentation, and
// never run: no Mac was at hand.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "gpu/kept.hpp"
#include "gpu/objective_c.hpp"
#include "gpu/queue.hpp"
#include "gpu/text.hpp"

namespace palette4d::gpu {
namespace {

using Handle = ObjectiveC::Handle;
using Size = std::size_t;  // NSUInteger

constexpr long kFailed = 5;        // MTLCommandBufferStatusError
constexpr Size kShared = 0;        // MTLResourceStorageModeShared
constexpr Size kPrivate = 2 << 4;  // MTLResourceStorageModePrivate
constexpr Size kGroup = 64;        // threads of a group
struct Extent {
    Size width, height, depth;
};

struct MetalFunctions : ObjectiveC {
    using ObjectiveC::ObjectiveC;
    PALETTE4D_FUNCTION(void*, objc_autoreleasePoolPush, void);
    PALETTE4D_FUNCTION(void, objc_autoreleasePoolPop, void*);
};

/// Null where there is no Objective-C. Metal itself is where a host has a queue of it.
const MetalFunctions* metal_functions() {
    static const MetalFunctions all(load_library({"/usr/lib/libobjc.A.dylib"}));
    return all.complete ? &all : nullptr;
}

/// What methods return without ownership lives as long as this.
struct Pool {
    const MetalFunctions& mt;
    void* const pool = mt.objc_autoreleasePoolPush();
    explicit Pool(const MetalFunctions& functions) : mt(functions) {}
    ~Pool() { mt.objc_autoreleasePoolPop(pool); }
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;
};

/// An object that is released with this.
struct Owned {
    const MetalFunctions& mt;
    const Handle object;
    Owned(const MetalFunctions& functions, Handle of) : mt(functions), object(of) {}
    ~Owned() { mt.send<void>(object, "release"); }
    Owned(const Owned&) = delete;
    Owned& operator=(const Owned&) = delete;
};

std::string failed(const MetalFunctions& mt, const char* what, Handle error) {
    return driver_error(what, mt.send<long>(error, "code"));
}

/// The kernel on a device.
struct Pipeline : Context {
    const MetalFunctions& mt;
    const Owned device;  ///< kept, so that no other one gets its handle
    std::array<Handle, kKernels.size()> states{};

    Pipeline(const MetalFunctions& functions, Handle of)
        : mt(functions), device(functions, functions.send(of, "retain")) {}
    ~Pipeline() {
        for (const Handle state : states) mt.send<void>(state, "release");
    }

    std::string build() {
        if (states.back()) return "";
        const auto string = [&](const char* text) {
            return mt.send(mt.objc_getClass("NSString"), "stringWithUTF8String:", text);
        };
        const Owned options(mt, mt.send(mt.objc_getClass("MTLCompileOptions"), "new"));
        mt.send<void>(options.object, "setFastMathEnabled:", false);
        Handle error = nullptr;
        const Owned library(mt, mt.send(device.object, "newLibraryWithSource:options:error:",
                                        string(metal_text()), options.object, &error));
        if (!library.object) return failed(mt, "newLibraryWithSource", error);
        for (std::size_t i = 0; i < states.size(); ++i) {
            const Owned function(
                mt, mt.send(library.object, "newFunctionWithName:", string(kKernels[i])));
            if (!function.object) return "newFunctionWithName failed";
            states[i] =
                mt.send(device.object,
                        "newComputePipelineStateWithFunction:error:", function.object, &error);
            if (!states[i]) return failed(mt, "newComputePipelineStateWithFunction", error);
        }
        return "";
    }
};

using Pipelines = Kept<Handle, Pipeline>;

class MetalQueue final : public Queue {
public:
    MetalQueue(const MetalFunctions& functions, Handle queue, Handle device)
        : mt_(functions), queue_(queue), device_(device) {
        pipeline_ = Pipelines::of_process().get(
            device, nullptr, [&] { return std::make_shared<Pipeline>(mt_, device); });
    }

    std::string device() const override {
        const Pool pool(mt_);
        const char* const name = mt_.send<const char*>(mt_.send(device_, "name"), "UTF8String");
        return std::string(name ? name : "") + " (Metal)";
    }

    std::string read(const Place& from, std::size_t bytes, int height, char* to,
                     std::ptrdiff_t row) override {
        const Pool pool(mt_);
        const Rows rows(*this, from, bytes, height);
        const std::string problem = rows.copy(true);
        for (int y = 0; y < height && problem.empty(); ++y) {
            std::memcpy(to + row * y, rows.at(y), bytes);
        }
        return problem;
    }
    std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                      const Place& to) override {
        const Pool pool(mt_);
        const Rows rows(*this, to, bytes, height);
        // What lies between the rows stays.
        const std::string problem = rows.copy(true);
        if (!problem.empty()) return problem;
        for (int y = 0; y < height; ++y) std::memcpy(rows.at(y), from + row * y, bytes);
        return rows.copy(false);
    }

private:
    /// The bytes from the first to the last of an image's rows, in memory that both sides see.
    struct Rows {
        MetalQueue& queue;
        const Place place;
        const std::ptrdiff_t last, start, end;
        const Owned memory;

        // Metal copies four bytes at a time.
        Rows(MetalQueue& in, const Place& of, std::size_t bytes, int height)
            : queue(in),
              place(of),
              last(of.start + of.row * (height - 1)),
              start(std::min(of.start, last) & ~std::ptrdiff_t{3}),
              end((std::max(of.start, last) + static_cast<std::ptrdiff_t>(bytes) + 3) &
                  ~std::ptrdiff_t{3}),
              memory(in.mt_, in.mt_.send(in.device_, "newBufferWithLength:options:",
                                         static_cast<Size>(end - start), kShared)) {}
        char* at(int y) const {
            auto* const bytes = queue.mt_.send<char*>(memory.object, "contents");
            return bytes + (place.start + place.row * y - start);
        }
        std::string copy(bool from_place) const {
            const MetalFunctions& mt = queue.mt_;
            if (start < 0 || static_cast<Size>(end) > mt.send<Size>(place.data, "length")) {
                return "the rows are not within their buffer";
            }
            const Handle work = mt.send(queue.queue_, "commandBuffer");
            const Handle encoder = memory.object ? mt.send(work, "blitCommandEncoder") : nullptr;
            if (!encoder) return "Metal has no memory for a copy";
            const Size size = static_cast<Size>(end - start), there = static_cast<Size>(start);
            mt.send<void>(encoder, "copyFromBuffer:sourceOffset:toBuffer:destinationOffset:size:",
                          from_place ? place.data : memory.object, from_place ? there : Size{0},
                          from_place ? memory.object : place.data, from_place ? Size{0} : there,
                          size);
            mt.send<void>(encoder, "endEncoding");
            return queue.finish(work);
        }
    };

    std::string finish(Handle work) {
        mt_.send<void>(work, "commit");
        mt_.send<void>(work, "waitUntilCompleted");
        if (mt_.send<long>(work, "status") != kFailed) return "";
        return failed(mt_, "a command buffer", mt_.send(work, "error"));
    }

    std::shared_ptr<Context> context() override { return pipeline_; }
    std::string load() override {
        const Pool pool(mt_);
        return pipeline_->build();
    }
    std::string wait() override {
        const Pool pool(mt_);
        const Handle work = mt_.send(queue_, "commandBuffer");
        return work ? finish(work) : "Metal has no command buffer";
    }

    std::string enqueue(const FrameTable& frame, const Window& window) override {
        const Pool pool(mt_);
        const auto buffer = [&](const std::vector<float>& numbers) {
            return mt_.send(device_, "newBufferWithBytes:length:options:",
                            static_cast<const void*>(numbers.data()),
                            numbers.size() * sizeof(float), kShared);
        };
        // Command buffers keep what they use.
        const Owned table(mt_, buffer(frame.table)), grids(mt_, buffer(frame.grids));
        const Handle work = mt_.send(queue_, "commandBuffer");
        if (!table.object || !grids.object) return "Metal has no memory for a frame's tables";
        void* memory = window.out.data;  // where no kernel reads it
        const std::string problem = scratch(frame, queue_, memory);
        if (!problem.empty()) return problem;
        // Its kernels run one after the other.
        const Handle encoder = mt_.send(work, "computeCommandEncoder");
        if (!encoder) return "Metal has no command buffer";
        Size index = 0;
        for (const Handle one :
             {window.in.data, window.out.data, table.object, grids.object, memory}) {
            mt_.send<void>(encoder, "setBuffer:offset:atIndex:", one, Size{0}, index++);
        }
        const auto floats = [](std::ptrdiff_t bytes) {
            return static_cast<std::int32_t>(bytes / 4);
        };
        const std::int32_t numbers[] = {floats(window.in.start),
                                        floats(window.in.row),
                                        floats(window.out.start),
                                        floats(window.out.row),
                                        window.width,
                                        window.height,
                                        window.x1,
                                        window.y1,
                                        window.x2,
                                        window.y2};
        mt_.send<void>(encoder, "setBytes:length:atIndex:", static_cast<const void*>(numbers),
                       sizeof numbers, index);
        for (const Pass& pass : passes_of(frame, window)) {
            const Handle state = pipeline_->states[pass.kernel];
            mt_.send<void>(encoder, "setComputePipelineState:", state);
            const Size threads =
                std::min(kGroup, mt_.send<Size>(state, "maxTotalThreadsPerThreadgroup"));
            const Extent group{threads, 1, 1};
            const Extent groups{(static_cast<Size>(pass.width) + threads - 1) / threads,
                                static_cast<Size>(pass.height), 1};
            mt_.send<void>(encoder, "dispatchThreadgroups:threadsPerThreadgroup:", groups, group);
        }
        mt_.send<void>(encoder, "endEncoding");
        mt_.send<void>(work, "commit");
        return "";
    }

    std::shared_ptr<void> allocate(std::size_t bytes, std::string& problem) override {
        const Handle memory = mt_.send(device_, "newBufferWithLength:options:", bytes, kPrivate);
        if (!memory) problem = "Metal has no memory for the clean-up of picks";
        // Kept, so that no other queue gets its handle.
        return {memory, [&mt = mt_, queue = mt_.send(queue_, "retain")](Handle of) {
                    mt.send<void>(of, "release");
                    mt.send<void>(queue, "release");
                }};
    }

    const MetalFunctions& mt_;
    Handle queue_, device_;
    std::shared_ptr<Pipeline> pipeline_;
};

}  // namespace

std::unique_ptr<Queue> metal_queue(void* queue) {
    const MetalFunctions* const mt = metal_functions();
    const Handle device = mt ? mt->send(queue, "device") : nullptr;
    if (!device) return nullptr;
    return std::make_unique<MetalQueue>(*mt, queue, device);
}

void purge_metal() { Pipelines::of_process().clear(); }

}  // namespace palette4d::gpu
