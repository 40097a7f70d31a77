#include "render.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clip_image.hpp"
#include "describe.hpp"
#include "draw_images.hpp"
#include "frame_setup.hpp"
#include "gpu_render.hpp"
#include "instance.hpp"
#include "output_params.hpp"
#include "pixels.hpp"
#include "sidecar_choice.hpp"
#include "threads.hpp"

namespace palette4d::node {
namespace {

/// In this context the host's brush is a mask for the result.
bool is_paint(const Suites& suites, OfxImageEffectHandle effect) {
    OfxPropertySetHandle handle = nullptr;
    return suites.effect->getPropertySet &&
           suites.effect->getPropertySet(effect, &handle) == kOfxStatOK &&
           Properties(suites, handle).get_string(kOfxImageEffectPropContext) ==
               kOfxImageEffectContextPaint;
}

/// Horizontal and vertical render scale.
struct Scale {
    double x = 1, y = 1;
};

Scale scale_of(const Properties& in_args) {
    const auto one = [&](int index) {
        const double scale = in_args.get_double(kOfxImageEffectPropRenderScale, index).value_or(1);
        return std::isfinite(scale) && scale > 0 ? scale : 1;
    };
    return {one(0), one(1)};
}

/// Whether both images have memory in common.
bool overlap(const Image& a, const Image& b) {
    const auto span = [](const Image& image) {
        const char* const first = image.at(image.bounds.x1, image.bounds.y1);
        const char* const last = image.at(image.bounds.x1, image.bounds.y2 - 1);
        const std::ptrdiff_t row =
            static_cast<std::ptrdiff_t>(image.bounds.x2 - image.bounds.x1) * image.pixel_bytes;
        const std::less<const char*> before;
        return before(first, last) ? std::make_pair(first, last + row)
                                   : std::make_pair(last, first + row);
    };
    const auto [a1, a2] = span(a);
    const auto [b1, b2] = span(b);
    const std::less<const char*> before;
    return before(a1, b2) && before(b1, a2);
}

/// The source in memory of its own.
struct Copied {
    Image image;
    std::vector<char> memory;

