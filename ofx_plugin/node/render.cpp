#include "render.hpp"

#include <exception>
#include <new>
#include <optional>

#include "clip_image.hpp"
#include "describe.hpp"
#include "frame_setup.hpp"
#include "instance.hpp"
#include "pixels.hpp"
#include "speed_mode.hpp"
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

/// Draws the window. On an exception it copies the source and rethrows.
OfxStatus draw_window(const Suites& suites, OfxImageEffectHandle effect, const Image& in,
                      const Image& out, const OfxRectI& window, const FrameSetup& setup) {
    try {
        for_each_band(
            suites, window.y1, window.y2,
            [&](int y1, int y2) { draw(in, out, {window.x1, y1, window.x2, y2}, setup.drawing); },
            [&] { return suites.effect->abort && suites.effect->abort(effect) != 0; });
    } catch (...) {
        copy(in, out, window);
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
    if (!source.pixels() || !same_format(*source.pixels(), out)) {
        // Never show the host's uninitialised memory.
        clear(out, window);
        return source.absent() ? kOfxStatOK : kOfxStatFailed;
    }
    const Image& in = *source.pixels();

    std::optional<double> source_frame;
    if (const auto index = in_args.get_int(kResolvePropSrcFrame)) source_frame = *index;
    note_source_frame(effect, *time, source_frame);
    FrameSetup setup;
    try {
        const Mode mode = mode_at(Params(suites, effect), *time);
        setup =
            frame_setup_at(suites, effect, *time,
                           interpolation_of(suites, mode, in_args, out.definition), source_frame);
    } catch (...) {
        copy(in, out, window);
        throw;
    }
    report(suites, effect, setup.problem.empty() ? setup.note : setup.problem);
    // Alpha-only pictures pass through too.
    if (setup.passes || in.channels < 3) {
        copy(in, out, window);
        return kOfxStatOK;
    }
    const OfxRectI& whole = out.definition;
    setup.drawing.picture = {whole.x1, whole.y1, whole.x2, whole.y2};
    // A host that bakes a LUT wants colours only, so no mattes and no strip.
    if (in_args.get_string(kOfxImageEffectPropNoSpatialAwareness) == "true" &&
        setup.drawing.options.output == Output::kPalette) {
        setup.drawing.options.output = Output::kRecoloured;
        if (!setup.drawing.edit) {
            copy(in, out, window);
            return kOfxStatOK;
        }
    }
    std::optional<ClipImage> brush;
    if (is_paint(suites, effect)) {
        brush.emplace(suites, effect, kBrushClipName, *time);
        if (!brush->pixels()) {
            copy(in, out, window);
            return brush->absent() ? kOfxStatOK : kOfxStatFailed;
        }
        setup.drawing.mask = &*brush->pixels();
    }
    return draw_window(suites, effect, in, out, window, setup);
}

}  // namespace palette4d::node
