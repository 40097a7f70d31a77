#include "analyse_effect.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "buttons.hpp"
#include "clip_image.hpp"
#include "describe.hpp"
#include "exr.hpp"
#include "palette4d_command.hpp"
#include "param_define.hpp"
#include "params.hpp"
#include "paths.hpp"
#include "sidecar_choice.hpp"
#include "status.hpp"

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSource = kOfxImageEffectSimpleSourceClipName;

OfxStatus describe_analyse(const Suites& suites, OfxImageEffectHandle effect) {
    const About about{"Palette4D Analyse",
                      "P4D Analyse",
                      "Palette4D Analyse",
                      "Finds the time-varying palette of its input and writes it to a sidecar, for "
                      "the node Palette4D. The picture passes.",
                      {kOfxImageEffectContextFilter, kOfxImageEffectContextGeneral},
                      1};
    return describe_effect(suites, effect, about) ? kOfxStatOK : kOfxStatFailed;
}

OfxStatus describe_in_context(const Suites& suites, OfxImageEffectHandle effect) {
    for (const char* name : {kSource, kOfxImageEffectOutputClipName}) {
        if (!define_clip(suites, effect, name, {kOfxImageComponentRGBA, kOfxImageComponentRGB},
                         name == kSource)) {
            return kOfxStatFailed;
        }
    }
    OfxParamSetHandle params = nullptr;
    if (!suites.effect->getParamSet || suites.effect->getParamSet(effect, &params) != kOfxStatOK) {
        return kOfxStatFailed;
    }
    ParamDefiner define(suites, params);
    define
        .text({kParamSidecar, "Sidecar",
               "The file to write. The frames that were analysed stay in a folder beside it, for "
               "Studio."},
              kOfxParamStringIsFilePath)
        .set_int(kOfxParamPropStringFilePathExists, 0);
    define
        .button({kParamAnalyse, "Analyse",
                 "Fetches all frames of the input and finds their palette in the background. Push "
                 "again to cancel."})
        .set_int(kOfxParamPropLayoutHint, kOfxParamPropLayoutHintNoNewLine);
    define.button(
        {kParamOpenInStudio, "Open in Studio", "Opens the sidecar in the window of palette4d."});
    define_status(define, suites);
    return kOfxStatOK;
}

/// Tells the user how far it is, in hosts that have a way.
class Progress {
public:
    Progress(const Suites& suites, OfxImageEffectHandle effect)
        : suite_(suites.progress), effect_(effect) {
        started_ = suite_ && suite_->progressStart && suite_->progressUpdate &&
                   suite_->progressEnd &&
                   suite_->progressStart(effect, "Palette4D fetches frames") == kOfxStatOK;
    }
    ~Progress() {
        if (started_) suite_->progressEnd(effect_);
    }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Whether to go on.
    bool at(double share) const {
        return !started_ || suite_->progressUpdate(effect_, share) != kOfxStatReplyNo;
    }

private:
    const OfxProgressSuiteV1* suite_;
    OfxImageEffectHandle effect_;
    bool started_ = false;
};

/// The frames in a folder beside the sidecar. They are written into another one, which takes its
/// place when all are there.
class Frames {
public:
    explicit Frames(const fs::path& sidecar) {
        std::string name = sidecar.filename().u8string();
        for (const char* end : {".json", ".p4d"}) {
            const std::size_t length = std::strlen(end);
            if (name.size() > length && name.compare(name.size() - length, length, end) == 0) {
                name.resize(name.size() - length);
            }
        }
        name_ = name;
        folder_ = sidecar.parent_path() / native(name + ".frames");
        fresh_ = sidecar.parent_path() / native(name + ".frames.new");
    }
    ~Frames() {
        if (made_) clear(fresh_);
    }
    Frames(const Frames&) = delete;
    Frames& operator=(const Frames&) = delete;

    const fs::path& folder() const { return folder_; }
    bool found() const {
        std::error_code error;
        return fs::is_directory(reachable(folder_), error);
    }
    std::string pattern() const { return (folder_ / native(name_ + ".######.exr")).u8string(); }

