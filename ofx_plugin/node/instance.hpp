// One node in the host's project: the message it shows and its status.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "handle_params.hpp"
#include "host.hpp"

namespace palette4d::node {

/// What the plugin remembers about an instance. Everything else is in the host's parameters.
struct Instance {
    std::mutex mutex;
    std::string message;  ///< the last problem or note; empty for none
    ShownHandles shown;
    bool rendered = false;
    std::optional<double> source_less_time;  ///< media frame minus time, at the last render
    std::string gpu;  ///< what drew the last render of a host that renders on a GPU; else empty
    std::string gpu_time;     ///< what the kernel took for a frame when that was last measured
    unsigned gpu_frames = 0;  ///< drawn by the kernel
};

/// The actions of an instance's life. They never fail: an instance renders even without its record.
/// CreateInstance labels the handles and sets no values, since the standard allows values only in
/// kOfxActionInstanceChanged.
void create_instance(const Suites& suites, OfxImageEffectHandle effect);
void destroy_instance(OfxImageEffectHandle effect);
/// kOfxActionInstanceChanged: updates the parameters that the plugin sets after any change, because
/// the sidecar's file may have changed too. The host undoes all of it in one step.
void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args);

/// Stores the media frame of a render for the status, since changes come without it.
void note_source_frame(OfxImageEffectHandle effect, OfxTime time,
                       std::optional<double> source_frame);

/// Stores what drew a render on a GPU, for the status.
void note_gpu(OfxImageEffectHandle effect, const std::string& words);
/// Counts a frame of the kernel. Its time is measured at some: a driver must then be waited for.
bool measures_gpu(OfxImageEffectHandle effect);
/// Stores that the kernel drew on a device, and what that took where it was measured.
void note_gpu_frame(OfxImageEffectHandle effect, const std::string& device,
                    const std::string& time);

/// Shows a problem as the instance's persistent message, or clears the message when `problem` is
/// empty. Allowed while rendering. Each render shows the problem again, because hosts clear
/// messages themselves; a log gets it once.
void report(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem);

}  // namespace palette4d::node
