// The member "clip": frames, rate, size, colour spaces, and the conversion between them.
#include <cstddef>
#include <cstdint>
#include <utility>

#include "model/sidecar_error.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

ConversionStep read_step(const Cursor& step) {
    const auto three = [&](const char* name) { return step.member(name).three(); };
    const auto inverse = [&] { return step.member("direction").is("inverse"); };
    const Cursor kind = step.member("kind");
    if (kind.is("matrix")) {
        MatrixStep result{};
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3 row = step.member("matrix").element(r).three();
            for (std::size_t c = 0; c < 3; ++c) result.matrix[3 * r + c] = row[c];
        }
        result.offset = three("offset");
        return result;
    }
    if (kind.is("log")) {
        return LogStep{step.member("base").number(),
                       three("log_slope"),
                       three("log_offset"),
                       three("linear_slope"),
                       three("linear_offset"),
                       three("start"),
                       three("below"),
                       inverse()};
    }
    if (kind.is("gamma")) {
        return GammaStep{three("gamma"), three("offset"), step.member("negative").is("mirror"),
                         inverse()};
    }
    CurveStep result{};
    for (const Json& curve : step.member("curves").json()) {
        result.curves.push_back({curve["x"], curve["y"]});
    }
    result.inverse = inverse();
    return result;
}

}  // namespace

ColourConversion read_steps(const Cursor& steps) {
    std::vector<ConversionStep> result;
    for (std::size_t i = 0; i < steps.size(); ++i) result.push_back(read_step(steps.element(i)));
    try {
        return ColourConversion(std::move(result));
    } catch (const SidecarError& problem) {
        steps.fail_inside(problem);
    }
}

std::shared_ptr<const ClipConversion> read_conversion(const Cursor& where) {
    auto result = std::make_shared<ClipConversion>();
    result->input_space = where.member("input_space").text();
    result->config = where.member("config").text();
    result->error = where.member("error").number();
    result->steps = read_steps(where.member("steps"));
    return result;
}

ClipInfo read_clip(const Cursor& clip) {
    ClipInfo info;
    info.name = clip.member("name").text();
    info.source = clip.member("source").text();
    info.encoding = clip.member("encoding").text();

    const Cursor frames = clip.member("frames");
    const Cursor last = frames.member("last"), skipped = frames.member("skipped");
    info.first = frames.member("first").integer();
    info.last = last.integer();
    info.step = frames.member("step").integer();
    if (info.last < info.first) {
        last.wrong("a frame at or after the first, " + std::to_string(info.first));
    }
    if ((info.last - info.first) % info.step != 0) {
        frames.member("step").wrong("a divisor of last - first = " +
                                    std::to_string(info.last - info.first));
    }
    std::optional<double> previous;
    for (std::size_t i = 0; i < skipped.size(); ++i) {
        const Cursor entry = skipped.element(i);
        const auto frame = static_cast<std::int64_t>(entry.later(previous));
        if (frame < info.first || frame > info.last || (frame - info.first) % info.step != 0) {
            entry.wrong("a frame of the clip");
        }
    }
    const Cursor rate = clip.member("rate"), size = clip.member("size");
    info.rate_num = rate.element(0).integer();
    info.rate_den = rate.element(1).integer();
    info.width = size.element(0).integer();
    info.height = size.element(1).integer();
    return info;
}

}  // namespace palette4d
