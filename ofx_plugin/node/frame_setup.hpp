// What a node does to one moment of its clip: parameters and time in, what is to be drawn out.
#pragma once

#include <optional>
#include <string>

#include "host.hpp"
#include "outputs.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// Whether a setup has a lattice.
enum class Interpolation { kNever, kWithoutConversion, kAlways };

struct FrameSetup {
    /// The picture passes through unchanged.
    bool passes = true;
    Drawing drawing;
    /// Why the picture passes through although a sidecar was asked for; empty when all is well.
    std::string problem;
    /// What else the user should know; empty when all is well.
    std::string note;
};

/// The setup of an instance at a time. Reads parameters in the way allowed while rendering.
/// Problems are in the result; throws std::bad_alloc only.
FrameSetup frame_setup_at(const Suites& suites, OfxImageEffectHandle effect, OfxTime time,
                          Interpolation interpolation = Interpolation::kNever,
                          std::optional<double> source_frame = std::nullopt);

}  // namespace palette4d::node
