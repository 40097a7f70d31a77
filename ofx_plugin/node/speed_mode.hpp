// How a node recolours: exactly, or from a lattice that plays in real time.
#pragma once

#include <string>

#include "frame_setup.hpp"
#include "host.hpp"
#include "lattice/lattice.hpp"
#include "param_define.hpp"
#include "params.hpp"

namespace palette4d::node {

/// The options of kParamMode, in order.
enum class Mode { kAuto, kExact, kLattice };
inline constexpr const char* kParamMode = "mode";

void define_mode_param(ParamDefiner& define);

Mode mode_at(const Params& params, OfxTime time);

/// Whether a render with these arguments interpolates. Auto does so for interactive or draft
/// renders of large pictures without a costly conversion. The picture's full size counts, not this
/// render's part. In Natron, Auto is exact: its cache would use interpolated frames for the final
/// render.
Interpolation interpolation_of(const Suites& suites, Mode mode, const Properties& render_arguments,
                               const OfxRectI& picture);

/// The status text for a lattice's largest error.
std::string words_of(const Lattice& lattice);

}  // namespace palette4d::node
