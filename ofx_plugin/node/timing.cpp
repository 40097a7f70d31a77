#include "timing.hpp"

#include <cmath>
#include <locale>
#include <sstream>

namespace palette4d::node {
namespace {

/// A time this close to a frame is on it: rates are rounded.
constexpr double kRounding = 1e-6;
constexpr double kLargestTime = 1e9;
/// Hosts round a clip's length at their own rate, by up to one frame either way.
constexpr double kFrameMoreOrLess = 1 + kRounding;

double rate_of(const ClipInfo& clip) {
    return static_cast<double>(clip.rate_num) / static_cast<double>(clip.rate_den);
}

/// The host's time of the clip's first frame, and clip frames per host frame.
struct Start {
    double time;
    double ratio;
};

bool is_rate(const std::optional<double>& rate) { return rate && *rate > 0 && *rate < 1e6; }

Start start_of(const ClipInfo& clip, const TimeSettings& settings, const HostClip& host) {
    if (!settings.automatic) {
        const std::optional<double> rate = settings.host_rate > 0 ? settings.host_rate : host.rate;
        const bool by_rates = settings.by_rates && is_rate(rate);
        return {settings.start, by_rates ? rate_of(clip) / *rate : 1.0};
    }
    // Hosts without a clip report 0 to 0, as if the clip started at 0. Hosts with an endless clip
    // report huge numbers.
    if (!host.first || !host.last || !(*host.first <= *host.last) ||
        !(std::abs(*host.first) < kLargestTime) || !(std::abs(*host.last) < kLargestTime)) {
        return {0, 1};
    }
    const double first = static_cast<double>(clip.first), last = static_cast<double>(clip.last);
    const double step = static_cast<double>(clip.step);
    if (*host.first >= first && *host.last < last + step) return {first, 1};
    if (!is_rate(host.rate)) return {*host.first, 1};
    const double frames = last - first + step, ratio = rate_of(clip) / *host.rate;
    const double shown = *host.last - *host.first + 1, kept = frames / ratio;
    // A trimmed clip has neither length, so only its start is known.
    const bool by_rates = std::abs(shown - kept) <= kFrameMoreOrLess &&
                          std::abs(shown - kept) < std::abs(shown - frames);
    return {*host.first, by_rates ? ratio : 1.0};
}

}  // namespace

FrameAt frame_at(const ClipInfo& clip, const TimeSettings& settings, const HostClip& host,
                 double time) {
    const double first = static_cast<double>(clip.first), last = static_cast<double>(clip.last);
    FrameAt at;
    double since_first = 0;
    if (settings.automatic && host.source_frame && *host.source_frame >= 0) {
        const bool sequence = clip.source.find_first_of("#%") != std::string::npos;
        const double numbered_from = sequence ? host.first_number.value_or(first) : 0;
        since_first = numbered_from + *host.source_frame - first;
    } else {
        const Start start = start_of(clip, settings, host);
        since_first = (time - start.time) * start.ratio;
    }
    at.frame = first + since_first * settings.speed + (settings.in_point + settings.offset);
    if (settings.reverse) at.frame = first + last - at.frame;
    const double step = static_cast<double>(clip.step);
    if (at.frame < first - kRounding) at.place = FrameAt::Place::kBefore;
    if (at.frame >= last + step - kRounding) at.place = FrameAt::Place::kAfter;
    at.passes = (at.place == FrameAt::Place::kBefore && settings.pass_before) ||
                (at.place == FrameAt::Place::kAfter && settings.pass_after);
    return at;
}

std::string words_of(double time, const FrameAt& at) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(9);
    text << "time " << time << " is frame " << at.frame;
    if (at.place == FrameAt::Place::kBefore) text << ", before the clip: ";
    if (at.place == FrameAt::Place::kAfter) text << ", after the clip: ";
    if (at.place != FrameAt::Place::kInside) {
        text << (at.passes                             ? "not recoloured"
                 : at.place == FrameAt::Place::kBefore ? "its first palette holds"
                                                       : "its last palette holds");
    }
    return text.str();
}

}  // namespace palette4d::node
