// CUDA's driver interface: the host's stream, and pointers of the device in place of pixels.
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "gpu/kept.hpp"
#include "gpu/queue.hpp"
#include "gpu/text.hpp"

namespace palette4d::gpu {
namespace {

// The part of the driver's interface that is used here, written from its documentation.
using Handle = void*;
using Pointer = std::uint64_t;

constexpr int kMostShared = 8;    // CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES
constexpr unsigned kUntimed = 2;  // CU_EVENT_DISABLE_TIMING
constexpr unsigned kThreads = 128, kRows = 8;

struct CudaFunctions : Functions {
    using Functions::Functions;
    PALETTE4D_FUNCTION(int, cuInit, unsigned);
    PALETTE4D_FUNCTION(int, cuCtxGetCurrent, Handle*);
    PALETTE4D_FUNCTION(int, cuCtxGetDevice, int*);
    PALETTE4D_FUNCTION(int, cuCtxPushCurrent_v2, Handle);
    PALETTE4D_FUNCTION(int, cuCtxPopCurrent_v2, Handle*);
    PALETTE4D_FUNCTION(int, cuStreamGetCtx, Handle, Handle*);
    PALETTE4D_FUNCTION(int, cuDeviceGetName, char*, int, int);
    PALETTE4D_FUNCTION(int, cuModuleLoadData, Handle*, const void*);
    PALETTE4D_FUNCTION(int, cuModuleUnload, Handle);
    PALETTE4D_FUNCTION(int, cuModuleGetFunction, Handle*, Handle, const char*);
    PALETTE4D_FUNCTION(int, cuFuncSetAttribute, Handle, int, int);
    PALETTE4D_FUNCTION(int, cuLaunchKernel, Handle, unsigned, unsigned, unsigned, unsigned,
                       unsigned, unsigned, unsigned, Handle, void**, void**);
    PALETTE4D_FUNCTION(int, cuMemAlloc_v2, Pointer*, std::size_t);
    PALETTE4D_FUNCTION(int, cuMemFree_v2, Pointer);
    PALETTE4D_FUNCTION(int, cuMemAllocHost_v2, void**, std::size_t);
    PALETTE4D_FUNCTION(int, cuMemFreeHost, void*);
    PALETTE4D_FUNCTION(int, cuMemcpyHtoDAsync_v2, Pointer, const void*, std::size_t, Handle);
    PALETTE4D_FUNCTION(int, cuMemcpyDtoHAsync_v2, void*, Pointer, std::size_t, Handle);
    PALETTE4D_FUNCTION(int, cuStreamSynchronize, Handle);
    PALETTE4D_FUNCTION(int, cuStreamWaitEvent, Handle, Handle, unsigned);
    PALETTE4D_FUNCTION(int, cuEventCreate, Handle*, unsigned);
    PALETTE4D_FUNCTION(int, cuEventRecord, Handle, Handle);
    bool usable = complete && cuInit(0) == 0;
    // Since CUDA 11.2, and 12.0: null in older drivers.
    PALETTE4D_FUNCTION(int, cuMemAllocAsync, Pointer*, std::size_t, Handle);
    PALETTE4D_FUNCTION(int, cuMemFreeAsync, Pointer, Handle);
    PALETTE4D_FUNCTION(int, cuCtxGetId, Handle, unsigned long long*);
};

/// Null where CUDA is not here.
const CudaFunctions* cuda_functions() {
    static const CudaFunctions all(load_library({"libcuda.so.1", "libcuda.so", "nvcuda.dll"}));
    return all.usable ? &all : nullptr;
}

/// The kernel in a context.
struct Module : Context {
    Handle module = nullptr;
    std::array<Handle, kKernels.size()> functions{};
    Handle passed = nullptr;  ///< an event: after the last passes that left each other something

