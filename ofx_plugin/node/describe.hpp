// Describes the node to the host: properties, clips and parameters.
#pragma once

#include <initializer_list>
#include <optional>

#include "host.hpp"

namespace palette4d::node {

/// The alpha clip that the standard requires in the Paint context.
inline constexpr const char* kBrushClipName = "Brush";

/// What the descriptions of the bundle's effects differ in.
struct About {
    const char *label, *short_label, *long_label, *description;
    std::initializer_list<const char*> contexts;
    int other_frames;  ///< 1: it asks for frames at other times
};
/// Sets the properties of an effect; its properties, for more, or none where the host has none.
std::optional<Properties> describe_effect(const Suites& suites, OfxImageEffectHandle effect,
                                          const About& about);
/// Defines a clip; false where the host refuses it.
bool define_clip(const Suites& suites, OfxImageEffectHandle effect, const char* name,
                 std::initializer_list<const char*> components, int other_frames = 0);

/// kOfxActionDescribe.
OfxStatus describe(const Suites& suites, OfxImageEffectHandle effect);
/// kOfxActionDescribeInContext: all contexts have the same clips and parameters.
OfxStatus describe_in_context(const Suites& suites, OfxImageEffectHandle effect,
                              const Properties& in_args);
/// kOfxImageEffectActionGetClipPreferences: a still differs from frame to frame, and the source
/// should be in the sidecar's encoding.
OfxStatus clip_preferences(const Suites& suites, OfxImageEffectHandle effect,
                           const Properties& out_args);

}  // namespace palette4d::node
