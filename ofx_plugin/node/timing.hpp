// Maps a host time to a frame of the analysed clip. Depends on the core only, not on OpenFX.
#pragma once

#include <optional>
#include <string>

#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// What the host reports about the clip; empty where it reports nothing.
struct HostClip {
    std::optional<double> first, last;     ///< times of the first and last frame
    std::optional<double> rate;            ///< host frames per second
    std::optional<double> source_frame{};  ///< media frame from 0, independent of the time
    std::optional<double> first_number{};  ///< number of a sequence's first frame
};

struct TimeSettings {
    bool automatic = true;
    double start = 0;       ///< host time of the clip's first frame; manual timing only
    bool by_rates = false;  ///< by seconds, not frames; manual timing only
    double host_rate = 0;   ///< 0: the reported rate; manual timing only
    double in_point = 0;    ///< clip frames before the first one that the host shows
    double offset = 0;      ///< frames added
    double speed = 1;       ///< clip frames per host frame
    bool reverse = false;   ///< plays from the clip's last frame to its first
    bool pass_before = false, pass_after = false;  ///< else the first and last palette hold
};

struct FrameAt {
    double frame = 0;  ///< not clamped to the clip; not finite if a setting is not
    enum class Place { kBefore, kInside, kAfter } place = Place::kInside;
    bool passes = false;  ///< outside the clip, where the picture passes through
};

/// Automatic timing, in this order. A reported media frame decides: numbered from 0 for a movie, by
/// file for a sequence. If the host's range lies within the clip's frame numbers, times are those
/// numbers. Otherwise the range's first time is the clip's first frame. Times count in seconds if
/// the range's length matches the clip's duration at the host's rate, but not its frame count.
/// Without a range, time 0 is the clip's first frame. A clip's last frame lasts one frame.
FrameAt frame_at(const ClipInfo& clip, const TimeSettings& settings, const HostClip& host,
                 double time);

/// "time 3 is frame 13", and what is shown when that is outside the clip.
std::string words_of(double time, const FrameAt& at);

}  // namespace palette4d::node
