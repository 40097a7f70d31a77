// OpenCL 1.1, as hosts have it: their queue, and buffers in place of pixels.
#include <cstdint>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "gpu/kept.hpp"
#include "gpu/library.hpp"
#include "gpu/queue.hpp"
#include "gpu/text.hpp"

#if defined(_WIN32)
#define PALETTE4D_CL __stdcall
#else
#define PALETTE4D_CL
#endif

namespace palette4d::gpu {
namespace {

// The part of OpenCL's interface that is used here, written from its specification.
using Int = std::int32_t;
using Uint = std::uint32_t;
using Bits = std::uint64_t;
using Handle = void*;

constexpr Uint kQueueContext = 0x1090, kQueueDevice = 0x1091;
constexpr Uint kDeviceName = 0x102B, kDeviceMaxConstant = 0x1020;
constexpr Bits kReadOnlyCopied = 1 << 2 | 1 << 5;

struct ClFunctions {
    Int(PALETTE4D_CL* clGetCommandQueueInfo)(Handle, Uint, std::size_t, void*, std::size_t*);
    Int(PALETTE4D_CL* clGetDeviceInfo)(Handle, Uint, std::size_t, void*, std::size_t*);
    Handle(PALETTE4D_CL* clCreateProgramWithSource)(Handle, Uint, const char**, const std::size_t*,
                                                    Int*);
    Int(PALETTE4D_CL* clBuildProgram)(Handle, Uint, const Handle*, const char*,
                                      void (*)(Handle, void*), void*);
    Handle(PALETTE4D_CL* clCreateKernel)(Handle, const char*, Int*);
    Int(PALETTE4D_CL* clSetKernelArg)(Handle, Uint, std::size_t, const void*);
    Int(PALETTE4D_CL* clEnqueueNDRangeKernel)(Handle, Handle, Uint, const std::size_t*,
                                              const std::size_t*, const std::size_t*, Uint,
                                              const Handle*, Handle*);
    Handle(PALETTE4D_CL* clCreateBuffer)(Handle, Bits, std::size_t, void*, Int*);
    Int(PALETTE4D_CL* clEnqueueReadBuffer)(Handle, Handle, Uint, std::size_t, std::size_t, void*,
                                           Uint, const Handle*, Handle*);
    Int(PALETTE4D_CL* clEnqueueWriteBuffer)(Handle, Handle, Uint, std::size_t, std::size_t,
                                            const void*, Uint, const Handle*, Handle*);
    Int(PALETTE4D_CL* clFlush)(Handle);
    Int(PALETTE4D_CL* clFinish)(Handle);
    Int(PALETTE4D_CL* clReleaseMemObject)(Handle);
    Int(PALETTE4D_CL* clReleaseKernel)(Handle);
    Int(PALETTE4D_CL* clReleaseProgram)(Handle);
    Int(PALETTE4D_CL* clRetainContext)(Handle);
    Int(PALETTE4D_CL* clReleaseContext)(Handle);
};

/// Null where OpenCL is not here.
const ClFunctions* cl_functions() {
    static const std::pair<ClFunctions, bool> loaded = [] {
        std::pair<ClFunctions, bool> all{};
        ClFunctions& f = all.first;
        void* const library = load_library({"libOpenCL.so.1", "libOpenCL.so", "OpenCL.dll",
                                            "/System/Library/Frameworks/OpenCL.framework/OpenCL"});
        if (!library) return all;
#define PALETTE4D_FIND(name) find_function(library, #name, f.name)
        all.second = PALETTE4D_FIND(clGetCommandQueueInfo) && PALETTE4D_FIND(clGetDeviceInfo) &&
                     PALETTE4D_FIND(clCreateProgramWithSource) && PALETTE4D_FIND(clBuildProgram) &&
                     PALETTE4D_FIND(clCreateKernel) && PALETTE4D_FIND(clSetKernelArg) &&
                     PALETTE4D_FIND(clEnqueueNDRangeKernel) && PALETTE4D_FIND(clCreateBuffer) &&
                     PALETTE4D_FIND(clEnqueueReadBuffer) && PALETTE4D_FIND(clEnqueueWriteBuffer) &&
                     PALETTE4D_FIND(clFlush) && PALETTE4D_FIND(clFinish) &&
                     PALETTE4D_FIND(clReleaseMemObject) && PALETTE4D_FIND(clReleaseKernel) &&
                     PALETTE4D_FIND(clReleaseProgram) && PALETTE4D_FIND(clRetainContext) &&
                     PALETTE4D_FIND(clReleaseContext);
#undef PALETTE4D_FIND
        return all;
    }();
    return loaded.second ? &loaded.first : nullptr;
}

/// The kernel's program for a device of a context.
struct Program : Context {
    const ClFunctions& cl;
    Handle context, program = nullptr;
    bool kept;

