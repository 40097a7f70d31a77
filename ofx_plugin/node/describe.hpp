// What the node tells the host about itself.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// The clip that the standard wants in the Paint context, of alpha alone.
inline constexpr const char* kBrushClipName = "Brush";

/// kOfxActionDescribe.
OfxStatus describe(const Suites& suites, OfxImageEffectHandle effect);
/// kOfxActionDescribeInContext: the same clips and parameters in every context.
OfxStatus describe_in_context(const Suites& suites, OfxImageEffectHandle effect,
                              const Properties& in_args);
/// kOfxImageEffectActionGetClipPreferences: a still picture comes out different from frame to
/// frame, and the source is wanted in the sidecar's encoding.
OfxStatus clip_preferences(const Suites& suites, OfxImageEffectHandle effect,
                           const Properties& out_args);

}  // namespace palette4d::node
