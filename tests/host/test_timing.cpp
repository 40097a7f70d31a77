// Which frame of the analysed clip a time of the host shows: the rule itself, and through the node.
#include <cmath>
#include <limits>

#include "../../ofx_plugin/node/timing.hpp"
#include "harness.hpp"

using namespace strict;
using namespace test;
using palette4d::ClipInfo;
using palette4d::node::frame_at;
using palette4d::node::FrameAt;
using palette4d::node::HostClip;
using palette4d::node::TimeSettings;
using palette4d::node::words_of;
using Place = palette4d::node::FrameAt::Place;

namespace {

ClipInfo clip(std::int64_t first, std::int64_t last, std::int64_t num = 24, std::int64_t den = 1,
              std::int64_t step = 1) {
    ClipInfo info;
    info.first = first;
    info.last = last;
    info.step = step;
    info.rate_num = num;
    info.rate_den = den;
    return info;
}

HostClip range(double first, double last) { return {first, last, std::nullopt}; }
HostClip range(double first, double last, double rate) { return {first, last, rate}; }

bool near(double found, double expected) {
    return std::abs(found - expected) <= 1e-9 * std::max(1.0, std::abs(expected));
}

TimeSettings manual() {
    TimeSettings settings;
    settings.automatic = false;
    return settings;
}

struct Timed : Shown {
    /// The host renders at a time: the picture is the core's at a frame.
    void expect(double time, double frame) {
        EXPECT(render(time) == edited(frame),
               "time " + std::to_string(time) + " is not frame " + std::to_string(frame));
    }
    void expect_source(double time) {
        CHECK(render(time) == unchanged());
        std::string name;
        double at = 0;
        CHECK(instance->is_identity(time, name, at) == kOfxStatOK);
    }
    OfxPropertySetStruct& source_clip() {
        return instance->effect().clips.at("Source")->properties;
    }
};

}  // namespace

TEST(without_a_word_of_the_host_time_0_is_the_first_frame) {
    const TimeSettings settings;
    const double infinity = std::numeric_limits<double>::infinity();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const HostClip& host : {HostClip{}, range(0, 0), range(7, 3), range(-infinity, infinity),
                                 range(nan, 20), range(0, 2147483647.0), range(-1e12, 1e12)}) {
        CHECK(frame_at(clip(1001, 1100), settings, host, 0).frame == 1001);
        CHECK(frame_at(clip(1001, 1100), settings, host, 12.25).frame == 1013.25);
    }
}

TEST(times_that_are_the_clips_frame_numbers) {
    const TimeSettings settings;
    // The whole clip, and parts of it: a trim is in the numbers already.
    for (const HostClip& host :
         {range(1001, 1100), range(1010, 1050), range(1001, 1002, 60), range(1099, 1100.5)}) {
        CHECK(frame_at(clip(1001, 1100), settings, host, 1040).frame == 1040);
    }
    // A trim to one frame, and a still.
    CHECK(frame_at(clip(1001, 1100), settings, range(1040, 1040), 1040).frame == 1040);
    CHECK(frame_at(clip(1001, 1001), settings, range(1001, 1001), 1001).place == Place::kInside);
    // With every second frame analysed, the last one stands for two.
    CHECK(frame_at(clip(1001, 1099, 24, 1, 2), settings, range(1001, 1100), 1100).frame == 1100);
}

TEST(times_of_a_timeline_begin_with_the_clip) {
    const TimeSettings settings;
    CHECK(frame_at(clip(1001, 1100), settings, range(86400, 86499), 86400).frame == 1001);
    CHECK(frame_at(clip(1001, 1100), settings, range(86400, 86499), 86410.5).frame == 1011.5);
    // Not all of it within the clip's numbers: a timeline's, too.
    CHECK(frame_at(clip(1001, 1100), settings, range(1001, 1300), 1001).frame == 1001);
    CHECK(frame_at(clip(0, 99), settings, range(-10, 89), -10).frame == 0);
    CHECK(frame_at(clip(0, 99), settings, range(1, 100), 1).frame == 0);
}