    /// Makes the folder to write to; false where a folder has other files, or cannot be made.
    bool make() {
        std::error_code error;
        if (found() && !ours(folder_)) return false;
        if (fs::exists(reachable(fresh_), error) && !clear(fresh_)) return false;  // of a crash
        made_ = fs::create_directories(reachable(fresh_), error);
        return made_ && !error;
    }
    bool write(long number, const Image& image) {
        std::string digits = std::to_string(number);
        digits.insert(0, 6 - std::min<std::size_t>(6, digits.size()), '0');
        return write_exr(reachable(fresh_ / native(name_ + "." + digits + ".exr")), image);
    }
    /// Replaces the frames of an earlier time; false where they cannot be.
    bool finish() {
        std::error_code error;
        if (found() && !clear(folder_)) return false;
        fs::rename(reachable(fresh_), reachable(folder_), error);
        made_ = static_cast<bool>(error);
        return !error;
    }

private:
    /// The frames in a folder; empty where other files are in it too.
    std::optional<std::vector<fs::path>> ours(const fs::path& folder) const {
        std::error_code error;
        std::vector<fs::path> files;
        for (const auto& entry : fs::directory_iterator(reachable(folder), error)) {
            const std::string file = entry.path().filename().u8string();
            const std::string start = name_ + ".", end = ".exr";
            const bool frame =
                file.size() == start.size() + 6 + end.size() && file.rfind(start, 0) == 0 &&
                file.find_first_not_of("0123456789", start.size()) == start.size() + 6 &&
                file.compare(start.size() + 6, end.size(), end) == 0;
            if (!frame) return std::nullopt;
            files.push_back(entry.path());
        }
        if (error) return std::nullopt;
        return files;
    }
    /// Removes a folder of frames; false where other files are in it, or where it stays.
    bool clear(const fs::path& folder) const {
        std::error_code error;
        const auto files = ours(folder);
        if (!files) return false;
        for (const fs::path& file : *files) fs::remove(file, error);
        return fs::remove(reachable(folder), error);
    }

    std::string name_;
    fs::path folder_, fresh_;
    bool made_ = false;
};

/// Why a sidecar that is there is not replaced; or nothing.
std::string refused_sidecar(const std::string& target) {
    std::error_code error;
    if (!fs::exists(reachable(native(target)), error)) return "";
    try {
        if (!has_edits(read_sidecar(target))) return "";
    } catch (const SidecarError&) {
        return target + ": found a file that is no sidecar; enter another path";
    }
    return target + ": found edits, which are never replaced; enter another path, or move it away";
}

/// The times of the source's first and last frame.
std::optional<std::pair<long, long>> source_range(const Suites& suites,
                                                  OfxImageEffectHandle effect) {
    OfxImageClipHandle clip = nullptr;
    OfxPropertySetHandle handle = nullptr;
    if (!suites.effect->clipGetHandle ||
        suites.effect->clipGetHandle(effect, kSource, &clip, &handle) != kOfxStatOK) {
        return std::nullopt;
    }
    const Properties source(suites, handle);
    const auto first = source.get_double(kOfxImageEffectPropFrameRange, 0),
               last = source.get_double(kOfxImageEffectPropFrameRange, 1);
    constexpr double kMost = 1e6;
    if (!first || !last || !(*first <= *last) || !(std::abs(*first) < kMost) ||
        !(std::abs(*last) < kMost)) {
        return std::nullopt;
    }
    return std::pair(std::lround(*first), std::lround(*last));
}

/// Fetches the frames and starts the analysis; the line for the status.
std::string analyse(const Suites& suites, OfxImageEffectHandle effect, const std::string& target) {
    if (cancel_analysis(target)) return "cancelled the analysis";
    if (target.empty()) return "enter the path of the new sidecar, such as ~/shot.p4d.json";
    const fs::path sidecar = native(target);
    std::error_code error;
    if (!sidecar.is_absolute() || !fs::is_directory(reachable(sidecar.parent_path()), error)) {
        return target + ": found no such folder; enter the path of the new sidecar in full";
    }
    for (const auto check : {refused_target, refused_sidecar}) {
        const std::string refused = check(target);
        if (!refused.empty()) return refused;
    }
    const auto range = source_range(suites, effect);
    if (!range) return "the host does not report the frames of the input; connect a clip";
    const auto [first, last] = *range;
    Frames frames(sidecar);
    if (!frames.make()) {
        return frames.folder().u8string() +
               ": found other files there, or it cannot be made; expected a folder for the frames "
               "alone; enter another name for the sidecar";
    }
    {
        const Progress progress(suites, effect);
        for (long time = first; time <= last; ++time) {
            if (!progress.at(static_cast<double>(time - first) /
                             static_cast<double>(last - first + 1))) {
                return "cancelled";
            }
            const ClipImage image(suites, effect, kSource, static_cast<double>(time));
            if (!image.pixels() || image.pixels()->channels < 3) {
                return "the host has no picture at time " + std::to_string(time);
            }
            if (!frames.write(time - std::min(first, 0L), *image.pixels())) {
                return frames.folder().u8string() + ": frame " + std::to_string(time) +
                       " cannot be written; make room, or choose another folder";
            }
        }
    }
    if (!frames.finish()) {
        return frames.folder().u8string() +
               ": cannot be replaced; close the programs that use it, or enter another name for "
               "the sidecar";
    }
    return start_analysis(frames.pattern(), target);
}

