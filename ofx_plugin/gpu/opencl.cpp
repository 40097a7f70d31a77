// OpenCL 1.1, as hosts have it: their queue, and buffers in place of pixels.
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "gpu/kept.hpp"
#include "gpu/queue.hpp"
#include "gpu/text.hpp"

namespace palette4d::gpu {
namespace {

// The part of OpenCL's interface that is used here, written from its specification.
using Int = std::int32_t;
using Uint = std::uint32_t;
using Bits = std::uint64_t;
using Handle = void*;

constexpr Uint kQueueContext = 0x1090, kQueueDevice = 0x1091;
constexpr Uint kDeviceName = 0x102B, kDeviceMaxConstant = 0x1020;
constexpr Bits kReadOnlyCopied = 1 << 2 | 1 << 5, kOnDevice = 1 << 0, kInHost = 1 << 4;
constexpr Bits kMapReadWrite = 1 | 1 << 1;
constexpr Int kInvalidValue = -30;

struct ClFunctions : Functions {
    using Functions::Functions;
    PALETTE4D_FUNCTION(Int, clGetCommandQueueInfo, Handle, Uint, std::size_t, void*, std::size_t*);
    PALETTE4D_FUNCTION(Int, clGetDeviceInfo, Handle, Uint, std::size_t, void*, std::size_t*);
    PALETTE4D_FUNCTION(Handle, clCreateProgramWithSource, Handle, Uint, const char**,
                       const std::size_t*, Int*);
    PALETTE4D_FUNCTION(Int, clBuildProgram, Handle, Uint, const Handle*, const char*,
                       void (*)(Handle, void*), void*);
    PALETTE4D_FUNCTION(Handle, clCreateKernel, Handle, const char*, Int*);
    PALETTE4D_FUNCTION(Int, clSetKernelArg, Handle, Uint, std::size_t, const void*);
    PALETTE4D_FUNCTION(Int, clEnqueueNDRangeKernel, Handle, Handle, Uint, const std::size_t*,
                       const std::size_t*, const std::size_t*, Uint, const Handle*, Handle*);
    PALETTE4D_FUNCTION(Handle, clCreateBuffer, Handle, Bits, std::size_t, void*, Int*);
    PALETTE4D_FUNCTION(Int, clEnqueueReadBuffer, Handle, Handle, Uint, std::size_t, std::size_t,
                       void*, Uint, const Handle*, Handle*);
    PALETTE4D_FUNCTION(Int, clEnqueueWriteBuffer, Handle, Handle, Uint, std::size_t, std::size_t,
                       const void*, Uint, const Handle*, Handle*);
    PALETTE4D_FUNCTION(void*, clEnqueueMapBuffer, Handle, Handle, Uint, Bits, std::size_t,
                       std::size_t, Uint, const Handle*, Handle*, Int*);
    PALETTE4D_FUNCTION(Int, clEnqueueUnmapMemObject, Handle, Handle, void*, Uint, const Handle*,
                       Handle*);
    PALETTE4D_FUNCTION(Int, clFlush, Handle);
    PALETTE4D_FUNCTION(Int, clFinish, Handle);
    PALETTE4D_FUNCTION(Int, clReleaseMemObject, Handle);
    PALETTE4D_FUNCTION(Int, clReleaseKernel, Handle);
    PALETTE4D_FUNCTION(Int, clReleaseProgram, Handle);
    PALETTE4D_FUNCTION(Int, clRetainCommandQueue, Handle);
    PALETTE4D_FUNCTION(Int, clReleaseCommandQueue, Handle);
    PALETTE4D_FUNCTION(Int, clRetainContext, Handle);
    PALETTE4D_FUNCTION(Int, clReleaseContext, Handle);
};

/// Null where OpenCL is not here.
const ClFunctions* cl_functions() {
    static const ClFunctions all(
        load_library({"libOpenCL.so.1", "libOpenCL.so", "OpenCL.dll",
                      "/System/Library/Frameworks/OpenCL.framework/OpenCL"}));
    return all.complete ? &all : nullptr;
}

/// A buffer of numbers; released with this, which the driver allows before it is used.
struct Buffer {
    const ClFunctions& cl;
    const std::vector<float> numbers;
    Handle memory;
    Buffer(const ClFunctions& functions, Handle context, const std::vector<float>& of, Int& error)
        : cl(functions),
          numbers(of),
          memory(cl.clCreateBuffer(context, kReadOnlyCopied, of.size() * sizeof(float),
                                   const_cast<float*>(numbers.data()), &error)) {}
    ~Buffer() {
        if (memory) cl.clReleaseMemObject(memory);
    }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
};

/// The kernel's program for a device of a context.
struct Program : Context {
    const ClFunctions& cl;
    Handle context, program = nullptr;
    bool kept;
    std::mutex of_last{};
    std::shared_ptr<const Buffer> table{}, grids{};  ///< the last frame's

