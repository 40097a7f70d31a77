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
    if (problem.empty()) problem = enqueue(frame, window);
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

void purge_opencl();
void purge_cuda();
void purge_metal();

void purge() {
    purge_opencl();
    purge_cuda();
    purge_metal();
}

}  // namespace palette4d::gpu
