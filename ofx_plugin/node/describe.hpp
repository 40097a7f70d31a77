// What the node tells the host about itself.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// kOfxActionDescribe.
OfxStatus describe(const Suites& suites, OfxImageEffectHandle effect);
/// kOfxActionDescribeInContext: the same clips and parameters in every context.
OfxStatus describe_in_context(const Suites& suites, OfxImageEffectHandle effect);
/// kOfxImageEffectActionGetClipPreferences: a still picture comes out different from frame to
/// frame, and the source is wanted in the sidecar's encoding.
OfxStatus clip_preferences(const Suites& suites, OfxImageEffectHandle effect,
                           const Properties& out_args);

}  // namespace palette4d::node
