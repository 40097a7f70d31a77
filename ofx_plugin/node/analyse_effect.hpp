// The second effect of the bundle, Palette4D Analyse: fetches the frames of its source from the
// host and analyses them. The grading node itself asks for no other frame than the one it renders.
#pragma once

#include "host.hpp"

namespace palette4d::node {

/// Every action of the effect but Load and Unload.
OfxStatus analyse_action(const Suites& suites, const char* action, OfxImageEffectHandle effect,
                         const Properties& in_args, const Properties& out_args);

}  // namespace palette4d::node
