// Which frame of the analysed clip a time of the host shows. Sees the core only, not OpenFX.
#pragma once

#include <optional>
#include <string>

#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// What the host reports about the clip, as far as it does.
struct HostClip {
    std::optional<double> first, last;     ///< times of the first and last frame that there are
    std::optional<double> rate;            ///< of the host's times, a second
    std::optional<double> source_frame{};  ///< of the media, from 0, whatever the time is
    std::optional<double> first_number{};  ///< of the media's frames, where it is a sequence
};

struct TimeSettings {
    bool automatic = true;
    double start = 0;       ///< the host's time of the clip's first frame; not where automatic
    bool by_rates = false;  ///< times pass at the host's rate, frames at the clip's; likewise
    double host_rate = 0;   ///< 0: the reported one; likewise
    double in_point = 0;    ///< frames of the clip before the first one that the host shows
    double offset = 0;      ///< frames added
    double speed = 1;       ///< frames of the clip a frame of the host
    bool reverse = false;   ///< from the clip's last frame to its first
    bool pass_before = false, pass_after = false;  ///< else the first and the last frame hold
};

struct FrameAt {
    double frame = 0;  ///< not clamped to the clip; not finite where the settings are not
    enum class Place { kBefore, kInside, kAfter } place = Place::kInside;
    bool passes = false;  ///< outside, where the settings let the picture through
};

/// Automatic: where all of the host's range lies within the clip's frame numbers, times are those
/// numbers; else the range's first time is the clip's first frame, and where the range is as long
/// as the clip lasts at the host's rate, rather than as the clip has frames, times go by rates.
/// Without a range, time 0 is the clip's first frame. Where the host tells the media's frame, that
/// counts and not the time: a movie's frames are numbered from 0, a sequence's as its files are. A
/// clip's last frame lasts until the next would come.
FrameAt frame_at(const ClipInfo& clip, const TimeSettings& settings, const HostClip& host,
                 double time);

/// "time 3 is frame 13", and what is shown where that is none of the clip's.
std::string words_of(double time, const FrameAt& at);

}  // namespace palette4d::node
