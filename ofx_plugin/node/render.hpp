// The actions that concern pictures.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// kOfxImageEffectActionIsIdentity: the source, where this frame has nothing to recolour.
OfxStatus is_identity(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args,
                      const Properties& out_args);
/// kOfxImageEffectActionRender. Fails only when the host does not give it an output image or a
/// time; the picture passes through, with a message, when there is no usable sidecar.
OfxStatus render(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args);

}  // namespace palette4d::node
