// The render and identity actions.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// kOfxImageEffectActionIsIdentity: returns the source where this frame has nothing to recolour.
OfxStatus is_identity(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args,
                      const Properties& out_args);
/// kOfxImageEffectActionGetRegionsOfInterest: cleaning up picks looks at the pixels around.
OfxStatus regions_of_interest(const Suites& suites, OfxImageEffectHandle effect,
                              const Properties& in_args, const Properties& out_args);
/// kOfxImageEffectActionRender. Fails only when the host gives no output image or no time. Without
/// a usable sidecar the picture passes through, with a message.
OfxStatus render(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args);

}  // namespace palette4d::node
