// A host's queue of work for a GPU: draws frames with the kernel, and copies pixels. The systems
// are loaded at run time; without them there are no queues.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

#include "gpu/frame_table.hpp"

namespace palette4d::gpu {

/// Pixels in the memory of a device: the host's handle of it, and the first pixel and the distance
/// of rows from there.
struct Place {
    void* data = nullptr;
    std::ptrdiff_t start = 0, row = 0;  ///< in bytes
};

/// A window of RGBA float pixels. The source covers [x1, x2) x [y1, y2) of it; the rest becomes
/// transparent black.
struct Window {
    Place in, out;
    int width = 0, height = 0;
    int x1 = 0, y1 = 0, x2 = 0, y2 = 0;
};

/// A driver's error in a context. After it the context is not asked again.
struct Context {
    std::mutex mutex{};
    std::string problem{};
};

/// For one render, in one thread. Functions return what went wrong, or nothing.
class Queue {
public:
    virtual ~Queue() = default;
    /// The device, as its driver names it, and the system.
    virtual std::string device() const = 0;
    /// Draws after what the queue has, and does not wait where the host does not expect it. After
    /// an error each draw() of this context returns it. With `took` it waits, and sets the
    /// milliseconds of this draw.
    std::string draw(const FrameTable& frame, const Window& window, double* took = nullptr);
    /// Copy `height` rows of `bytes` bytes, from the device to rows of `row` bytes and back. Both
    /// wait until that is done.
    virtual std::string read(const Place& from, std::size_t bytes, int height, char* to,
                             std::ptrdiff_t row) = 0;
    virtual std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                              const Place& to) = 0;

protected:
    virtual Context& context() = 0;
    /// Makes the kernel ready; under the context's mutex.
    virtual std::string load() = 0;
    virtual std::string enqueue(const FrameTable& frame, const Window& window) = 0;
    /// Until all work is done.
    virtual std::string wait() = 0;
};

/// A cl_command_queue. Null where OpenCL cannot be loaded.
std::unique_ptr<Queue> opencl_queue(void* queue);
/// A CUstream of the current context; null: the default one, and all calls wait. Null where CUDA
/// cannot be loaded.
std::unique_ptr<Queue> cuda_queue(void* stream, bool waits);

/// Frees what is kept for contexts. Only while no queue is in use.
void purge();

}  // namespace palette4d::gpu