    /// Keeps the context, so that no other one gets its handle.
    Program(const ClFunctions& functions, Handle of)
        : cl(functions), context(of), kept(cl.clRetainContext(of) == 0) {}
    ~Program() {
        table = grids = nullptr;
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

    /// The buffer of these numbers: `last`, if it is that, else a new one in its place.
    std::shared_ptr<const Buffer> buffer(const std::vector<float>& numbers,
                                         std::shared_ptr<const Buffer>& last, Int& error) {
        const std::lock_guard<std::mutex> lock(of_last);
        const auto same = [&](const std::vector<float>& other) {
            return other.size() == numbers.size() &&
                   std::memcmp(other.data(), numbers.data(), sizeof(float) * numbers.size()) == 0;
        };
        if (last && same(last->numbers)) return last;
        const auto made = std::make_shared<const Buffer>(cl, context, numbers, error);
        last = made->memory ? made : nullptr;
        return last;
    }
};

using ClKey = std::pair<Handle, Handle>;  ///< context and device
using Programs = Kept<ClKey, Program>;

class OpenClQueue final : public Queue {
public:
    OpenClQueue(const ClFunctions& functions, Handle queue, Handle context, Handle device,
                const void* node)
        : cl_(functions), queue_(queue), context_(context), device_(device) {
        program_ = Programs::of_process().get(
            {context, device}, node, [&] { return std::make_shared<Program>(cl_, context); });
    }

    std::string device() const override {
        char name[256] = "";
        cl_.clGetDeviceInfo(device_, kDeviceName, sizeof name - 1, name, nullptr);
        return std::string(name) + " (OpenCL)";
    }

    std::string read(const Place& from, std::size_t bytes, int height, char* to,
                     std::ptrdiff_t row) override {
        return each_row(from, bytes, height, row, [&](std::ptrdiff_t at, std::size_t size, int y) {
            if (at < 0) return kInvalidValue;
            return cl_.clEnqueueReadBuffer(queue_, from.data, 0, static_cast<std::size_t>(at), size,
                                           to + row * y, 0, nullptr, nullptr);
        });
    }
    std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                      const Place& to) override {
        return each_row(to, bytes, height, row, [&](std::ptrdiff_t at, std::size_t size, int y) {
            if (at < 0) return kInvalidValue;
            return cl_.clEnqueueWriteBuffer(queue_, to.data, 0, static_cast<std::size_t>(at), size,
                                            from + row * y, 0, nullptr, nullptr);
        });
    }

private:
    struct Kernel {
        const ClFunctions& cl;
        Handle kernel;
        ~Kernel() {
            if (kernel) cl.clReleaseKernel(kernel);
        }
    };

    std::shared_ptr<Context> context() override { return program_; }
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
        const auto table = program_->buffer(frame.table, program_->table, error);
        if (!table) return driver_error("clCreateBuffer", error);
        const auto grids = program_->buffer(frame.grids, program_->grids, error);
        if (!grids) return driver_error("clCreateBuffer", error);
        void* memory = window.out.data;  // where no kernel reads it
        std::string problem = scratch(frame, queue_, memory);
        for (const Pass& pass : passes_of(frame, window)) {
            if (problem.empty())
                problem = enqueue(pass, window, {table->memory, grids->memory, memory});
        }
        if (!problem.empty()) return problem;
        error = cl_.clFlush(queue_);
        return error ? driver_error("clFlush", error) : "";
    }

