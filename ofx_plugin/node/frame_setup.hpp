// What a node draws for one frame, from its parameters and the time.
#pragma once

#include <optional>
#include <string>

#include "draw_images.hpp"
#include "host.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

struct FrameSetup {
    /// The picture passes through unchanged.
    bool passes = true;
    NodeDrawing drawing;
    /// Why the picture passes through although a sidecar is chosen; empty without a problem.
    std::string problem;
    /// What else the user should know; empty for nothing.
    std::string note;
};

/// The setup of an instance at a time. Reads parameters as rendering allows. Reports problems in
/// the result; throws std::bad_alloc only.
FrameSetup frame_setup_at(const Suites& suites, OfxImageEffectHandle effect, OfxTime time,
                          std::optional<double> source_frame = std::nullopt);

}  // namespace palette4d::node
