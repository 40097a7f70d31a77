// Renders whose pictures are in the memory of a GPU. No host pointer leads there: whoever touches
// an image's data asks this first.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "draw_images.hpp"
#include "gpu/queue.hpp"
#include "host.hpp"
#include "param_define.hpp"
#include "params.hpp"
#include "pixels.hpp"

namespace palette4d::node {

inline constexpr const char* kParamGpu = "gpu";

/// In Describe: the systems that the node can draw with.
void describe_gpu(const Properties& node);
/// Whether the host says that it renders on GPUs; other hosts get no parameter.
bool renders_on_gpus(const Suites& suites);
void define_gpu_param(ParamDefiner& define);
/// False: the kernel is switched off.
bool gpu_wanted(const Params& params, OfxTime time);

struct GpuRender {
    bool enabled = false;               ///< the images' data are a GPU's
    std::unique_ptr<gpu::Queue> queue;  ///< null where they are, and the system is not to be had
    GpuRender(const Properties& render_arguments, OfxImageEffectHandle effect);
};

/// Draws the window with the kernel; `in` is null for transparent black, and `place` is where it is
/// cleaned up. Returns what kept it from that. `took` as in Queue::draw().
std::string draw_by_kernel(gpu::Queue& queue, const Image* in, const Image& out,
                           const OfxRectI& window, const NodeDrawing& drawing,
                           const CleanUp::Place* place, double* took);

/// "1.7 ms", "34 ms"
std::string words_of_time(double milliseconds);

/// An image's copy in the host's memory.
class HostCopy {
public:
    HostCopy(gpu::Queue& queue, const std::optional<Image>& from);
    /// Without an image it is whole, too.
    bool whole() const { return whole_; }
    const std::optional<Image>& image() const { return image_; }

private:
    std::shared_ptr<char> memory_;
    std::optional<Image> image_;
    bool whole_ = true;
};

/// Memory for a window of an image, which goes there by upload().
class HostWindow {
public:
    HostWindow(gpu::Queue& queue, const Image& of, const OfxRectI& window);
    const Image& image() const { return image_; }
    bool upload();

private:
    gpu::Queue& queue_;
    const Image to_;
    std::shared_ptr<char> memory_;
    Image image_;
};

}  // namespace palette4d::node
