// A host's queue of work for a GPU: draws frames with the kernel, and copies pixels. The systems
// are loaded at run time; without them there are no queues.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gpu/frame_table.hpp"
#include "gpu/library.hpp"

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

/// The kernels, in the order in which they run.
inline constexpr std::array<const char*, 4> kKernels = {"p4d_cells", "p4d_fits", "p4d_means",
                                                        "p4d_draw"};
/// One of them, and how many work items it takes.
struct Pass {
    std::size_t kernel;
    int width, height;
};
std::vector<Pass> passes_of(const FrameTable& frame, const Window& window);

/// What is kept for a context.
struct Context {
    std::mutex mutex{};
    std::string problem{};  ///< a driver's error; after it the kernel is not asked again
    /// Pinned memory that no render uses, and its bytes: what a frame takes.
    std::pair<std::shared_ptr<char>, std::size_t> older{}, newer{};
    /// The device's memory for what passes leave to each other, of the one queue that uses it.
    struct Scratch {
        const void* queue = nullptr;
        std::size_t bytes = 0;
        std::shared_ptr<void> memory{};
    } scratch{};
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
    /// The host's memory for read() and write(): pinned, which copies take a third of the time
    /// with, where the system has it. The context keeps what one frame takes for the next.
    std::shared_ptr<char> memory(std::size_t bytes);
    /// Copy `height` rows of `bytes` bytes, from the device to rows of `row` bytes and back. Both
    /// wait until that is done.
    virtual std::string read(const Place& from, std::size_t bytes, int height, char* to,
                             std::ptrdiff_t row) = 0;
    virtual std::string write(const char* from, std::ptrdiff_t row, std::size_t bytes, int height,
                              const Place& to) = 0;

protected:
    virtual std::shared_ptr<Context> context() = 0;
    /// Makes the kernel ready; under the context's mutex.
    virtual std::string load() = 0;
    virtual std::string enqueue(const FrameTable& frame, const Window& window) = 0;
    /// Sets the memory for a frame's passes. Only those of `queue` use it, which stays alive; or
    /// null, and passes wait for the last ones. The mutex is held until they are enqueued.
    std::string scratch(const FrameTable& frame, const void* queue, void*& memory);
    /// The device's memory, until nothing uses it; null: `problem` says why.
    virtual std::shared_ptr<void> allocate(std::size_t bytes, std::string& problem) = 0;
    /// Until all work is done.
    virtual std::string wait() = 0;
    /// Null where there is none.
    virtual std::shared_ptr<char> pinned(std::size_t) { return nullptr; }

    /// Calls copy(offset, bytes, y) for each row, or once where rows have no gaps; then waits.
    template <class Copy>
    std::string each_row(const Place& place, std::size_t bytes, int height, std::ptrdiff_t row,
                         Copy copy) {
        int error = 0;
        const bool whole = place.row == row && row > 0 && static_cast<std::size_t>(row) == bytes;
        const std::size_t size = whole ? bytes * static_cast<std::size_t>(height) : bytes;
        for (int y = 0; y < (whole ? 1 : height) && !error; ++y) {
            error = copy(place.start + place.row * y, size, y);
        }
        const std::string finished = wait();
        return error ? driver_error("copying pixels", error) : finished;
    }
};

/// A cl_command_queue, for a node. Null where OpenCL cannot be loaded.
std::unique_ptr<Queue> opencl_queue(void* queue, const void* node);
/// A CUstream of the current context; null: the default one, and all calls wait. Null where CUDA
/// cannot be loaded.
std::unique_ptr<Queue> cuda_queue(void* stream, bool waits);
/// An id<MTLCommandQueue>. Null where there is no Objective-C.
std::unique_ptr<Queue> metal_queue(void* queue);

/// A node ends: frees what is kept for contexts of OpenCL that no other node has used.
void leave(const void* node);
/// Frees what is kept for contexts. Only while no queue is in use.
void purge();

}  // namespace palette4d::gpu
