#include "gpu/queue.hpp"

#include <chrono>

namespace palette4d::gpu {

std::string Queue::draw(const FrameTable& frame, const Window& window, double* took) {
    const std::shared_ptr<Context> here = context();
    {
        const std::lock_guard<std::mutex> lock(here->mutex);
        if (here->problem.empty()) here->problem = load();
        if (!here->problem.empty()) return here->problem;
    }
    std::string problem = took ? wait() : "";
    const auto start = std::chrono::steady_clock::now();
    if (problem.empty()) {
        // The passes of a frame share memory: those of another thread must not come between.
        std::unique_lock<std::mutex> lock(here->mutex, std::defer_lock);
        if (frame.scratch() > 0) lock.lock();
        problem = enqueue(frame, window);
    }
    if (took && problem.empty()) problem = wait();
    if (took) {
        const std::chrono::duration<double, std::milli> time =
            std::chrono::steady_clock::now() - start;
        *took = time.count();
    }
    if (!problem.empty()) {
        const std::lock_guard<std::mutex> lock(here->mutex);
        here->problem = problem;
    }
    return problem;
}

std::vector<Pass> passes_of(const FrameTable& frame, const Window& window) {
    std::vector<Pass> passes;
    for (std::size_t i = 0; i + 1 < kKernels.size() && frame.scratch() > 0; ++i) {
        passes.push_back({i, frame.columns, frame.rows});
    }
    passes.push_back({kKernels.size() - 1, window.width, window.height});
    return passes;
}

std::string Queue::scratch(const FrameTable& frame, const void* queue, void*& memory) {
    const std::size_t bytes = frame.scratch() * sizeof(float);
    if (bytes == 0) return "";
    std::string problem;
    Context::Scratch& kept = context()->scratch;
    if (kept.queue != queue || kept.bytes < bytes) {
        kept = {};
        kept = {queue, bytes, allocate(bytes, problem)};
    }
    memory = kept.memory.get();
    if (!memory) kept = {};
    return problem;
}

std::shared_ptr<char> Queue::memory(std::size_t bytes) {
    const std::shared_ptr<Context> here = context();
    std::shared_ptr<char> found;
    {
        const std::lock_guard<std::mutex> lock(here->mutex);
        for (auto* const one : {&here->newer, &here->older}) {
            if (!found && one->second == bytes) found.swap(one->first);
        }
    }
    if (!found) found = pinned(bytes);
    if (!found) return {new char[bytes], std::default_delete<char[]>()};
    char* const start = found.get();
    return {start, [here, bytes, found = std::move(found)](char*) mutable {
                const std::lock_guard<std::mutex> lock(here->mutex);
                if (here->older.first && here->newer.first) here->older = std::move(here->newer);
                (here->older.first ? here->newer : here->older) = {std::move(found), bytes};
            }};
}

void leave_opencl(const void* node);
void purge_opencl();
void purge_cuda();
void purge_metal();

void leave(const void* node) { leave_opencl(node); }

void purge() {
    purge_opencl();
    purge_cuda();
    purge_metal();
}

}  // namespace palette4d::gpu
