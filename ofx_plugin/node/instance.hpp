// One node in the host's project: the message it shows and its status.
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "handle_params.hpp"
#include "host.hpp"

namespace palette4d::node {

/// What the plugin remembers about an instance. All else is in the host's parameters.
struct Instance {
    std::mutex mutex;
    std::string message;  ///< the last problem or note; empty for none
    ShownHandles shown;
    std::optional<double> source_less_time;  ///< the media's frame less the time, last rendered
};

/// The actions of an instance's life. They never fail: without its record an instance still
/// renders. CreateInstance labels the handles and sets no values: the standard allows that in
/// kOfxActionInstanceChanged alone.
void create_instance(const Suites& suites, OfxImageEffectHandle effect);
void destroy_instance(OfxImageEffectHandle effect);
/// kOfxActionInstanceChanged: brings the parameters that the plugin sets up to date, whatever
/// changed, because the sidecar's file may have changed too. The host undoes all of it in one step.
void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args);

/// What a render was told, for the status: changes are told without the media's frame.
void note_source_frame(OfxImageEffectHandle effect, OfxTime time,
                       std::optional<double> source_frame);

/// Shows a problem as the instance's persistent message, or clears the message when `problem` is
/// empty. Allowed while rendering. Hosts clear messages on their own, so that a problem is shown
/// again at each render; a log takes it once.
void report(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem);

}  // namespace palette4d::node
