#include "gpu_render.hpp"

#include <cstdint>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>

namespace palette4d::node {
namespace {

/// The systems that the node can draw with. Metal was never tried: who tries it says so.
std::vector<const char*> supported() {
    std::vector<const char*> all = {kOfxImageEffectPropOpenCLRenderSupported,
                                    kOfxImageEffectPropCudaRenderSupported};
    const char* const metal = std::getenv("PALETTE4D_METAL");
    if (metal && std::string(metal) == "1") all.push_back(kOfxImageEffectPropMetalRenderSupported);
    return all;
}

bool is_on(const Properties& arguments, const char* name) {
    return arguments.get_int(name).value_or(0) == 1;
}

gpu::Place place_of(const Image& image, int x, int y) {
    const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(y) - image.bounds.y1;
    const std::ptrdiff_t columns = static_cast<std::ptrdiff_t>(x) - image.bounds.x1;
    return {image.data, rows * image.row_bytes + columns * image.pixel_bytes, image.row_bytes};
}

std::size_t row_of(const OfxRectI& area, int pixel_bytes) {
    return static_cast<std::size_t>(static_cast<std::int64_t>(area.x2) - area.x1) *
           static_cast<std::size_t>(pixel_bytes);
}

/// Whether the kernel can address an image: its numbers are counted in 32 bits.
bool addressable(const Image& image) {
    const std::int64_t height = static_cast<std::int64_t>(image.bounds.y2) - image.bounds.y1;
    return image.row_bytes % static_cast<std::ptrdiff_t>(sizeof(float)) == 0 &&
           std::abs(static_cast<std::int64_t>(image.row_bytes)) / 4 * (height + 1) <
               std::numeric_limits<std::int32_t>::max();
}

bool is_float_rgba(const Image& image) {
    return image.depth == Depth::kFloat && image.channels == 4;
}

/// An image of the same kind in memory of the host's, without gaps.
Image packed(gpu::Queue& queue, const Image& like, const OfxRectI& bounds,
             std::shared_ptr<char>& memory) {
    Image image = like;
    image.bounds = bounds;
    const std::size_t row = row_of(bounds, like.pixel_bytes);
    image.row_bytes = static_cast<std::ptrdiff_t>(row);
    memory = queue.memory(
        row * static_cast<std::size_t>(static_cast<std::int64_t>(bounds.y2) - bounds.y1));
    image.data = memory.get();
    return image;
}

}  // namespace

void describe_gpu(const Properties& node) {
    for (const char* name : supported()) node.set_string(name, "true");
    node.set_string(kOfxImageEffectPropCudaStreamSupported, "true");
}

bool renders_on_gpus(const Suites& suites) {
    const Properties host(suites, suites.host);
    for (const char* name : supported()) {
        if (host.get_string(name) == "true") return true;
    }
    return false;
}

void define_gpu_param(ParamDefiner& define) {
    define.choice({kParamGpu, "GPU",
                   "Auto: draws on the GPU where the host has its pictures there, within 0.0001 of "
                   "the processor. Off: copies them to the processor and back, and draws there. "
                   "Status names the device."},
                  {"Auto", "Off"});
}

bool gpu_wanted(const Params& params, OfxTime time) {
    return params.int_at(kParamGpu, time).value_or(0) == 0;
}

GpuRender::GpuRender(const Properties& arguments, OfxImageEffectHandle effect) {
    if (is_on(arguments, kOfxImageEffectPropOpenCLEnabled)) {
        enabled = true;
        queue = gpu::opencl_queue(
            arguments.get_pointer(kOfxImageEffectPropOpenCLCommandQueue).value_or(nullptr), effect);
    } else if (is_on(arguments, kOfxImageEffectPropCudaEnabled)) {
        enabled = true;
        void* const stream = arguments.get_pointer(kOfxImageEffectPropCudaStream).value_or(nullptr);
        queue = gpu::cuda_queue(stream, !stream);
    } else if (is_on(arguments, kOfxImageEffectPropMetalEnabled)) {
        enabled = true;
        queue = gpu::metal_queue(
            arguments.get_pointer(kOfxImageEffectPropMetalCommandQueue).value_or(nullptr));
    }
}

std::string draw_by_kernel(gpu::Queue& queue, const Image* in, const Image& out,
                           const OfxRectI& window, const NodeDrawing& drawing,
                           const CleanUp::Place* place, double* took) {
    if (!is_float_rgba(out)) return "the kernel lacks pictures other than RGBA in float";
    if (!addressable(out) || (in && !addressable(*in))) return "the kernel lacks rows of this size";
    const std::string lacking = gpu::lacks(drawing);
    if (!lacking.empty()) return "the kernel lacks " + lacking;
    const bool matte_of_opaque =
        in && in->opaque && drawing.options.is_matte() && drawing.options.in_alpha;
    if (matte_of_opaque) return "the kernel lacks mattes in the alpha of opaque pictures";
    gpu::Window work;
    work.width = window.x2 - window.x1;
    work.height = window.y2 - window.y1;
    work.out = work.in = place_of(out, window.x1, window.y1);
    if (in) {
        const OfxRectI covered = intersect(window, in->bounds);
        work.in = place_of(*in, window.x1, window.y1);
        if (!is_empty(covered)) {
            work.x1 = covered.x1 - window.x1;
            work.y1 = covered.y1 - window.y1;
            work.x2 = covered.x2 - window.x1;
            work.y2 = covered.y2 - window.y1;
        }
    }
    const bool premultiplied = in && in->premultiplied;
    const gpu::FrameTable frame = gpu::frame_table(drawing, premultiplied, place);
    if (frame.scratch() > std::numeric_limits<std::int32_t>::max()) {
        return "the kernel lacks pictures of this size";
    }
    return queue.draw(frame, work, took);
}

std::string words_of_time(double milliseconds) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << std::fixed << std::setprecision(milliseconds < 10 ? 1 : 0) << milliseconds << " ms";
    return text.str();
}

HostCopy::HostCopy(gpu::Queue& queue, const std::optional<Image>& from) {
    if (!from) return;
    const OfxRectI& bounds = from->bounds;
    image_ = packed(queue, *from, bounds, memory_);
    whole_ = queue
                 .read(place_of(*from, bounds.x1, bounds.y1), row_of(bounds, from->pixel_bytes),
                       bounds.y2 - bounds.y1, memory_.get(), image_->row_bytes)
                 .empty();
}

HostWindow::HostWindow(gpu::Queue& queue, const Image& of, const OfxRectI& window)
    : queue_(queue), to_(of), image_(packed(queue, of, window, memory_)) {}

bool HostWindow::upload() {
    const OfxRectI& window = image_.bounds;
    return queue_
        .write(memory_.get(), image_.row_bytes, row_of(window, to_.pixel_bytes),
               window.y2 - window.y1, place_of(to_, window.x1, window.y1))
        .empty();
}

}  // namespace palette4d::node
