#include "host_time.hpp"

#include "paths.hpp"

namespace palette4d::node {
namespace {

// Four million frames are 48 hours at 24 frames a second; Resolve needs finite ranges.
constexpr double kMostFrames = 4e6;
constexpr Range<double> kFrames = {0, -kMostFrames, kMostFrames, -1000, 1000};

}  // namespace

void define_time_params(ParamDefiner& define) {
    define.begin_group("time", "Time");
    define.choice({kParamTiming, "Timing",
                   "Auto: the node reads the clip's start and rate from the host. Manual: you set "
                   "them with the three parameters below. Status says which frame is shown."},
                  {"Auto", "Manual"});
    define.number({kParamFirstFrame, "First frame at",
                   "Manual timing: the host's time of the clip's first frame."},
                  kFrames, 1, 2, false);
    define.choice({kParamConform, "Conform",
                   "Manual timing. Frame for frame: each frame of the host shows one frame of the "
                   "clip, for example 24 fps conformed to 23.976. By rates: the clip plays at its "
                   "own speed in seconds, for example 24 fps on a timeline of 60."},
                  {"Frame for frame", "By rates"});
    define.number({kParamHostRate, "Host's rate",
                   "Manual timing by rates: the timeline's frames per second. 0: the rate that the "
                   "host reports."},
                  {0, 0, 1000, 0, 120}, 1, 3, false);
    define.number(
        {kParamInPoint, "In-point", "How many frames the host trims from the start of the clip."},
        kFrames, 1, 2, false);
    define.number(
        {kParamFrameOffset, "Frame offset",
         "Frames to add to the result of all other time settings, as a final correction."},
        kFrames, 1, 2, false);
    define.number(
        {kParamSpeed, "Speed",
         "Frames of the clip for each frame of the host: 2 if the clip plays twice as fast."},
        {1, 0.001, 1000, 0.1, 10}, 0.1, 4, false);
    define.flag({kParamReverse, "Reverse",
                 "Switch this on if the host plays the clip backwards. In-point then counts from "
                 "the clip's last frame."},
                false);
    define.choice({kParamBefore, "Before the clip",
                   "Before the clip's first frame: Hold uses its first palette, Pass through shows "
                   "the source."},
                  {"Hold", "Pass through"});
    define.choice(
        {kParamAfter, "After the clip",
         "After the clip's last frame: Hold uses its last palette, Pass through shows the source."},
        {"Hold", "Pass through"});
    define.end_group();
}

TimeSettings time_settings_at(const Params& params, OfxTime time) {
    TimeSettings settings;
    const auto number = [&](const char* name, double initial) {
        return params.double_at(name, time).value_or(initial);
    };
    const auto chosen = [&](const char* name) { return params.int_at(name, time) == 1; };
    settings.automatic = !chosen(kParamTiming);
    settings.start = number(kParamFirstFrame, 0);
    settings.by_rates = chosen(kParamConform);
    settings.host_rate = number(kParamHostRate, 0);
    settings.in_point = number(kParamInPoint, 0);
    settings.offset = number(kParamFrameOffset, 0);
    // 0 comes from a host that ignored our default: a clip never stands still.
    settings.speed = number(kParamSpeed, 1);
    if (!(settings.speed > 0)) settings.speed = 1;
    settings.reverse = chosen(kParamReverse);
    settings.pass_before = chosen(kParamBefore);
    settings.pass_after = chosen(kParamAfter);
    return settings;
}

HostClip host_clip(const Suites& suites, OfxImageEffectHandle effect,
                   std::optional<double> source_frame) {
    HostClip host;
    host.source_frame = source_frame;
    OfxPropertySetHandle handle = nullptr;
    if (suites.effect->getPropertySet &&
        suites.effect->getPropertySet(effect, &handle) == kOfxStatOK) {
        const Properties instance(suites, handle);
        host.rate = instance.get_double(kOfxImageEffectPropFrameRate);
        if (const auto media = instance.get_string(kResolvePropSrcFilePath)) {
            host.first_number = first_number(*media);
        }
    }
    OfxImageClipHandle clip = nullptr;
    handle = nullptr;
    if (!suites.effect->clipGetHandle ||
        suites.effect->clipGetHandle(effect, kOfxImageEffectSimpleSourceClipName, &clip, &handle) !=
            kOfxStatOK) {
        return host;
    }
    const Properties source(suites, handle);
    host.first = source.get_double(kOfxImageEffectPropFrameRange, 0);
    host.last = source.get_double(kOfxImageEffectPropFrameRange, 1);
    if (!host.rate) host.rate = source.get_double(kOfxImageEffectPropFrameRate);
    return host;
}

}  // namespace palette4d::node
