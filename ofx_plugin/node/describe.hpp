// Describes the node to the host: properties, clips and parameters.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// The alpha clip that the standard requires in the Paint context.
inline constexpr const char* kBrushClipName = "Brush";

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
