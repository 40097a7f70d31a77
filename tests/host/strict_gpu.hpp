// The memory and the queue of a device, as hosts hand them to effects.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "strict_host.hpp"

namespace strict {

/// One context of a device, and one queue. Throws std::runtime_error where the driver fails.
class Gpu {
public:
    virtual ~Gpu() = default;
    virtual std::string device() const = 0;
    /// Memory with these bytes; what kOfxImagePropData then holds.
    virtual void* allocate(const void* bytes, std::size_t count) = 0;
    virtual void upload(void* memory, const void* bytes, std::size_t count) = 0;
    /// Waits for the queue, and copies.
    virtual void download(void* memory, void* to, std::size_t count) = 0;
    virtual void release(void* memory) = 0;
    virtual void finish() = 0;
    /// Keeps memory of the process where the device reads it, for quicker copies, until unpin().
    /// False: not in this system.
    virtual bool pin(void*, std::size_t) { return false; }
    virtual void unpin(void*) {}
    /// What a render's arguments say.
    virtual void describe(OfxPropertySetStruct& arguments) const = 0;
};

/// Null where the system has no device.
std::unique_ptr<Gpu> opencl_gpu();
/// The stream in the arguments; that of each thread has the same handle in all of them.
enum class Stream { kOwn, kNone, kOfThread };
std::unique_ptr<Gpu> cuda_gpu(Stream stream = Stream::kOwn);

}  // namespace strict
