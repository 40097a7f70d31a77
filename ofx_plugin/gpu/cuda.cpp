// CUDA's driver interface: the host's stream, and pointers of the device in place of pixels.
#include <algorithm>
#include <cstdint>
#include <mutex>
#include <new>
#include <utility>

#include "gpu/kept.hpp"
#include "gpu/library.hpp"
#include "gpu/queue.hpp"
#include "gpu/text.hpp"

#if defined(_WIN32)
#define PALETTE4D_CU __stdcall
#else
#define PALETTE4D_CU
#endif

namespace palette4d::gpu {
namespace {

// The part of the driver's interface that is used here, written from its documentation.
using Handle = void*;
using Pointer = std::uint64_t;

constexpr int kMostShared = 8;  // CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES
constexpr unsigned kThreads = 128, kRows = 8;

struct CudaFunctions {
    int(PALETTE4D_CU* cuInit)(unsigned);
    int(PALETTE4D_CU* cuCtxGetCurrent)(Handle*);
    int(PALETTE4D_CU* cuCtxGetDevice)(int*);
    int(PALETTE4D_CU* cuCtxPushCurrent_v2)(Handle);
    int(PALETTE4D_CU* cuCtxPopCurrent_v2)(Handle*);
    int(PALETTE4D_CU* cuStreamGetCtx)(Handle, Handle*);
    int(PALETTE4D_CU* cuDeviceGetName)(char*, int, int);
    int(PALETTE4D_CU* cuModuleLoadData)(Handle*, const void*);
    int(PALETTE4D_CU* cuModuleUnload)(Handle);
    int(PALETTE4D_CU* cuModuleGetFunction)(Handle*, Handle, const char*);
    int(PALETTE4D_CU* cuFuncSetAttribute)(Handle, int, int);
    int(PALETTE4D_CU* cuLaunchKernel)(Handle, unsigned, unsigned, unsigned, unsigned, unsigned,
                                      unsigned, unsigned, Handle, void**, void**);
    int(PALETTE4D_CU* cuMemAlloc_v2)(Pointer*, std::size_t);
    int(PALETTE4D_CU* cuMemFree_v2)(Pointer);
    int(PALETTE4D_CU* cuMemcpyHtoDAsync_v2)(Pointer, const void*, std::size_t, Handle);
    int(PALETTE4D_CU* cuMemcpyDtoHAsync_v2)(void*, Pointer, std::size_t, Handle);
    int(PALETTE4D_CU* cuStreamSynchronize)(Handle);
    // Since CUDA 11.2, and 12.0: null in older drivers.
    int(PALETTE4D_CU* cuMemAllocAsync)(Pointer*, std::size_t, Handle);
    int(PALETTE4D_CU* cuMemFreeAsync)(Pointer, Handle);
    int(PALETTE4D_CU* cuCtxGetId)(Handle, unsigned long long*);
};

/// Null where CUDA is not here.
const CudaFunctions* cuda_functions() {
    static const std::pair<CudaFunctions, bool> loaded = [] {
        std::pair<CudaFunctions, bool> all{};
        CudaFunctions& f = all.first;
        void* const library = load_library({"libcuda.so.1", "libcuda.so", "nvcuda.dll"});
        if (!library) return all;
#define PALETTE4D_FIND(name) find_function(library, #name, f.name)
        all.second = PALETTE4D_FIND(cuInit) && PALETTE4D_FIND(cuCtxGetCurrent) &&
                     PALETTE4D_FIND(cuCtxGetDevice) && PALETTE4D_FIND(cuCtxPushCurrent_v2) &&
                     PALETTE4D_FIND(cuCtxPopCurrent_v2) && PALETTE4D_FIND(cuStreamGetCtx) &&
                     PALETTE4D_FIND(cuDeviceGetName) && PALETTE4D_FIND(cuModuleLoadData) &&
                     PALETTE4D_FIND(cuModuleUnload) && PALETTE4D_FIND(cuModuleGetFunction) &&
                     PALETTE4D_FIND(cuFuncSetAttribute) && PALETTE4D_FIND(cuLaunchKernel) &&
                     PALETTE4D_FIND(cuMemAlloc_v2) && PALETTE4D_FIND(cuMemFree_v2) &&
                     PALETTE4D_FIND(cuMemcpyHtoDAsync_v2) && PALETTE4D_FIND(cuMemcpyDtoHAsync_v2) &&
                     PALETTE4D_FIND(cuStreamSynchronize) && f.cuInit(0) == 0;
        if (!PALETTE4D_FIND(cuMemAllocAsync) || !PALETTE4D_FIND(cuMemFreeAsync)) {
            f.cuMemAllocAsync = nullptr;
        }
        PALETTE4D_FIND(cuCtxGetId);
#undef PALETTE4D_FIND
        return all;
    }();
    return loaded.second ? &loaded.first : nullptr;
}

/// The kernel in a context.
struct Module : Context {
    Handle module = nullptr, function = nullptr;

