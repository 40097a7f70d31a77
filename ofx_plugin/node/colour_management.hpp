// Colour management of OFX 1.5: the node wants pictures in the encoding its sidecar was analysed
// in, and gives them back in it. Hosts that negotiate no colour are not asked for anything.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// In Describe: the node understands the names of the standard's configuration.
void describe_colour(const Properties& node);
/// In GetClipPreferences: what the source should be in.
void prefer_colour(const Suites& suites, OfxImageEffectHandle effect, const Properties& out_args);
/// kOfxImageEffectActionGetOutputColourspace: that of the source.
OfxStatus output_colour(const Properties& out_args);

}  // namespace palette4d::node