    explicit Copied(const Image& from) : image(from) {
        image.row_bytes =
            static_cast<std::ptrdiff_t>(from.bounds.x2 - from.bounds.x1) * from.pixel_bytes;
        memory.resize(static_cast<std::size_t>(image.row_bytes) *
                      static_cast<std::size_t>(from.bounds.y2 - from.bounds.y1));
        image.data = memory.data();
        copy(from, image, from.bounds);
    }
};

Area area_of(const OfxRectI& rect) { return {rect.x1, rect.y1, rect.x2, rect.y2}; }

/// Where the clip's picture is, in which windows of picks lie. A host may hand over more of a file
/// (overscan) or less (an element in its bounding box): if the project alone has the clip's size,
/// that is where its picture is. A picture of the clip's shape in the project's corner is a proxy.
Area clip_area(const Suites& suites, OfxImageEffectHandle effect, const OfxRectI& definition,
               const Scale& scale, const Drawing& drawing) {
    const Recolourer* const map = drawing.reader ? drawing.reader.get() : drawing.edit.get();
    OfxPropertySetHandle handle = nullptr;
    if (!map || !map->picks().windows() || !suites.effect->getPropertySet ||
        suites.effect->getPropertySet(effect, &handle) != kOfxStatOK) {
        return area_of(definition);
    }
    const Properties properties(suites, handle);
    const auto pixels = [&](const char* name, int index, double by) {
        const double value = properties.get_double(name, index).value_or(0) * by;
        return std::isfinite(value) && std::abs(value) < 1e6 ? std::lround(value) : 0L;
    };
    const double aspect =
        properties.get_double(kOfxImageEffectPropProjectPixelAspectRatio).value_or(1);
    const double x = scale.x / (aspect > 0 ? aspect : 1), y = scale.y;
    const auto width = static_cast<double>(pixels(kOfxImageEffectPropProjectSize, 0, x));
    const auto height = static_cast<double>(pixels(kOfxImageEffectPropProjectSize, 1, y));
    const double own_width = map->picks().width, own_height = map->picks().height;
    const auto has_its_size = [&](double w, double h) {
        return std::abs(own_width * scale.x - w) <= 1 && std::abs(own_height * scale.y - h) <= 1;
    };
    const int left = static_cast<int>(pixels(kOfxImageEffectPropProjectOffset, 0, x));
    const int bottom = static_cast<int>(pixels(kOfxImageEffectPropProjectOffset, 1, y));
    const double wide = static_cast<double>(definition.x2) - definition.x1;
    const double high = static_cast<double>(definition.y2) - definition.y1;
    const double shape = own_width * scale.x / (own_height * scale.y);
    const bool has_its_shape = std::abs(wide - high * shape) <= std::max(1.0, shape);
    const bool is_proxy = has_its_shape && definition.x1 == left && definition.y1 == bottom;
    if (is_proxy || has_its_size(wide, high) || !has_its_size(width, height)) {
        return area_of(definition);
    }
    return {left, bottom, left + static_cast<int>(width), bottom + static_cast<int>(height)};
}

/// Where a window of a source is cleaned up.
CleanUp::Place clean_up_place(const Image& in, const OfxRectI& window, const Scale& scale,
                              const Drawing& drawing) {
    const double lines = clip_lines(drawing);
    return {area_of(in.definition),
            area_of(in.bounds),
            area_of(window),
            drawing.picture,
            clean_up_cell(scale.x, lines),
            clean_up_cell(scale.y, lines)};
}

/// Filters what picks do in the window. The source should reach regions_of_interest() beyond it;
/// where a host gives less, the filter sees what there is.
std::shared_ptr<const CleanUp> cleaned_up(const Suites& suites, const Image& in,
                                          const OfxRectI& window, const NodeDrawing& drawing,
                                          const Scale& scale, const std::function<bool()>& stop) {
    const std::shared_ptr<CleanUp> clean_up = make_clean_up(
        drawing, {in.channels, in.premultiplied}, clean_up_place(in, window, scale, drawing));
    if (!clean_up) return nullptr;
    const auto read = [&](int y, int x1, int x2, float* space) -> const float* {
        if (in.depth == Depth::kFloat && is_aligned(in))
            return reinterpret_cast<const float*>(in.at(x1, y));
        read_floats(in, {x1, y, x2, y + 1}, space);
        return space;
    };
    const auto share = [&](int count, const std::function<void(int)>& work) {
        for_each_band(suites, 0, count, [&](int i, int) { work(i); }, stop, 1);
    };
    clean_up->prepare(read, thread_count(suites), share);
    return clean_up;
}

/// Draws the window. On an exception it copies the source and rethrows.
OfxStatus draw_window(const Suites& suites, OfxImageEffectHandle effect, const Image& source,
                      const Image& out, const OfxRectI& window, const Scale& scale,
                      FrameSetup& setup) {
    const auto stop = [&] { return suites.effect->abort && suites.effect->abort(effect) != 0; };
    try {
        Image in = source;
        std::optional<Copied> copied;
        setup.drawing.clean_up = cleaned_up(suites, in, window, setup.drawing, scale, stop);
        if (setup.drawing.clean_up && overlap(source, out)) {
            // What is drawn must not change what the filter's neighbours read.
            in = copied.emplace(source).image;
        }
        for_each_band(
            suites, window.y1, window.y2,
            [&](int y1, int y2) { draw(in, out, {window.x1, y1, window.x2, y2}, setup.drawing); },
            stop);
    } catch (...) {
        copy(source, out, window);
        throw;
    }
    return kOfxStatOK;
}

}  // namespace

OfxStatus is_identity(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args,
                      const Properties& out_args) {
    const std::optional<double> time = in_args.get_double(kOfxPropTime);
    if (!time) return kOfxStatReplyDefault;
    // Such hosts report the media frame when they render, but not in this action.
    if (!Params(suites, effect).media().empty()) return kOfxStatReplyDefault;
    const FrameSetup setup = frame_setup_at(suites, effect, *time);
    // With a problem, the node must render to show its message.
    if (!setup.passes || !setup.problem.empty() || !setup.note.empty()) return kOfxStatReplyDefault;
    report(suites, effect, "");
    if (!out_args.set_string(kOfxPropName, kOfxImageEffectSimpleSourceClipName)) {
        return kOfxStatReplyDefault;
    }
    out_args.set_double(kOfxPropTime, *time);  // hosts that refuse this use the current time anyway
    return kOfxStatOK;
}

OfxStatus regions_of_interest(const Suites& suites, OfxImageEffectHandle effect,
                              const Properties& in_args, const Properties& out_args) {
    const std::optional<double> time = in_args.get_double(kOfxPropTime);
    if (!time) return kOfxStatReplyDefault;
    std::array<double, 4> region{};
    for (std::size_t i = 0; i < region.size(); ++i) {
        const auto side =
            in_args.get_double(kOfxImageEffectPropRegionOfInterest, static_cast<int>(i));
        if (!side) return kOfxStatReplyDefault;
        region[i] = *side;
    }
    const Params params(suites, effect);
    const OutputSettings settings = output_settings_at(params, *time);
    const bool other_matte = settings.is_matte() && settings.output != Output::kPick;
    if (settings.clean_up == 0 || settings.passes() || other_matte) return kOfxStatReplyDefault;
    const Chosen chosen = chosen_sidecar(params);
    if (!chosen.sidecar() || chosen.sidecar()->edits.picks.empty()) return kOfxStatReplyDefault;
    OfxImageClipHandle clip = nullptr;
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->clipGetHandle ||
        suites.effect->clipGetHandle(effect, kOfxImageEffectSimpleSourceClipName, &clip, &handle) !=
            kOfxStatOK) {
        handle = nullptr;
    }
    const double aspect =
        Properties(suites, handle).get_double(kOfxImagePropPixelAspectRatio).value_or(1);
    // From pixels to canonical coordinates.
    const Scale scale = scale_of(in_args);
    const double lines = chosen.sidecar()->edits.height;
    const double x =
        clean_up_support(clean_up_cell(scale.x, lines)) * std::max(aspect, 0.0) / scale.x;
    const double y = clean_up_support(clean_up_cell(scale.y, lines)) / scale.y;
    const std::string name =
        std::string("OfxImageClipPropRoI_") + kOfxImageEffectSimpleSourceClipName;
    out_args.set_doubles(name.c_str(),
                         {region[0] - x, region[1] - y, region[2] + x, region[3] + y});
    return kOfxStatOK;
}

