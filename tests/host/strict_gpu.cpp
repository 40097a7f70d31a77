#include "strict_gpu.hpp"

#include <cstdint>
#include <stdexcept>

#include "gpu/library.hpp"

#if defined(_WIN32)
#define STRICT_API __stdcall
#else
#define STRICT_API
#endif

namespace strict {
namespace {

using palette4d::gpu::function_of;
using palette4d::gpu::load_library;
using Handle = void*;

/// A library's function of this type; throws where there is none.
template <class Function>
Function found(void* library, const char* name) {
    void* const function = function_of(library, name);
    if (!function) throw std::runtime_error(std::string("no function ") + name);
    return reinterpret_cast<Function>(function);
}

void check(int error, const char* what) {
    if (error) throw std::runtime_error(std::string(what) + ": error " + std::to_string(error));
}

struct Library {
    void* library;
    template <class Function>
    Function get(const char* name) const {
        return found<Function>(library, name);
    }
};

class OpenClGpu final : public Gpu {
public:
    OpenClGpu(void* library, Handle device) : cl_{library}, device_(device) {
        int error = 0;
        context_ = cl_.get<Handle(STRICT_API*)(const void*, std::uint32_t, const Handle*, Handle,
                                               Handle, int*)>("clCreateContext")(
            nullptr, 1, &device, nullptr, nullptr, &error);
        check(error, "clCreateContext");
        queue_ = cl_.get<Handle(STRICT_API*)(Handle, Handle, std::uint64_t, int*)>(
            "clCreateCommandQueue")(context_, device, 0, &error);
        check(error, "clCreateCommandQueue");
    }
    ~OpenClGpu() override {
        using Release = int(STRICT_API*)(Handle);
        cl_.get<Release>("clReleaseCommandQueue")(queue_);
        cl_.get<Release>("clReleaseContext")(context_);
    }

    std::string device() const override {
        char name[256] = "";
        cl_.get<int(STRICT_API*)(Handle, std::uint32_t, std::size_t, void*, std::size_t*)>(
            "clGetDeviceInfo")(device_, 0x102B, sizeof name - 1, name, nullptr);
        return std::string(name) + " (OpenCL)";
    }
    void* allocate(const void* bytes, std::size_t count) override {
        int error = 0;
        void* const memory =
            cl_.get<Handle(STRICT_API*)(Handle, std::uint64_t, std::size_t, void*, int*)>(
                "clCreateBuffer")(context_, 1 | 1 << 5, count, const_cast<void*>(bytes), &error);
        check(error, "clCreateBuffer");
        return memory;
    }
    void upload(void* memory, const void* bytes, std::size_t count) override {
        check(cl_.get<int(STRICT_API*)(Handle, Handle, std::uint32_t, std::size_t, std::size_t,
                                       const void*, std::uint32_t, const Handle*, Handle*)>(
                  "clEnqueueWriteBuffer")(queue_, memory, 1, 0, count, bytes, 0, nullptr, nullptr),
              "clEnqueueWriteBuffer");
    }
    void download(void* memory, void* to, std::size_t count) override {
        check(cl_.get<int(STRICT_API*)(Handle, Handle, std::uint32_t, std::size_t, std::size_t,
                                       void*, std::uint32_t, const Handle*, Handle*)>(
                  "clEnqueueReadBuffer")(queue_, memory, 1, 0, count, to, 0, nullptr, nullptr),
              "clEnqueueReadBuffer");
    }
    void release(void* memory) override {
        cl_.get<int(STRICT_API*)(Handle)>("clReleaseMemObject")(memory);
    }
    void finish() override {
        check(cl_.get<int(STRICT_API*)(Handle)>("clFinish")(queue_), "clFinish");
    }
    void describe(OfxPropertySetStruct& arguments) const override {
        arguments.put("OfxImageEffectPropOpenCLEnabled", 1);
        arguments.put("OfxImageEffectPropOpenCLCommandQueue", queue_);
    }

private:
    Library cl_;
    Handle device_, context_ = nullptr, queue_ = nullptr;
};

class CudaGpu final : public Gpu {
public:
    CudaGpu(void* library, Stream stream) : cu_{library}, own_(stream == Stream::kOwn) {
        check(cu_.get<int(STRICT_API*)(int*, int)>("cuDeviceGet")(&device_, 0), "cuDeviceGet");
        check(
            cu_.get<int(STRICT_API*)(Handle*, int)>("cuDevicePrimaryCtxRetain")(&context_, device_),
            "cuDevicePrimaryCtxRetain");
        use();
        if (own_) {
            check(cu_.get<int(STRICT_API*)(Handle*, unsigned)>("cuStreamCreate")(&stream_, 1),
                  "cuStreamCreate");
        }
        if (stream == Stream::kOfThread) stream_ = reinterpret_cast<Handle>(2);
    }
    ~CudaGpu() override {
        if (own_) cu_.get<int(STRICT_API*)(Handle)>("cuStreamDestroy_v2")(stream_);
        cu_.get<int(STRICT_API*)(int)>("cuDevicePrimaryCtxRelease_v2")(device_);
    }