    std::string load(const CudaFunctions& cu) {
        if (functions.back()) return "";
        int error = cu.cuEventCreate(&passed, kUntimed);
        if (error) return driver_error("cuEventCreate", error);
        error = cu.cuModuleLoadData(&module, cuda_ptx());
        if (error) return driver_error("cuModuleLoadData", error);
        for (std::size_t i = 0; i < kKernels.size(); ++i) {
            error = cu.cuModuleGetFunction(&functions[i], module, kKernels[i]);
            if (error) return driver_error("cuModuleGetFunction", error);
            // What a device lacks shows when a table of that size is drawn.
            cu.cuFuncSetAttribute(functions[i], kMostShared, kMostTable * sizeof(float));
        }
        return "";
    }
};

using CudaKey =
    std::pair<Handle, unsigned long long>;  ///< context, and its number where it has one
CudaKey current_context(const CudaFunctions& cu) {
    CudaKey key{nullptr, 0};
    if (cu.cuCtxGetCurrent(&key.first)) return {nullptr, 0};
    if (cu.cuCtxGetId) cu.cuCtxGetId(key.first, &key.second);
    return key;
}

/// Modules and events go with their context alone, which may be gone when they are dropped.
using Modules = Kept<CudaKey, Module>;

class CudaQueue final : public Queue {
public:
    CudaQueue(const CudaFunctions& functions, Handle stream, bool waits, Handle context, bool push)
        : cu_(functions), stream_(stream), waits_(waits), push_(push) {
        if (push_) cu_.cuCtxPushCurrent_v2(context);
        key_ = current_context(cu_);
        module_ =
            Modules::of_process().get(key_, nullptr, [] { return std::make_shared<Module>(); });
    }
    ~CudaQueue() override {
        Handle context = nullptr;
        if (push_) cu_.cuCtxPopCurrent_v2(&context);
    }

    std::string device() const override {
        int device = 0;
        char name[256] = "";
        if (cu_.cuCtxGetDevice(&device) == 0) cu_.cuDeviceGetName(name, sizeof name - 1, device);
        return std::string(name) + " (CUDA)";
    }

    std::string read(const Place& from, std::size_t bytes, int height, char* to,
                     std::ptrdiff_t row) override {
        return each_row(from, bytes, height, row, [&](std::ptrdiff_t at, std::size_t size, int y) {
            return cu_.cuMemcpyDtoHAsync_v2(to + row * y, address(from, at), size, stream_);
        });
    }
    std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                      const Place& to) override {
        return each_row(to, bytes, height, row, [&](std::ptrdiff_t at, std::size_t size, int y) {
            return cu_.cuMemcpyHtoDAsync_v2(address(to, at), from + row * y, size, stream_);
        });
    }

private:
    static Pointer address(const Place& place, std::ptrdiff_t at) {
        return reinterpret_cast<Pointer>(place.data) + static_cast<Pointer>(at);
    }

    /// Memory of a stream, or of the context where a driver or a device has no other.
    struct Memory {
        const CudaFunctions& cu;
        Handle stream;
        Pointer at = 0;
        int error = 0;
        bool of_stream;
        Memory(const CudaFunctions& functions, std::size_t size, Handle of)
            : cu(functions),
              stream(of),
              of_stream(cu.cuMemFreeAsync && cu.cuMemAllocAsync(&at, size, stream) == 0) {
            if (!of_stream) error = cu.cuMemAlloc_v2(&at, size);
            if (error) at = 0;
        }
        ~Memory() {
            if (!at) return;
            if (of_stream) {
                cu.cuMemFreeAsync(at, stream);
            } else {
                cu.cuMemFree_v2(at);  // waits for what uses it
            }
        }
        Memory(const Memory&) = delete;
        Memory& operator=(const Memory&) = delete;
    };

    std::shared_ptr<Context> context() override { return module_; }
    std::string load() override { return module_->load(cu_); }
    std::string wait() override {
        const int error = cu_.cuStreamSynchronize(stream_);
        return error ? driver_error("cuStreamSynchronize", error) : "";
    }

