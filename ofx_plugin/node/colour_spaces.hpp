// Colour spaces by the names that sidecars and files have for them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "model/polytope.hpp"

namespace palette4d::node {

/// The names that the standard's configuration (ofx-native-v1.5_aces-v1.3_ocio-v2.3) has for an
/// encoding, best first, with the generic space that it belongs to last; empty for one that is not
/// in it. `core`: of its core spaces alone, as hosts want whose colour management knows no others.
std::vector<std::string> colourspaces_of(const std::string& encoding, bool core = false);

/// From scene-linear numbers of a display-referred encoding's primaries to the encoding; a
/// conversion that changes nothing for linear encodings, null for all others (logs, HDR, unknown).
std::shared_ptr<const ColourConversion> from_linear(const std::string& encoding);

/// The weights of red, green and blue in the luminance of light of an encoding's primaries; they
/// sum to 1, and are negative where a primary is no colour that can be seen. Those of Rec.709 for
/// an encoding that is not known.
Vec3 luminance_weights(const std::string& encoding);

}  // namespace palette4d::node