    std::string device() const override {
        char name[256] = "";
        cu_.get<int(STRICT_API*)(char*, int, int)>("cuDeviceGetName")(name, sizeof name - 1,
                                                                      device_);
        return std::string(name) + " (CUDA)";
    }
    void* allocate(const void* bytes, std::size_t count) override {
        use();
        std::uint64_t memory = 0;
        check(
            cu_.get<int(STRICT_API*)(std::uint64_t*, std::size_t)>("cuMemAlloc_v2")(&memory, count),
            "cuMemAlloc");
        upload(reinterpret_cast<void*>(memory), bytes, count);
        return reinterpret_cast<void*>(memory);
    }
    void upload(void* memory, const void* bytes, std::size_t count) override {
        check(cu_.get<int(STRICT_API*)(std::uint64_t, const void*, std::size_t)>("cuMemcpyHtoD_v2")(
                  reinterpret_cast<std::uint64_t>(memory), bytes, count),
              "cuMemcpyHtoD");
    }
    void download(void* memory, void* to, std::size_t count) override {
        finish();
        check(cu_.get<int(STRICT_API*)(void*, std::uint64_t, std::size_t)>("cuMemcpyDtoH_v2")(
                  to, reinterpret_cast<std::uint64_t>(memory), count),
              "cuMemcpyDtoH");
    }
    void release(void* memory) override {
        use();
        cu_.get<int(STRICT_API*)(std::uint64_t)>("cuMemFree_v2")(
            reinterpret_cast<std::uint64_t>(memory));
    }
    void finish() override {
        use();
        check(cu_.get<int(STRICT_API*)(Handle)>("cuStreamSynchronize")(stream_),
              "cuStreamSynchronize");
    }
    bool pin(void* bytes, std::size_t count) override {
        use();
        return cu_.get<int(STRICT_API*)(void*, std::size_t, unsigned)>("cuMemHostRegister_v2")(
                   bytes, count, 0) == 0;
    }
    void unpin(void* bytes) override {
        cu_.get<int(STRICT_API*)(void*)>("cuMemHostUnregister")(bytes);
    }
    void describe(OfxPropertySetStruct& arguments) const override {
        arguments.put("OfxImageEffectPropCudaEnabled", 1);
        if (stream_) arguments.put("OfxImageEffectPropCudaStream", stream_);
    }

private:
    void use() const {
        check(cu_.get<int(STRICT_API*)(Handle)>("cuCtxSetCurrent")(context_), "cuCtxSetCurrent");
    }

    Library cu_;
    const bool own_;
    int device_ = 0;
    Handle context_ = nullptr, stream_ = nullptr;
};

}  // namespace

std::unique_ptr<Gpu> opencl_gpu() {
    static void* const library = load_library({"libOpenCL.so.1", "libOpenCL.so", "OpenCL.dll"});
    if (!library) return nullptr;
    const auto platforms_of = found<int(STRICT_API*)(std::uint32_t, Handle*, std::uint32_t*)>(
        library, "clGetPlatformIDs");
    const auto devices_of =
        found<int(STRICT_API*)(Handle, std::uint64_t, std::uint32_t, Handle*, std::uint32_t*)>(
            library, "clGetDeviceIDs");
    Handle platforms[8] = {};
    std::uint32_t count = 0;
    if (platforms_of(8, platforms, &count)) return nullptr;
    // GPUs first.
    for (const std::uint64_t kind : {std::uint64_t{4}, std::uint64_t{0xFFFFFFFF}}) {
        for (std::uint32_t i = 0; i < count && i < 8; ++i) {
            Handle device = nullptr;
            if (devices_of(platforms[i], kind, 1, &device, nullptr) == 0) {
                return std::make_unique<OpenClGpu>(library, device);
            }
        }
    }
    return nullptr;
}

std::unique_ptr<Gpu> cuda_gpu(Stream stream) {
    static void* const library = load_library({"libcuda.so.1", "nvcuda.dll"});
    if (!library || found<int(STRICT_API*)(unsigned)>(library, "cuInit")(0)) return nullptr;
    return std::make_unique<CudaGpu>(library, stream);
}

}  // namespace strict
