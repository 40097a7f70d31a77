// A libOpenCL.so.1 between the node and the real one: it counts the node's calls, and refuses some.
// What the strict host calls goes through.
#include <dlfcn.h>

#include <atomic>
#include <cstdint>
#include <cstring>

namespace {

using Handle = void*;
using Int = std::int32_t;
using Uint = std::uint32_t;
using Bits = std::uint64_t;
using Size = std::size_t;

void* g_real = nullptr;
std::atomic<long> g_calls{0}, g_alive{0}, g_first{0};
std::atomic<int> g_error{0};
std::atomic<bool> g_all{false};

/// Whether the call is from the node.
bool is_node(const void* caller) {
    Dl_info info{};
    return dladdr(caller, &info) && info.dli_fname && std::strstr(info.dli_fname, ".ofx");
}

/// The error that a call is to answer; 0: it goes through.
int refused(const void* caller) {
    if (!is_node(caller)) return 0;
    const long call = ++g_calls, first = g_first;
    return first > 0 && (call == first || (g_all && call > first)) ? g_error.load() : 0;
}

/// Counts the node's objects.
Handle made(const void* caller, Handle handle) {
    if (handle && is_node(caller)) ++g_alive;
    return handle;
}

template <class Function>
Function real(const char* name) {
    return reinterpret_cast<Function>(dlsym(g_real, name));
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

bool palette4d_faults_open(const char* path) {
    return (g_real = dlopen(path, RTLD_NOW)) != nullptr;
}
/// Of the node's next calls the `first` one, or all from there, answer `error`. 0: none.
void palette4d_faults_set(long first, int error, bool all) {
    g_calls = 0;
    g_error = error;
    g_all = all;
    g_first = first;
}
long palette4d_faults_calls() { return g_calls; }
long palette4d_faults_alive() { return g_alive; }

#define CALLER __builtin_return_address(0)
#define PASSED(name, types, names)                           \
    Int name types {                                         \
        if (const int error = refused(CALLER)) return error; \
        return real<Int(*) types>(#name) names;              \
    }
// Never refused: what is refused stays for ever.
#define RELEASING(name)                          \
    Int name(Handle of) {                        \
        if (is_node(CALLER)) --g_alive;          \
        return real<Int (*)(Handle)>(#name)(of); \
    }
#define RETAINING(name)                                      \
    Int name(Handle of) {                                    \
        if (const int error = refused(CALLER)) return error; \
        made(CALLER, of);                                    \
        return real<Int (*)(Handle)>(#name)(of);             \
    }
#define MAKING(name, types, names)                               \
    Handle name types {                                          \
        if (const int refusal = refused(CALLER)) {               \
            if (error) *error = refusal;                         \
            return nullptr;                                      \
        }                                                        \
        return made(CALLER, real<Handle(*) types>(#name) names); \
    }

PASSED(clGetPlatformIDs, (Uint n, Handle* to, Uint* count), (n, to, count))
PASSED(clGetDeviceIDs, (Handle of, Bits kind, Uint n, Handle* to, Uint* count),
       (of, kind, n, to, count))
PASSED(clGetDeviceInfo, (Handle of, Uint what, Size n, void* to, Size* size),
       (of, what, n, to, size))
PASSED(clGetCommandQueueInfo, (Handle of, Uint what, Size n, void* to, Size* size),
       (of, what, n, to, size))
PASSED(clBuildProgram,
       (Handle of, Uint n, const Handle* devices, const char* options, void (*done)(Handle, void*),
        void* data),
       (of, n, devices, options, done, data))
PASSED(clSetKernelArg, (Handle of, Uint index, Size n, const void* value), (of, index, n, value))
PASSED(clEnqueueNDRangeKernel,
       (Handle to, Handle kernel, Uint n, const Size* from, const Size* size, const Size* group,
        Uint events, const Handle* list, Handle* event),
       (to, kernel, n, from, size, group, events, list, event))
PASSED(clEnqueueReadBuffer,
       (Handle to, Handle of, Uint waits, Size from, Size n, void* into, Uint events,
        const Handle* list, Handle* event),
       (to, of, waits, from, n, into, events, list, event))
PASSED(clEnqueueWriteBuffer,
       (Handle to, Handle of, Uint waits, Size from, Size n, const void* data, Uint events,
        const Handle* list, Handle* event),
       (to, of, waits, from, n, data, events, list, event))
PASSED(clEnqueueUnmapMemObject,
       (Handle to, Handle of, void* mapped, Uint events, const Handle* list, Handle* event),
       (to, of, mapped, events, list, event))
PASSED(clFlush, (Handle of), (of))
PASSED(clFinish, (Handle of), (of))
RETAINING(clRetainContext)
RETAINING(clRetainCommandQueue)
RELEASING(clReleaseMemObject)
RELEASING(clReleaseKernel)
RELEASING(clReleaseProgram)
RELEASING(clReleaseContext)
RELEASING(clReleaseCommandQueue)

MAKING(clCreateContext,
       (const void* properties, Uint n, const Handle* devices, Handle done, Handle data,
        Int* error),
       (properties, n, devices, done, data, error))
MAKING(clCreateCommandQueue, (Handle of, Handle device, Bits properties, Int* error),
       (of, device, properties, error))
MAKING(clCreateProgramWithSource,
       (Handle of, Uint n, const char** texts, const Size* lengths, Int* error),
       (of, n, texts, lengths, error))
MAKING(clCreateKernel, (Handle of, const char* name, Int* error), (of, name, error))
void* clEnqueueMapBuffer(Handle to, Handle of, Uint waits, Bits flags, Size from, Size n,
                         Uint events, const Handle* list, Handle* event, Int* error) {
    if (const int refusal = refused(CALLER)) {
        if (error) *error = refusal;
        return nullptr;
    }
    return real<void* (*)(Handle, Handle, Uint, Bits, Size, Size, Uint, const Handle*, Handle*,
                          Int*)>("clEnqueueMapBuffer")(to, of, waits, flags, from, n, events, list,
                                                       event, error);
}
MAKING(clCreateBuffer, (Handle of, Bits flags, Size n, void* data, Int* error),
       (of, flags, n, data, error))
}