bool exists(const std::string& file) {
    std::error_code error;
    return !file.empty() && fs::is_regular_file(reachable(native(file)), error);
}

/// What Studio opens: the sidecar, or the frames that were fetched for it; else empty.
std::string studio_target(const std::string& sidecar) {
    if (sidecar.empty() || exists(sidecar)) return sidecar;
    const Frames frames(native(sidecar));
    return frames.found() ? frames.pattern() : "";
}

std::string open_studio(const std::string& sidecar, const std::string& path) {
    if (sidecar.empty()) return "Open in Studio: enter the sidecar's path";
    if (path.empty()) return "Open in Studio: " + sidecar + " is not there yet; push Analyse first";
    const std::string problem = open_in_studio(path, std::nullopt);
    return problem.empty() ? "opening " + path +
                                 " in Studio; if no window appears, move to another frame: Status "
                                 "says why"
                           : "Open in Studio: " + problem;
}

void changed(const Suites& suites, OfxImageEffectHandle effect, const Properties& in_args) {
    const std::string name = in_args.get_string(kOfxPropName).value_or("");
    const std::string reason = in_args.get_string(kOfxPropChangeReason).value_or("");
    if (name == kParamStatus || reason == kOfxChangePluginEdited) return;
    const bool pushed = reason == kOfxChangeUserEdited;
    const Params params(suites, effect);
    const std::string target =
        expanded(meant(params.string_at(kParamSidecar, Params::kAnyTime).value_or("")));
    std::string text;
    if (pushed && name == kParamAnalyse) text = analyse(suites, effect, target);
    const std::string studio = studio_target(target);
    if (pushed && name == kParamOpenInStudio) text = open_studio(target, studio);
    for (const std::string& line : {studio_problem(studio), analysis_state(target).words}) {
        if (!line.empty()) text += (text.empty() ? "" : "\n") + line;
    }
    if (text.empty() && exists(target)) {
        text = target + " is there: choose it in the node Palette4D";
    }
    text = without_controls(text);
    if (params.string_now(kParamStatus) != text) params.note_string(kParamStatus, text);
}

}  // namespace

OfxStatus analyse_action(const Suites& suites, const char* action, OfxImageEffectHandle effect,
                         const Properties& in_args, const Properties& out_args) {
    const auto is = [action](const char* name) { return std::strcmp(action, name) == 0; };
    if (is(kOfxActionDescribe)) return describe_analyse(suites, effect);
    if (is(kOfxImageEffectActionDescribeInContext)) return describe_in_context(suites, effect);
    if (is(kOfxActionCreateInstance) || is(kOfxActionDestroyInstance)) return kOfxStatOK;
    if (is(kOfxActionInstanceChanged)) {
        changed(suites, effect, in_args);
        return kOfxStatOK;
    }
    const std::optional<double> time = in_args.get_double(kOfxPropTime);
    if (is(kOfxImageEffectActionIsIdentity) && time) {
        if (!out_args.set_string(kOfxPropName, kSource)) return kOfxStatReplyDefault;
        out_args.set_double(kOfxPropTime, *time);
        return kOfxStatOK;
    }
    if (is(kOfxImageEffectActionRender) && time) {
        const ClipImage output(suites, effect, kOfxImageEffectOutputClipName, *time);
        if (!output.pixels()) return kOfxStatFailed;
        const Image& out = *output.pixels();
        const OfxRectI window = intersect(
            out.bounds, in_args.get_rect(kOfxImageEffectPropRenderWindow).value_or(out.bounds));
        const ClipImage source(suites, effect, kSource, *time);
        if (source.pixels() && same_format(*source.pixels(), out)) {
            copy(*source.pixels(), out, window);
            return kOfxStatOK;
        }
        clear(out, window);
        return source.absent() ? kOfxStatOK : kOfxStatFailed;
    }
    return kOfxStatReplyDefault;
}

}  // namespace palette4d::node
