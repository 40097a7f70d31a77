#include "gpu/queue.hpp"

#include <chrono>

namespace palette4d::gpu {

std::string Queue::draw(const FrameTable& frame, const Window& window, double* took) {
    Context& here = context();
    {
        const std::lock_guard<std::mutex> lock(here.mutex);
        if (here.problem.empty()) here.problem = load();
        if (!here.problem.empty()) return here.problem;
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
        const std::lock_guard<std::mutex> lock(here.mutex);
        here.problem = problem;
    }
    return problem;
}

void purge_opencl();
void purge_cuda();

void purge() {
    purge_opencl();
    purge_cuda();
}

}  // namespace palette4d::gpu
