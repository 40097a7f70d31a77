// How exactly a node recolours: colour by colour, or from a lattice that plays in real time.
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

/// How a render with these arguments is to interpolate: Auto does where the host tells that
/// somebody watches it being made, or that a draft will do, and where interpolating is faster: the
/// picture, of which this render may be a part, is large, and no conversion takes most of the time.
/// Natron's cache would give such frames to a final render, so that Auto is exact there.
Interpolation interpolation_of(const Suites& suites, Mode mode, const Properties& render_arguments,
                               const OfxRectI& picture);

/// What the status says of a lattice's largest error.
std::string words_of(const Lattice& lattice);

}  // namespace palette4d::node