TEST(rates_tell_whether_frames_or_seconds_are_kept) {
    const TimeSettings settings;
    // 1000 frames of 24 a second on a timeline of 23.976: conformed frame for frame, as most do …
    const double ntsc = 24000.0 / 1001;
    const ClipInfo film = clip(1, 1000);
    CHECK(frame_at(film, settings, range(5000, 5999, ntsc), 5500).frame == 501);
    // … or played in the same time, with 999 frames.
    const FrameAt kept = frame_at(film, settings, range(5000, 5998, ntsc), 5500);
    CHECK(near(kept.frame, 1 + 500 * 24 / ntsc));
    // 59.94 on 60, one hour.
    const ClipInfo field = clip(0, 215783, 60000, 1001);
    CHECK(frame_at(field, settings, range(1000000, 1215783, 60), 1000600).frame == 600);
    CHECK(near(frame_at(field, settings, range(1000000, 1215999, 60), 1000600).frame,
               600 * (60000.0 / 1001) / 60));
    // 24 on 30: a quarter more frames in the same time.
    CHECK(near(frame_at(clip(0, 99), settings, range(500, 624, 30), 510).frame, 8));
    // 60 of the 100 frames of a clip of 60 a second, at 24: more than the 40 that keep its time.
    CHECK(frame_at(clip(0, 99, 60), settings, range(500, 559, 24), 510).frame == 10);
    CHECK(near(frame_at(clip(0, 99, 60), settings, range(500, 539, 24), 510).frame, 25));
    CHECK(near(frame_at(clip(0, 99, 60), settings, range(500, 540, 24), 510).frame, 25));
    // A trim: nothing is known but its beginning.
    CHECK(frame_at(clip(0, 99, 60), settings, range(500, 519, 24), 510).frame == 10);
    CHECK(frame_at(clip(0, 99, 24), settings, range(500, 519, 60), 510).frame == 10);
    // A nonsense rate says nothing.
    for (const double rate : {0.0, -24.0, std::numeric_limits<double>::quiet_NaN()}) {
        CHECK(frame_at(clip(0, 99), settings, range(500, 624, rate), 510).frame == 10);
    }
}

TEST(manual_timing) {
    TimeSettings settings = manual();
    const ClipInfo film = clip(1001, 1100);
    // What the host reports is set aside.
    CHECK(frame_at(film, settings, range(86400, 86499), 5).frame == 1006);
    settings.start = 86400;
    CHECK(frame_at(film, settings, range(0, 10), 86405.5).frame == 1006.5);
    settings.in_point = 20;
    CHECK(frame_at(film, settings, {}, 86400).frame == 1021);
    settings.offset = -2.5;
    CHECK(frame_at(film, settings, {}, 86400).frame == 1018.5);
    settings.speed = 2;
    CHECK(frame_at(film, settings, {}, 86410).frame == 1038.5);
    settings.in_point = settings.offset = 0;
    settings.speed = 0.5;
    CHECK(frame_at(film, settings, {}, 86403).frame == 1002.5);
}

TEST(manual_rates) {
    TimeSettings settings = manual();
    settings.by_rates = true;
    settings.host_rate = 24000.0 / 1001;
    // After 1000 s at 23.976 the clip of 24 has come 24000 frames far.
    CHECK(near(frame_at(clip(0, 99999), settings, {}, 1000 * settings.host_rate).frame, 24000));
    settings.host_rate = 60;
    CHECK(near(frame_at(clip(0, 99999, 60000, 1001), settings, {}, 60000).frame,
               60000 * (60000.0 / 1001) / 60));
    settings.host_rate = 0;
    CHECK(near(frame_at(clip(0, 999), settings, {{}, {}, 48.0}, 100).frame, 50));
    CHECK(frame_at(clip(0, 999), settings, {}, 100).frame == 100);
    settings.by_rates = false;
    settings.host_rate = 48;
    CHECK(frame_at(clip(0, 999), settings, {}, 100).frame == 100);
}

TEST(backwards) {
    TimeSettings settings = manual();
    settings.reverse = true;
    const ClipInfo film = clip(1001, 1100);
    CHECK(frame_at(film, settings, {}, 0).frame == 1100);
    CHECK(frame_at(film, settings, {}, 99).frame == 1001);
    CHECK(frame_at(film, settings, {}, 0.25).frame == 1099.75);
    settings.in_point = 10;
    CHECK(frame_at(film, settings, {}, 0).frame == 1090);
    settings.speed = 3;
    CHECK(frame_at(film, settings, {}, 2).frame == 1084);
    CHECK(frame_at(film, settings, {}, 40).place == Place::kBefore);
    // Of a clip on a timeline.
    settings = {};
    settings.reverse = true;
    CHECK(frame_at(film, settings, range(500, 599), 500).frame == 1100);
}