    std::string enqueue(const FrameTable& frame, const Window& window) override {
        const std::size_t table = frame.table.size() * sizeof(float);
        const std::size_t grids = frame.grids.size() * sizeof(float);
        const Memory memory(cu_, table + grids, stream_);
        if (!memory.at) return driver_error("cuMemAlloc", memory.error);
        // From ordinary memory: these return when it may change again.
        int error = cu_.cuMemcpyHtoDAsync_v2(memory.at, frame.table.data(), table, stream_);
        if (!error) {
            error = cu_.cuMemcpyHtoDAsync_v2(memory.at + table, frame.grids.data(), grids, stream_);
        }
        if (error) return driver_error("cuMemcpyHtoDAsync", error);
        Pointer in = address(window.in, window.in.start),
                out = address(window.out, window.out.start), at = memory.at,
                grids_at = memory.at + table;
        void* kept = nullptr;
        // By any stream: another one may have this one's handle, while its work goes on.
        const std::string problem = scratch(frame, nullptr, kept);
        if (!problem.empty()) return problem;
        error = kept ? cu_.cuStreamWaitEvent(stream_, module_->passed, 0) : 0;
        if (error) return driver_error("cuStreamWaitEvent", error);
        int size = static_cast<int>(frame.table.size());
        long long in_row = window.in.row / 4, out_row = window.out.row / 4;
        Window w = window;
        void* arguments[] = {&in,      &out,     &at,       &grids_at, &kept, &size, &in_row,
                             &out_row, &w.width, &w.height, &w.x1,     &w.y1, &w.x2, &w.y2};
        for (const Pass& pass : passes_of(frame, window)) {
            // Each block copies the table once, so that blocks of pixels have several rows.
            const unsigned rows = pass.kernel + 1 < kKernels.size() ? 1 : kRows;
            const unsigned width = static_cast<unsigned>(pass.width) + kThreads - 1;
            const unsigned height = static_cast<unsigned>(pass.height) + rows - 1;
            error = cu_.cuLaunchKernel(module_->functions[pass.kernel], width / kThreads,
                                       std::min(height / rows, 65535u), 1, kThreads, 1, 1,
                                       static_cast<unsigned>(table), stream_, arguments, nullptr);
            if (error) return driver_error("cuLaunchKernel", error);
        }
        error = kept ? cu_.cuEventRecord(module_->passed, stream_) : 0;
        if (error) return driver_error("cuEventRecord", error);
        return waits_ ? wait() : "";
    }

    /// Not of the stream, which may be gone when this is freed, while its context is current; or
    /// with that.
    std::shared_ptr<void> allocate(std::size_t bytes, std::string& problem) override {
        Pointer at = 0;
        const int error = cu_.cuMemAlloc_v2(&at, bytes);
        if (error) {
            problem = driver_error("cuMemAlloc", error);
            return nullptr;
        }
        return {reinterpret_cast<void*>(at), [&cu = cu_, key = key_, at](void*) {
                    if (current_context(cu) == key) cu.cuMemFree_v2(at);
                }};
    }

    /// Freed while its context is current, or with it.
    std::shared_ptr<char> pinned(std::size_t bytes) override {
        void* at = nullptr;
        if (cu_.cuMemAllocHost_v2(&at, bytes)) return nullptr;
        return {static_cast<char*>(at), [&cu = cu_, key = key_](char* memory) {
                    if (current_context(cu) == key) cu.cuMemFreeHost(memory);
                }};
    }

    const CudaFunctions& cu_;
    Handle stream_;
    const bool waits_, push_;
    CudaKey key_;
    std::shared_ptr<Module> module_;
};

}  // namespace

std::unique_ptr<Queue> cuda_queue(void* stream, bool waits) {
    const CudaFunctions* const cu = cuda_functions();
    Handle context = nullptr;
    if (!cu || cu->cuCtxGetCurrent(&context)) return nullptr;
    const bool push = !context;
    // A thread of the host that has not used CUDA yet.
    if (push && (!stream || cu->cuStreamGetCtx(stream, &context) || !context)) return nullptr;
    return std::make_unique<CudaQueue>(*cu, stream, waits, context, push);
}

void purge_cuda() { Modules::of_process().clear(); }

}  // namespace palette4d::gpu
