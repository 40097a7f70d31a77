// Finds colour spaces by the names that sidecars and files use.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "model/vec3.hpp"

namespace palette4d {

/// The names of an encoding in the standard's configuration (ofx-native-v1.5_aces-v1.3_ocio-v2.3).
/// Best match first, its generic space last; empty for an unknown encoding. `core` limits them to
/// core spaces, for hosts whose colour management knows no others.
std::vector<std::string> colourspaces_of(const std::string& encoding, bool core = false);

/// The conversion from scene-linear values in the primaries of a display-referred encoding to that
/// encoding. For linear encodings it changes nothing; null for all others (logs, HDR, unknown).
std::shared_ptr<const ColourConversion> from_linear(const std::string& encoding);

/// The luminance weights of an encoding's red, green and blue; Rec.709's for an unknown encoding.
/// Rec.601's are its luma weights. They sum to 1. A weight is negative where the primary is not a
/// visible colour.
Vec3 luminance_weights(const std::string& encoding);

}  // namespace palette4d
