// The member "clip": frames, rate, size, colour spaces, and the conversion between them.
#include <cstddef>
#include <cstdint>
#include <utility>

#include "model/sidecar_error.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

constexpr std::int64_t kMaxRate = 2'147'483'647;
/// Limits of a conversion; a curve over all half floats has 63 488 samples.
constexpr std::size_t kMaxSteps = 64;
constexpr std::size_t kMaxSamples = 100'000;
/// Limit for a conversion's numbers: above the range of half floats.
constexpr double kMaxConversion = 1e9;

Vec3 read_three(const Cursor& where) {
    if (where.list("3 numbers, for r, g and b") != 3) where.wrong("a list of 3 numbers");
    Vec3 result{};
    for (std::size_t i = 0; i < 3; ++i) {
        result[i] = where.element(i).number(kMaxConversion, "a number");
    }
    return result;
}

std::vector<double> read_samples(const Cursor& where) {
    const std::size_t count = where.list("numbers");
    if (count > kMaxSamples) {
        where.wrong("at most " + std::to_string(kMaxSamples) + " numbers");
    }
    std::vector<double> result(count);
    for (std::size_t i = 0; i < count; ++i) {
        result[i] = where.element(i).number(kMaxConversion, "a number");
    }
    return result;
}

ConversionStep read_step(const Cursor& step) {
    step.require_object();
    const Cursor kind = step.member("kind");
    const std::string name = kind.text();
    if (name == "matrix") {
        step.require_members({"kind", "matrix", "offset"});
        MatrixStep result{};
        const Cursor rows = step.member("matrix");
        if (rows.list("3 rows") != 3) rows.wrong("a list of 3 rows");
        for (std::size_t r = 0; r < 3; ++r) {
            const Vec3 row = read_three(rows.element(r));
            for (std::size_t c = 0; c < 3; ++c) result.matrix[3 * r + c] = row[c];
        }
        result.offset = read_three(step.member("offset"));
        return result;
    }
    if (name == "log") {
        step.require_members({"kind", "direction", "base", "log_slope", "log_offset",
                              "linear_slope", "linear_offset", "start", "below"});
        LogStep result{};
        result.base = step.member("base").number(kMaxConversion, "a number");
        result.log_slope = read_three(step.member("log_slope"));
        result.log_offset = read_three(step.member("log_offset"));
        result.linear_slope = read_three(step.member("linear_slope"));
        result.linear_offset = read_three(step.member("linear_offset"));
        result.start = read_three(step.member("start"));
        result.below = read_three(step.member("below"));
        result.inverse = step.member("direction").choice({"forward", "inverse"}) == 1;
        return result;
    }
    if (name == "gamma") {
        step.require_members({"kind", "direction", "gamma", "offset", "negative"});
        const Cursor negative = step.member("negative");
        const std::string how = negative.text();
        if (how != "line" && how != "mirror") negative.wrong("\"line\" or \"mirror\"");
        return GammaStep{read_three(step.member("gamma")), read_three(step.member("offset")),
                         how == "mirror",
                         step.member("direction").choice({"forward", "inverse"}) == 1};
    }
    if (name == "curve") {
        step.require_members({"kind", "direction", "curves"});
        CurveStep result{};
        const Cursor curves = step.member("curves");
        const std::size_t count = curves.list("1 curve or 3");
        if (count != 1 && count != 3) curves.wrong("a list of 1 curve or 3");
        for (std::size_t i = 0; i < count; ++i) {
            const Cursor curve = curves.element(i);
            curve.require_members({"x", "y"});
            result.curves.push_back(
                {read_samples(curve.member("x")), read_samples(curve.member("y"))});
        }
        result.inverse = step.member("direction").choice({"forward", "inverse"}) == 1;
        return result;
    }
    kind.wrong("\"matrix\", \"log\", \"gamma\" or \"curve\"");
}

}  // namespace

ColourConversion read_steps(const Cursor& steps, const std::string& file,
                            const std::string& pointer) {
    const std::size_t count = steps.list("steps");
    if (count > kMaxSteps) steps.wrong("at most " + std::to_string(kMaxSteps) + " steps");
    std::vector<ConversionStep> result;
    for (std::size_t i = 0; i < count; ++i) result.push_back(read_step(steps.element(i)));
    try {
        return ColourConversion(std::move(result));
    } catch (const ConversionProblem& problem) {
        throw SidecarError(file, pointer + '/' + std::to_string(problem.step()) + problem.member(),
                           problem.found(), problem.expected());
    }
}

std::shared_ptr<const ClipConversion> read_conversion(const Cursor& where,
                                                      const std::string& file) {
    where.require_members({"input_space", "config", "error", "steps"});
    auto result = std::make_shared<ClipConversion>();
    result->input_space = where.member("input_space").text();
    result->config = where.member("config").text();
    const Cursor error = where.member("error");
    result->error = error.number(1, "a number");
    if (result->error < 0) error.wrong("a number from 0");
    result->steps = read_steps(where.member("steps"), file, "/clip/conversion/steps");
    return result;
}

ClipInfo read_clip(const Cursor& clip) {
    clip.require_members({"name", "source", "frames", "rate", "size", "encoding"}, {"conversion"});
    ClipInfo info;
    info.name = clip.member("name").text();
    info.source = clip.member("source").text();
    info.encoding = clip.member("encoding").text();

    const Cursor frames = clip.member("frames");
    frames.require_members({"first", "last", "step", "skipped"});
    info.first = frames.member("first").integer(-kMaxFrame, kMaxFrame);
    info.last = frames.member("last").integer(info.first, kMaxFrame);
    info.step = frames.member("step").integer(1, kMaxFrame);
    if ((info.last - info.first) % info.step != 0) {
        frames.member("step").wrong("a divisor of last - first = " +
                                    std::to_string(info.last - info.first));
    }
    const Cursor skipped = frames.member("skipped");
    std::int64_t previous = info.first - info.step;
    for (std::size_t i = 0, n = skipped.list("frame numbers"); i < n; ++i) {
        const Cursor entry = skipped.element(i);
        const std::int64_t frame = entry.integer(info.first, info.last);
        if ((frame - info.first) % info.step != 0) entry.wrong("a frame of the clip");
        if (frame <= previous) entry.wrong("frames in increasing order, each once");
        previous = frame;
    }

    const Cursor rate = clip.member("rate");
    if (rate.list("2 integers, numerator and denominator") != 2) {
        rate.wrong("a list of 2 integers, numerator and denominator");
    }
    info.rate_num = rate.element(0).integer(1, kMaxRate);
    info.rate_den = rate.element(1).integer(1, kMaxRate);
    const Cursor size = clip.member("size");
    if (size.list("2 integers, width and height") != 2) {
        size.wrong("a list of 2 integers, width and height");
    }
    info.width = size.element(0).integer(1, kMaxSize);
    info.height = size.element(1).integer(1, kMaxSize);
    return info;
}

}  // namespace palette4d
