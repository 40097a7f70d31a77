#include "gpu/queue.hpp"

namespace palette4d::gpu {

void purge_opencl();
void purge_cuda();

void purge() {
    purge_opencl();
    purge_cuda();
}

}  // namespace palette4d::gpu