    /// Keeps the context, so that no other one gets its handle.
    Program(const ClFunctions& functions, Handle of)
        : cl(functions), context(of), kept(cl.clRetainContext(of) == 0) {}
    ~Program() {
        if (program) cl.clReleaseProgram(program);
        if (kept) cl.clReleaseContext(context);
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    std::string build(Handle device) {
        if (program) return "";
        const char* text = opencl_text();
        Int error = 0;
        program = cl.clCreateProgramWithSource(context, 1, &text, nullptr, &error);
        if (!program) return driver_error("clCreateProgramWithSource", error);
        error = cl.clBuildProgram(program, 1, &device, "", nullptr, nullptr);
        return error ? driver_error("clBuildProgram", error) : "";
    }
};

using ClKey = std::pair<Handle, Handle>;  ///< context and device
struct Programs {
    std::mutex mutex;
    Kept<ClKey, Program> kept;
};
/// Never destroyed: at the end of a process the driver may be gone.
Programs& programs() {
    alignas(Programs) static unsigned char place[sizeof(Programs)];
    static auto* const all = new (place) Programs;
    return *all;
}

class OpenClQueue final : public Queue {
public:
    OpenClQueue(const ClFunctions& functions, Handle queue, Handle context, Handle device)
        : cl_(functions), queue_(queue), context_(context), device_(device) {
        Programs& all = programs();
        const std::lock_guard<std::mutex> lock(all.mutex);
        program_ = all.kept.get({context, device},
                                [&] { return std::make_shared<Program>(cl_, context); });
    }

    std::string device() const override {
        char name[256] = "";
        cl_.clGetDeviceInfo(device_, kDeviceName, sizeof name - 1, name, nullptr);
        return std::string(name) + " (OpenCL)";
    }

    std::string read(const Place& from, std::size_t bytes, int height, char* to,
                     std::ptrdiff_t row) override {
        return each_row(from, bytes, height, row, [&](std::size_t at, std::size_t size, int y) {
            return cl_.clEnqueueReadBuffer(queue_, from.data, 0, at, size, to + row * y, 0, nullptr,
                                           nullptr);
        });
    }
    std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                      const Place& to) override {
        return each_row(to, bytes, height, row, [&](std::size_t at, std::size_t size, int y) {
            return cl_.clEnqueueWriteBuffer(queue_, to.data, 0, at, size, from + row * y, 0,
                                            nullptr, nullptr);
        });
    }

private:
    /// A buffer of the numbers; released with this, which the driver allows before it is used.
    struct Buffer {
        const ClFunctions& cl;
        Handle memory;
        Buffer(const ClFunctions& functions, Handle context, const std::vector<float>& numbers,
               Int& error)
            : cl(functions),
              memory(cl.clCreateBuffer(context, kReadOnlyCopied, numbers.size() * sizeof(float),
                                       const_cast<float*>(numbers.data()), &error)) {}
        ~Buffer() {
            if (memory) cl.clReleaseMemObject(memory);
        }
        Buffer(const Buffer&) = delete;
        Buffer& operator=(const Buffer&) = delete;
    };
    struct Kernel {
        const ClFunctions& cl;
        Handle kernel;
        ~Kernel() {
            if (kernel) cl.clReleaseKernel(kernel);
        }
    };