    /// `buffers`: the table, the grids and what passes leave to each other.
    std::string enqueue(const Pass& pass, const Window& window,
                        const std::array<Handle, 3>& buffers) {
        Int error = 0;
        // One for each draw: setting arguments is not thread-safe.
        const Kernel kernel{cl_,
                            cl_.clCreateKernel(program_->program, kKernels[pass.kernel], &error)};
        if (!kernel.kernel) return driver_error("clCreateKernel", error);
        Uint index = 0;
        const auto set = [&](const auto& value) {
            if (!error) {
                error = cl_.clSetKernelArg(kernel.kernel, index++, sizeof value, &value);
            }
        };
        set(window.in.data);
        set(window.out.data);
        for (const Handle buffer : buffers) set(buffer);
        for (const std::ptrdiff_t bytes :
             {window.in.start, window.in.row, window.out.start, window.out.row}) {
            set(static_cast<Int>(bytes / 4));
        }
        for (const int value :
             {window.width, window.height, window.x1, window.y1, window.x2, window.y2}) {
            set(static_cast<Int>(value));
        }
        if (error) return driver_error("clSetKernelArg", error);
        const std::size_t size[2] = {static_cast<std::size_t>(pass.width + 63) / 64 * 64,
                                     static_cast<std::size_t>(pass.height)};
        // The same for all sizes of pictures: drivers compile a kernel for each.
        const std::size_t group[2] = {64, 1};
        error = cl_.clEnqueueNDRangeKernel(queue_, kernel.kernel, 2, nullptr, size, group, 0,
                                           nullptr, nullptr);
        return error ? driver_error("clEnqueueNDRangeKernel", error) : "";
    }

    std::shared_ptr<void> allocate(std::size_t bytes, std::string& problem) override {
        Int error = 0;
        const Handle memory = cl_.clCreateBuffer(context_, kOnDevice, bytes, nullptr, &error);
        if (!memory) {
            problem = driver_error("clCreateBuffer", error);
            return nullptr;
        }
        // Kept, so that no other queue gets its handle.
        error = cl_.clRetainCommandQueue(queue_);
        if (error) {
            cl_.clReleaseMemObject(memory);
            problem = driver_error("clRetainCommandQueue", error);
            return nullptr;
        }
        return {memory, [&cl = cl_, queue = queue_](Handle of) {
                    cl.clReleaseMemObject(of);
                    cl.clReleaseCommandQueue(queue);
                }};
    }

    /// A mapped buffer, which drivers keep pinned.
    std::shared_ptr<char> pinned(std::size_t bytes) override {
        Int error = 0;
        const Handle memory = cl_.clCreateBuffer(context_, kInHost, bytes, nullptr, &error);
        if (!memory) return nullptr;
        void* const at = cl_.clEnqueueMapBuffer(queue_, memory, 1, kMapReadWrite, 0, bytes, 0,
                                                nullptr, nullptr, &error);
        const auto unmap = [&cl = cl_, queue = queue_, memory](void* mapped) {
            if (mapped) cl.clEnqueueUnmapMemObject(queue, memory, mapped, 0, nullptr, nullptr);
            cl.clReleaseMemObject(memory);
        };
        // To unmap it there must be a queue.
        if (!at || cl_.clRetainCommandQueue(queue_)) {
            unmap(at);
            return nullptr;
        }
        return {static_cast<char*>(at), [unmap, &cl = cl_, queue = queue_](char* mapped) {
                    unmap(mapped);
                    cl.clReleaseCommandQueue(queue);
                }};
    }

    const ClFunctions& cl_;
    Handle queue_, context_, device_;
    std::shared_ptr<Program> program_;
};

}  // namespace

std::unique_ptr<Queue> opencl_queue(void* queue, const void* node) {
    const ClFunctions* const cl = cl_functions();
    Handle context = nullptr, device = nullptr;
    if (!cl || !queue ||
        cl->clGetCommandQueueInfo(queue, kQueueContext, sizeof context, &context, nullptr) ||
        cl->clGetCommandQueueInfo(queue, kQueueDevice, sizeof device, &device, nullptr)) {
        return nullptr;
    }
    return std::make_unique<OpenClQueue>(*cl, queue, context, device, node);
}

void leave_opencl(const void* node) { Programs::of_process().leave(node); }
void purge_opencl() { Programs::of_process().clear(); }

}  // namespace palette4d::gpu
