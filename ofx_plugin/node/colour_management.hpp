// Colour management of OFX 1.5: the node asks for the encoding of its sidecar and returns the
// picture in it. A host without colour management is not asked for anything.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// In Describe: the node supports the standard's configuration.
void describe_colour(const Properties& node);
/// In GetClipPreferences: the colour space that the node prefers for its source.
void prefer_colour(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args);
/// kOfxImageEffectActionGetOutputColourspace: the source's colour space.
OfxStatus output_colour(const Properties& out_args);

}  // namespace palette4d::node
