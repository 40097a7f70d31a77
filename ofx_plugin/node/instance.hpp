// One node in the host's project: the message it shows and its status line.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "handle_params.hpp"
#include "host.hpp"

namespace palette4d::node {

/// What the plugin remembers about an instance. All else is in the host's parameters.
struct Instance {
    std::mutex mutex;
    std::string message;          ///< the persistent message that the host shows; empty for none
    std::optional<OfxTime> time;  ///< that the host last said it shows
    ShownHandles shown;
    std::optional<bool> told;  ///< while a host tells of changes: of one at least
};

/// The actions of an instance's life. They never fail: without its record an instance still
/// renders, it only repeats its messages.
void create_instance(const Suites& suites, OfxImageEffectHandle effect);
void destroy_instance(OfxImageEffectHandle effect);
/// Brings the parameters that the plugin sets up to date: the status says what the instance's
/// sidecar is or what is wrong with it, and the handles show those of the sidecar. `param` is what
/// the user changed, if anything, and `time` what the host shows, if it says so. With `one_step`
/// the host undoes what is set in one step. The standard lets a plugin set parameters while an
/// instance is created, changed or synchronised, and at no other time: not while rendering, nor in
/// PurgeCaches; and hold them together in kOfxActionInstanceChanged alone.
void update_instance(const Suites& suites, OfxImageEffectHandle effect,
                     const std::string& param = "", std::optional<OfxTime> time = std::nullopt,
                     bool one_step = false);
/// kOfxActionInstanceChanged: whatever changed, the time and the clips included, the sidecar may
/// have changed on disk since the last look at it.
void instance_changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& args);

/// Its Begin and its End. When it begins, values have changed that are not told yet: they are left
/// alone. When it ends, there is something to do only where nothing was told in between.
void changes_begin(OfxImageEffectHandle effect, const Properties& args);
void changes_end(const Suites& suites, OfxImageEffectHandle effect, const Properties& args);

/// Shows a problem as the instance's persistent message, or takes the message away when `problem`
/// is empty. Allowed while rendering; tells the host only what is new.
void report(const Suites& suites, OfxImageEffectHandle effect, const std::string& problem);

}  // namespace palette4d::node