namespace {

/// The pictures of a render. Their data may be in a GPU's memory.
struct Pictures {
    Image out;
    std::optional<Image> in;  ///< empty: no source, or one that cannot be read
    bool absent = false;      ///< the host has no source here
    bool paint = false;       ///< the brush is the mask
    std::optional<Image> brush{};
    bool brush_absent = false;
};

enum class Action { kDraw, kCopy, kClear };

/// What becomes of the window. Made without a look at pixels.
struct Plan {
    Action action = Action::kDraw;
    OfxStatus status = kOfxStatOK;
    FrameSetup setup{};
    std::exception_ptr error = nullptr;  ///< to be thrown again once the window is whole

    Plan& with(Action other, OfxStatus answer = kOfxStatOK) {
        action = other;
        status = answer;
        return *this;
    }
};

Plan plan_of(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args,
             OfxTime time, const Pictures& pictures) {
    Plan plan;
    if (!pictures.in || !same_format(*pictures.in, pictures.out)) {
        // Never show the host's uninitialised memory.
        return plan.with(Action::kClear, pictures.absent ? kOfxStatOK : kOfxStatFailed);
    }
    const OfxRectI& whole = pictures.out.definition;
    std::optional<double> source_frame;
    if (const auto index = in_args.get_int(kResolvePropSrcFrame)) source_frame = *index;
    note_source_frame(effect, time, source_frame);
    FrameSetup& setup = plan.setup;
    try {
        setup = frame_setup_at(suites, effect, time, source_frame);
    } catch (...) {
        plan.error = std::current_exception();
        return plan.with(Action::kCopy);
    }
    report(suites, effect, setup.problem.empty() ? setup.note : setup.problem);
    // Alpha-only pictures pass through too.
    if (setup.passes || pictures.in->channels < 3) return plan.with(Action::kCopy);
    setup.drawing.picture = clip_area(suites, effect, whole, scale_of(in_args), setup.drawing);
    // A host that bakes a LUT wants colours only, so no mattes and no strip.
    if (in_args.get_string(kOfxImageEffectPropNoSpatialAwareness) == "true") {
        setup.drawing.options.clean_up = 0;
        if (setup.drawing.options.output == Output::kPalette) {
            setup.drawing.options.output = Output::kRecoloured;
            if (!setup.drawing.edit) return plan.with(Action::kCopy);
        }
    }
    if (pictures.paint && !pictures.brush) {
        return plan.with(Action::kCopy, pictures.brush_absent ? kOfxStatOK : kOfxStatFailed);
    }
    return plan;
}

/// Draws in the host's memory.
OfxStatus draw_here(const Suites& suites, OfxImageEffectHandle effect, const Pictures& pictures,
                    const OfxRectI& window, const Scale& scale, Plan& plan) {
    if (plan.action == Action::kClear) {
        clear(pictures.out, window);
    } else if (plan.action == Action::kCopy) {
        copy(*pictures.in, pictures.out, window);
    } else {
        if (pictures.brush) plan.setup.drawing.mask = &*pictures.brush;
        return draw_window(suites, effect, *pictures.in, pictures.out, window, scale, plan.setup);
    }
    if (plan.error) std::rethrow_exception(plan.error);
    return plan.status;
}

/// Draws in a GPU's memory: with the kernel, or in copies where that lacks something.
OfxStatus draw_there(const Suites& suites, OfxImageEffectHandle effect, const Pictures& pictures,
                     const OfxRectI& window, const Scale& scale, Plan& plan, gpu::Queue& queue,
                     bool by_kernel) {
    std::string problem = by_kernel ? "" : "GPU is Off";
    if (by_kernel) {
        static const NodeDrawing kAsItIs;
        const bool draws = plan.action == Action::kDraw;
        const NodeDrawing& drawing = draws ? plan.setup.drawing : kAsItIs;
        const Image* const in = plan.action == Action::kClear ? nullptr : &*pictures.in;
        std::optional<CleanUp::Place> place;
        if (in && draws) place = clean_up_place(*in, window, scale, drawing);
        double took = 0;
        const bool measures = draws && measures_gpu(effect);
        problem = draws && pictures.brush
                      ? "the kernel lacks the brush"
                      : draw_by_kernel(queue, in, pictures.out, window, drawing,
                                       place ? &*place : nullptr, measures ? &took : nullptr);
        if (problem.empty()) {
            note_gpu_frame(effect, queue.device(), measures ? words_of_time(took) : "");
            if (plan.error) std::rethrow_exception(plan.error);
            return plan.status;
        }
    }
    const auto start = std::chrono::steady_clock::now();
    Pictures copies = pictures;
    const HostCopy in(queue, pictures.in), brush(queue, pictures.brush);
    HostWindow out(queue, pictures.out, window);
    if (!in.whole() || !brush.whole()) return kOfxStatGPURenderFailed;
    copies.in = in.image();
    copies.brush = brush.image();
    copies.out = out.image();
    OfxStatus status = kOfxStatFailed;
    try {
        status = draw_here(suites, effect, copies, window, scale, plan);
    } catch (...) {
        out.upload();
        throw;
    }
    if (!out.upload()) return kOfxStatGPURenderFailed;
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    note_gpu(effect, "GPU: " + queue.device() + ", drawn on the processor and copied in " +
                         words_of_time(took.count()) + ": " + problem);
    return status;
}

}  // namespace