TEST(before_and_after_the_clip) {
    TimeSettings settings;
    const ClipInfo film = clip(10, 20);
    const auto place = [&](double time) { return frame_at(film, settings, {}, time).place; };
    CHECK(place(-1e-3) == Place::kBefore);
    CHECK(place(-1e-9) == Place::kInside);  // a rate's rounding
    CHECK(place(0) == Place::kInside);
    CHECK(place(10) == Place::kInside);
    CHECK(place(10.75) == Place::kInside);  // the last frame lasts
    CHECK(place(11) == Place::kAfter);
    CHECK(place(11 - 1e-9) == Place::kAfter);
    CHECK(!frame_at(film, settings, {}, -5).passes && !frame_at(film, settings, {}, 50).passes);
    settings.pass_before = true;
    CHECK(frame_at(film, settings, {}, -5).passes && !frame_at(film, settings, {}, 50).passes);
    settings.pass_after = true;
    CHECK(frame_at(film, settings, {}, 50).passes && !frame_at(film, settings, {}, 5).passes);
    CHECK(words_of(5.5, frame_at(film, settings, {}, 5.5)) == "time 5.5 is frame 15.5");
    CHECK(words_of(50, frame_at(film, settings, {}, 50)) ==
          "time 50 is frame 60, after the clip: not recoloured");
    settings.pass_before = false;
    CHECK(words_of(-1, frame_at(film, settings, {}, -1)) ==
          "time -1 is frame 9, before the clip: its first palette holds");
}

TEST(the_nodes_parameters_of_time) {
    Timed timed;
    Instance& node = *timed.instance;
    timed.expect(2.5, 12.5);
    node.set("timing", 1);
    node.set("firstFrame", 100.0);
    timed.expect(104, 14);
    node.set("inPoint", 2.0);
    node.set("frameOffset", 0.5);
    timed.expect(104, 16.5);
    node.set("speed", 0.25);
    timed.expect(104, 13.5);
    node.set("reverse", 1);
    timed.expect(104, 16.5);
    node.set("reverse", 0);
    node.set("inPoint", 0.0);
    node.set("frameOffset", 0.0);
    node.set("speed", 1.0);
    node.set("conform", 1);
    node.set("hostRate", 48.0);
    timed.expect(104, 12);
    node.set("before", 1);
    node.set("after", 1);
    timed.expect_source(99);
    timed.expect_source(122);
    timed.expect(121, 20);
    node.set("before", 0);
    timed.expect(99, 9);
    node.set("before", 1);
    // Auto pays no heed to what is only Manual's.
    node.set("timing", 0);
    timed.expect(4, 14);
    timed.expect_source(-1);
}

TEST(the_host_reports_its_clip) {
    Timed timed;
    timed.source_clip().put_all(kOfxImageEffectPropFrameRange, {300.0, 310.0});
    timed.expect(304, 14);
    timed.source_clip().put_all(kOfxImageEffectPropFrameRange, {10.0, 20.0});
    timed.expect(14, 14);
    // 11 frames at 24, on a timeline of 48 a second, take 22.
    timed.source_clip().put_all(kOfxImageEffectPropFrameRange, {300.0, 321.0});
    timed.source_clip().put(kOfxImageEffectPropFrameRate, 48.0);
    timed.expect(304, 12);
    // The project's own rate comes first.
    timed.instance->effect().properties.put(kOfxImageEffectPropFrameRate, 24.0);
    timed.expect(304, 14);
}

TEST(the_status_says_which_frame_is_shown) {
    Timed timed;
    Instance& node = *timed.instance;
    const auto says = [&](const std::string& end) {
        const std::string text = node.text("status");
        EXPECT(text.size() >= end.size() && text.substr(text.size() - end.size()) == end, text);
    };
    node.shown_time = 4.5;
    CHECK(node.changed("", "", kOfxChangeTime) == kOfxStatOK);
    says("\ntime 4.5 is frame 14.5");
    node.set("inPoint", 3.0);
    CHECK(node.changed("inPoint") == kOfxStatOK);
    says("\ntime 4.5 is frame 17.5");
    node.shown_time = 30;
    CHECK(node.changed("", "", kOfxChangeTime) == kOfxStatOK);
    says("\ntime 30 is frame 43, after the clip: its last palette holds");
    node.set("after", 1);
    CHECK(node.changed("after") == kOfxStatOK);
    says("after the clip: not recoloured");
}

TEST(times_that_are_no_numbers_pass_with_a_message) {
    const double infinity = std::numeric_limits<double>::infinity();
    for (const char* name : {"inPoint", "frameOffset", "speed"}) {
        Timed timed;
        timed.set(name, infinity);
        CHECK(timed.render(3) == timed.unchanged());
        CHECK(!timed.message().empty());
    }
}