    Context& context() override { return *program_; }
    std::string load() override { return program_->build(device_); }
    std::string wait() override {
        const Int error = cl_.clFinish(queue_);
        return error ? driver_error("clFinish", error) : "";
    }

    std::string enqueue(const FrameTable& frame, const Window& window) override {
        Bits most = 0;
        cl_.clGetDeviceInfo(device_, kDeviceMaxConstant, sizeof most, &most, nullptr);
        if (most < frame.table.size() * sizeof(float)) return "too little constant memory";
        Int error = 0;
        const Buffer table(cl_, context_, frame.table, error);
        if (!table.memory) return driver_error("clCreateBuffer", error);
        const Buffer grids(cl_, context_, frame.grids, error);
        if (!grids.memory) return driver_error("clCreateBuffer", error);
        // One for each draw: setting arguments is not thread-safe.
        const Kernel kernel{cl_, cl_.clCreateKernel(program_->program, "p4d_draw", &error)};
        if (!kernel.kernel) return driver_error("clCreateKernel", error);
        Uint index = 0;
        const auto set = [&](const auto& value) {
            if (!error) {
                error = cl_.clSetKernelArg(kernel.kernel, index++, sizeof value, &value);
            }
        };
        set(window.in.data);
        set(window.out.data);
        set(table.memory);
        set(grids.memory);
        for (const std::ptrdiff_t bytes :
             {window.in.start, window.in.row, window.out.start, window.out.row}) {
            set(static_cast<Int>(bytes / 4));
        }
        for (const int value :
             {window.width, window.height, window.x1, window.y1, window.x2, window.y2}) {
            set(static_cast<Int>(value));
        }
        if (error) return driver_error("clSetKernelArg", error);
        const std::size_t size[2] = {static_cast<std::size_t>(window.width + 63) / 64 * 64,
                                     static_cast<std::size_t>(window.height)};
        error = cl_.clEnqueueNDRangeKernel(queue_, kernel.kernel, 2, nullptr, size, nullptr, 0,
                                           nullptr, nullptr);
        if (error) return driver_error("clEnqueueNDRangeKernel", error);
        error = cl_.clFlush(queue_);
        return error ? driver_error("clFlush", error) : "";
    }

    /// Calls copy(offset, bytes, y) for each row, or once where rows have no gaps; then waits.
    template <class Copy>
    std::string each_row(const Place& place, std::size_t bytes, int height, std::ptrdiff_t row,
                         Copy copy) {
        Int error = 0;
        const bool whole = place.row == row && static_cast<std::size_t>(row) == bytes;
        const std::size_t size = whole ? bytes * static_cast<std::size_t>(height) : bytes;
        for (int y = 0; y < (whole ? 1 : height) && !error; ++y) {
            const std::ptrdiff_t at = place.start + place.row * y;
            if (at < 0) return "a buffer cannot be read before its start";
            error = copy(static_cast<std::size_t>(at), size, y);
        }
        const std::string finished = wait();
        return error ? driver_error("copying pixels", error) : finished;
    }

    const ClFunctions& cl_;
    Handle queue_, context_, device_;
    std::shared_ptr<Program> program_;
};

}  // namespace

std::unique_ptr<Queue> opencl_queue(void* queue) {
    const ClFunctions* const cl = cl_functions();
    Handle context = nullptr, device = nullptr;
    if (!cl || !queue ||
        cl->clGetCommandQueueInfo(queue, kQueueContext, sizeof context, &context, nullptr) ||
        cl->clGetCommandQueueInfo(queue, kQueueDevice, sizeof device, &device, nullptr)) {
        return nullptr;
    }
    return std::make_unique<OpenClQueue>(*cl, queue, context, device);
}

void purge_opencl() {
    Programs& all = programs();
    const std::lock_guard<std::mutex> lock(all.mutex);
    all.kept.clear();
}

}  // namespace palette4d::gpu