OfxStatus render(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args) {
    const std::optional<double> time = in_args.get_double(kOfxPropTime);
    if (!time) return kOfxStatFailed;
    const ClipImage output(suites, effect, kOfxImageEffectOutputClipName, *time);
    if (!output.pixels()) return kOfxStatFailed;
    const Image& out = *output.pixels();
    const OfxRectI window = intersect(
        out.bounds, in_args.get_rect(kOfxImageEffectPropRenderWindow).value_or(out.bounds));
    if (is_empty(window)) return kOfxStatOK;

    const ClipImage source(suites, effect, kOfxImageEffectSimpleSourceClipName, *time);
    Pictures pictures{out, source.pixels(), source.absent(), is_paint(suites, effect)};
    std::optional<ClipImage> brush;
    if (pictures.paint) {
        brush.emplace(suites, effect, kBrushClipName, *time);
        pictures.brush = brush->pixels();
        pictures.brush_absent = brush->absent();
    }
    Plan plan = plan_of(suites, effect, in_args, *time, pictures);
    const Scale scale = scale_of(in_args);
    const GpuRender gpu(in_args, effect);
    if (!gpu.enabled) return draw_here(suites, effect, pictures, window, scale, plan);
    // Without its system, what the host hands over cannot even be read.
    if (!gpu.queue) return kOfxStatGPURenderFailed;
    return draw_there(suites, effect, pictures, window, scale, plan, *gpu.queue,
                      gpu_wanted(Params(suites, effect), *time));
}

}  // namespace palette4d::node