    std::string load(const CudaFunctions& cu) {
        if (function) return "";
        int error = cu.cuModuleLoadData(&module, cuda_ptx());
        if (error) return driver_error("cuModuleLoadData", error);
        error = cu.cuModuleGetFunction(&function, module, "p4d_draw");
        if (error) return driver_error("cuModuleGetFunction", error);
        // What a device lacks shows when a table of that size is drawn.
        cu.cuFuncSetAttribute(function, kMostShared, kMostTable * sizeof(float));
        return "";
    }
};

using CudaKey =
    std::pair<Handle, unsigned long long>;  ///< context, and its number where it has one
struct Modules {
    std::mutex mutex;
    Kept<CudaKey, Module> kept;
};
/// Never destroyed: at the end of a process the driver may be gone. Modules are not unloaded: they
/// go with their context, which may be gone too.
Modules& modules() {
    alignas(Modules) static unsigned char place[sizeof(Modules)];
    static auto* const all = new (place) Modules;
    return *all;
}

class CudaQueue final : public Queue {
public:
    CudaQueue(const CudaFunctions& functions, Handle stream, bool waits, Handle context, bool push)
        : cu_(functions), stream_(stream), waits_(waits), push_(push) {
        if (push_) cu_.cuCtxPushCurrent_v2(context);
        CudaKey key{context, 0};
        if (cu_.cuCtxGetId) cu_.cuCtxGetId(context, &key.second);
        Modules& all = modules();
        const std::lock_guard<std::mutex> lock(all.mutex);
        module_ = all.kept.get(key, [] { return std::make_shared<Module>(); });
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
        return each_row(from, bytes, height, row, [&](Pointer at, std::size_t size, int y) {
            return cu_.cuMemcpyDtoHAsync_v2(to + row * y, at, size, stream_);
        });
    }
    std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                      const Place& to) override {
        return each_row(to, bytes, height, row, [&](Pointer at, std::size_t size, int y) {
            return cu_.cuMemcpyHtoDAsync_v2(at, from + row * y, size, stream_);
        });
    }

private:
    static Pointer address(const Place& place, std::ptrdiff_t row) {
        return reinterpret_cast<Pointer>(place.data) +
               static_cast<Pointer>(place.start + place.row * row);
    }

    /// Memory of a stream, or of the context in older drivers.
    struct Memory {
        const CudaFunctions& cu;
        Handle stream;
        Pointer at = 0;
        int error = 0;
        Memory(const CudaFunctions& functions, std::size_t size, Handle of)
            : cu(functions), stream(of) {
            error = cu.cuMemAllocAsync ? cu.cuMemAllocAsync(&at, size, stream)
                                       : cu.cuMemAlloc_v2(&at, size);
            if (error) at = 0;
        }
        ~Memory() {
            if (!at) return;
            if (cu.cuMemAllocAsync) {
                cu.cuMemFreeAsync(at, stream);
            } else {
                cu.cuMemFree_v2(at);  // waits for what uses it
            }
        }
        Memory(const Memory&) = delete;
        Memory& operator=(const Memory&) = delete;
    };

    Context& context() override { return *module_; }
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
        Pointer in = address(window.in, 0), out = address(window.out, 0), at = memory.at,
                grids_at = memory.at + table;
        int size = static_cast<int>(frame.table.size());
        long long in_row = window.in.row / 4, out_row = window.out.row / 4;
        Window w = window;
        void* arguments[] = {&in,      &out,      &at,   &grids_at, &size, &in_row, &out_row,
                             &w.width, &w.height, &w.x1, &w.y1,     &w.x2, &w.y2};
        const auto columns = static_cast<unsigned>(window.width + static_cast<int>(kThreads) - 1);
        const auto rows = static_cast<unsigned>(window.height + static_cast<int>(kRows) - 1);
        error = cu_.cuLaunchKernel(module_->function, columns / kThreads,
                                   std::min(rows / kRows, 65535u), 1, kThreads, 1, 1,
                                   static_cast<unsigned>(table), stream_, arguments, nullptr);
        if (error) return driver_error("cuLaunchKernel", error);
        return waits_ ? wait() : "";
    }

    /// Calls copy(address, bytes, y) for each row, or once where rows have no gaps; then waits.
    template <class Copy>
    std::string each_row(const Place& place, std::size_t bytes, int height, std::ptrdiff_t row,
                         Copy copy) {
        int error = 0;
        const bool whole = place.row == row && row > 0 && static_cast<std::size_t>(row) == bytes;
        const std::size_t size = whole ? bytes * static_cast<std::size_t>(height) : bytes;
        for (int y = 0; y < (whole ? 1 : height) && !error; ++y) {
            error = copy(address(place, y), size, y);
        }
        const std::string finished = wait();
        return error ? driver_error("copying pixels", error) : finished;
    }

    const CudaFunctions& cu_;
    Handle stream_;
    const bool waits_, push_;
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

void purge_cuda() {
    Modules& all = modules();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.kept.clear();
}

}  // namespace palette4d::gpu
