// The time parameters, and what the host reports about its clip.
#pragma once

#include "param_define.hpp"
#include "params.hpp"
#include "timing.hpp"

namespace palette4d::node {

inline constexpr const char* kParamTiming = "timing";
inline constexpr const char* kParamFirstFrame = "firstFrame";
inline constexpr const char* kParamConform = "conform";
inline constexpr const char* kParamHostRate = "hostRate";
inline constexpr const char* kParamInPoint = "inPoint";
inline constexpr const char* kParamSpeed = "speed";
inline constexpr const char* kParamReverse = "reverse";
inline constexpr const char* kParamBefore = "before";
inline constexpr const char* kParamAfter = "after";

void define_time_params(ParamDefiner& define);

/// None of these is animated; `time` is needed because rendering may only read with a time.
TimeSettings time_settings_at(const Params& params, OfxTime time);
/// What the host reports about the source clip. `source_frame` is the media frame from the action's
/// arguments. Allowed in every action of an instance.
HostClip host_clip(const Suites& suites, OfxImageEffectHandle effect,
                   std::optional<double> source_frame = std::nullopt);

}  // namespace palette4d::node
