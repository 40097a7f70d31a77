// A small OpenFX host that forgives nothing. It hands a plugin the suites, watches every call, and
// notes each breach of the standard as a fault: names it does not know, wrong types, calls in the
// wrong action, images not given back, bytes written outside the render window. It can also behave
// badly itself: leave out suites, functions and properties, and refuse any single call.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "ofxColour.h"
#include "ofxCore.h"
#include "ofxImageEffect.h"
#include "ofxMemory.h"
#include "ofxMessage.h"
#include "ofxMultiThread.h"
#include "ofxParam.h"
#include "ofxProgress.h"
#include "ofxProperty.h"

namespace strict {

// ---------------------------------------------------------------- properties

enum Kind : unsigned {
    kHost = 1,
    kEffectDescriptor = 2,
    kClipDescriptor = 4,
    kParamDescriptor = 8,
    kParamSet = 16,
    kEffect = 32,
    kClip = 64,
    kParam = 128,
    kImage = 256,
    kInArgs = 512,
    kOutArgs = 1024,
};

using Colour = std::array<double, 3>;
using Value = std::variant<int, double, std::string, void*, Colour>;

}  // namespace strict

/// The standard's opaque types are ours to define.
struct OfxPropertySetStruct {
    strict::Kind kind;
    std::map<std::string, std::vector<strict::Value>> values;

    explicit OfxPropertySetStruct(strict::Kind k);
    ~OfxPropertySetStruct();
    OfxPropertySetStruct(const OfxPropertySetStruct& other);
    OfxPropertySetStruct& operator=(const OfxPropertySetStruct&) = delete;

    /// The host's own, unchecked way in.
    void put(const std::string& name, strict::Value value) { values[name] = {std::move(value)}; }
    void put_all(const std::string& name, std::vector<strict::Value> all) {
        values[name] = std::move(all);
    }
    bool has(const std::string& name) const { return values.count(name) != 0; }
    std::string text(const std::string& name, std::size_t index = 0) const;
    double number(const std::string& name, std::size_t index = 0) const;
};

struct OfxParamStruct {
    std::string type, name;
    OfxPropertySetStruct properties;
    strict::Value value{};
    /// Doubles or colours, linear between keys; empty: `value` at all times.
    std::map<double, strict::Value> keys{};
    /// The plugin has set an instance's, which had another value before.
    std::function<void(const std::string& name, const strict::Value& before)> on_set{};
    OfxParamSetStruct* set = nullptr;  ///< an instance's, that it is of
};

namespace strict {

/// What the plugin has set between paramEditBegin and paramEditEnd.
struct UndoStep {
    std::string label;
    std::map<std::string, Value> before;  ///< the values that it took the place of
    std::map<std::string, std::map<double, Value>> keys{};  ///< the keys that it removed
};

}  // namespace strict

struct OfxParamSetStruct {
    explicit OfxParamSetStruct(bool of_descriptor) : descriptor(of_descriptor) {}
    bool descriptor;
    OfxPropertySetStruct properties{strict::kParamSet};
    std::map<std::string, std::unique_ptr<OfxParamStruct>> params;
    std::vector<std::string> order;
    std::optional<strict::UndoStep> open_step{};
    std::vector<strict::UndoStep> steps{};  ///< the oldest first
    std::function<void()> on_edit_end{};    ///< what the host does while it holds its lock
};

struct OfxImageClipStruct {
    std::string name;
    OfxPropertySetStruct properties;
};

struct OfxImageEffectStruct {
    explicit OfxImageEffectStruct(bool is_descriptor)
        : descriptor(is_descriptor),
          properties(is_descriptor ? strict::kEffectDescriptor : strict::kEffect),
          params(is_descriptor) {}
    bool descriptor;
    OfxPropertySetStruct properties;
    OfxParamSetStruct params;
    std::map<std::string, std::unique_ptr<OfxImageClipStruct>> clips;
    std::mutex mutex;
    std::string persistent_message;     ///< empty: none shown
    std::vector<std::string> messages;  ///< of both kinds, in order
    std::atomic<int> abort_after{-1};   ///< polls until abort() says 1; -1: never
    std::atomic<int> abort_polls{0};
    bool in_progress = false;      ///< between progressStart and progressEnd
    std::vector<double> progress;  ///< that the plugin has told so far
};

namespace strict {

// ---------------------------------------------------------------- pictures

enum class Depth { kByte, kShort, kHalf, kFloat };
inline constexpr Depth kDepths[] = {Depth::kByte, Depth::kShort, Depth::kHalf, Depth::kFloat};

struct Layout {
    OfxRectI bounds{0, 0, 16, 16};
    int channels = 4;
    Depth depth = Depth::kFloat;
    std::ptrdiff_t padding = 0;  ///< bytes after each row
    bool upside_down = false;    ///< negative rowBytes
    std::string premultiplication = kOfxImageUnPreMultiplied;
    double scale = 1;                    ///< the render scale that it is at
    std::optional<OfxRectI> definition;  ///< the whole picture, where bounds are a part of it

    int width() const { return bounds.x2 - bounds.x1; }
    int height() const { return bounds.y2 - bounds.y1; }
    int number_bytes() const { return depth == Depth::kByte ? 1 : depth == Depth::kFloat ? 4 : 2; }
    int pixel_bytes() const { return channels * number_bytes(); }
};

/// Pixels between guard bytes, in any layout.
class Picture {
public:
    explicit Picture(const Layout& layout, std::uint8_t fill = 0xa5);
    const Layout& layout() const { return layout_; }
    std::ptrdiff_t row_bytes() const;
    unsigned char* at(int x, int y);
    const unsigned char* at(int x, int y) const;
    float* floats(int x, int y) { return reinterpret_cast<float*>(at(x, y)); }
    const float* floats(int x, int y) const { return reinterpret_cast<const float*>(at(x, y)); }
    /// From the first pixel of the first row to the end, guards included; only where rows count
    /// upwards.
    unsigned char* rest() { return at(layout_.bounds.x1, layout_.bounds.y1); }
    std::size_t rest_size() const {
        const auto* const first = at(layout_.bounds.x1, layout_.bounds.y1);
        return static_cast<std::size_t>(storage_.data() + storage_.size() - first);
    }
    /// Everything, guards and padding included.
    const std::vector<unsigned char>& storage() const { return storage_; }
    /// The pixels of an area, row after row without gaps.
    std::vector<unsigned char> pixels(const OfxRectI& area) const;
    /// Whether a byte of storage belongs to a pixel of the area.
    std::vector<bool> mask(const OfxRectI& area) const;

private:
    Layout layout_;
    std::size_t stride_;
    std::vector<unsigned char> storage_;
};

// ---------------------------------------------------------------- the host

struct Config {
    std::set<std::string> missing_suites;      ///< "OfxMessageSuite/2"
    std::set<std::string> null_functions;      ///< "propSetString", "setPersistentMessage", …
    std::set<std::string> missing_properties;  ///< answered with kOfxStatErrUnknown
    bool incomplete = false;  ///< descriptions cannot be whole, and are not checked
    long refused_call = -1;   ///< this call of a suite, counted from 0, fails
    unsigned processors = 4;
    int api_minor = 4;  ///< of the standard's version 1 that the host says it has
    bool tiles = true, multi_resolution = true;
    bool animates_strings = true;        ///< else a text that animates is a fault
    bool secret_stays = false;           ///< what was described as secret is never shown
    std::vector<double> frame_range{};   ///< of the source, as instances report it; empty: not
    double frame_rate = 0;               ///< likewise; 0: not
    OfxStatus edit_answer = kOfxStatOK;  ///< of paramEditBegin and its End
    bool gpus = false;                   ///< that it renders with OpenCL and CUDA
    int cancel_after = -1;               ///< updates of the progress until the user cancels
    /// What Natron's source does: paramEditEnd asks for clip preferences under a lock that every
    /// action takes, a message's arguments are lost, each render begins with no message shown, and
    /// the numbers of a colour parameter are linear light.
    bool natron = false;
    /// The folder that file and folder parameters get put before them where they do not start with
    /// a slash; empty: as they are.
    std::string project{};
};

/// The process' one host. Change its configuration only while no plugin runs.
class Host {
public:
    static Host& get();
    OfxHost* ofx() { return &ofx_; }
    /// New behaviour for plugins loaded from now on; the calls are counted from 0 again.
    void configure(Config config);
    const Config& config() const { return config_; }

    /// The names of all properties that a plugin has asked for or set since the last call.
    std::set<std::string> take_asked();
    void asked(const std::string& property);

    void fault(const std::string& what);
    std::vector<std::string> take_faults();
    long calls() const { return calls_.load(); }
    bool refused() const { return refused_.load(); }
    /// Whether a plugin can have several settings undone in one step, and say which cannot be.
    bool has_undo_steps() const;

    // For the suites.
    const void* suite(const std::string& name, int version);
    bool count_call(const char* function);  ///< false: refuse this one
    /// What the host does of its own accord is not counted and never refused.
    void count_calls(bool count) { uncounted_ += count ? -1 : 1; }

private:
    Host();
    OfxPropertySetStruct properties_{kHost};
    OfxHost ofx_{};
    Config config_;
    std::atomic<long> calls_{0};
    std::atomic<bool> refused_{false};
    std::atomic<int> uncounted_{0};
    std::mutex mutex_;
    std::vector<std::string> faults_;
    std::set<std::string> asked_;
    std::vector<std::unique_ptr<std::vector<unsigned char>>> handed_out_;
};

/// What the current thread is doing for the plugin.
struct Activity {
    std::string action;  ///< empty outside actions
    bool worker = false;
    bool locked = false;  ///< by the host: an action that it sends now waits for ever
    Picture* output = nullptr;
    const Picture* source = nullptr;
    const Picture* brush = nullptr;
    std::set<OfxPropertySetHandle>* images = nullptr;
    std::string context{};  ///< that is being described
    double time = 0;        ///< of the action
    /// Where the plugin may fetch images beside a render: the source's.
    const std::function<const Picture*(double time)>* frames = nullptr;
    /// Where pictures are in a device's memory; null: in the host's.
    const std::map<const Picture*, void*>* devices = nullptr;
};
Activity& activity();

/// Made at the head of every suite function: the strings given out before become rubbish, and a
/// worker thread that calls what it must not is noted.
class Call {
public:
    explicit Call(const char* function, bool allowed_in_worker = false);
    bool refused() const { return refused_; }
    const char* function() const { return function_; }

private:
    const char* function_;
    bool refused_;
};
/// Keeps a string for the plugin until this thread's next call.
char* lend(const std::string& text);

// The suites, and the names of their functions by offset (for Config::null_functions).
struct SuiteTable {
    const void* data;
    std::size_t size;
    std::map<std::string, std::size_t> functions;
};
SuiteTable property_suite();
SuiteTable parameter_suite();
SuiteTable effect_suite();
SuiteTable memory_suite();
SuiteTable thread_suite();
SuiteTable message_suite_v1();
SuiteTable message_suite_v2();
SuiteTable progress_suite();

// ---------------------------------------------------------------- plugins and instances

/// Notes what a host's author would find wrong with a description as a fault.
void check_descriptor(const OfxImageEffectStruct& effect);
/// The parameters after whose changes a host asks for the clip preferences again.
std::set<std::string> slave_params(const OfxImageEffectStruct& descriptor);

/// Not a property of the standard, so that nobody can ask for it: an instance's clip, whether both
/// it and its effect were described with temporal access.
inline constexpr const char* kTemporal = " temporal";

class Gpu;
class Instance;

/// The program's arguments in UTF-8; on Windows main() gets them in the code page.
std::vector<std::string> arguments(int argc, char** argv);
/// Sets a variable of the environment (UTF-8), or removes it.
void set_variable(const std::string& name, const std::optional<std::string>& value);

/// A bundle's binary for this system and one of its two plugins.
class Plugin {
public:
    explicit Plugin(const std::string& bundle, int which = 0);
    /// One that lives in this program: the host's own tests have such.
    explicit Plugin(OfxPlugin& resident);
    ~Plugin();
    Plugin(const Plugin&) = delete;
    Plugin& operator=(const Plugin&) = delete;

    const OfxPlugin& ofx() const { return *plugin_; }
    OfxStatus call(const char* action, const void* handle, OfxPropertySetHandle in_args,
                   OfxPropertySetHandle out_args);
    OfxStatus load();
    OfxStatus unload();
    /// Describe and DescribeInContext, with their results checked. Empty when the plugin failed.
    std::unique_ptr<OfxImageEffectStruct> describe(const std::string& context);
    /// Load, describe and create; throws std::runtime_error when one of them fails.
    std::unique_ptr<Instance> create(const std::string& context = kOfxImageEffectContextFilter);

private:
    void* library_ = nullptr;
    OfxPlugin* plugin_ = nullptr;
};

class Instance {
    using Properties = std::map<std::string, std::vector<Value>>;

public:
    Instance(Plugin& plugin, const OfxImageEffectStruct& descriptor, const std::string& context);
    ~Instance();

    OfxImageEffectStruct& effect() { return effect_; }
    OfxStatus create();
    OfxStatus destroy();
    void set(const std::string& param, Value value);  ///< no action is sent
    void animate(const std::string& param, std::map<double, Value> keys);
    OfxStatus changed(const std::string& param);
    double shown_time = 0;  ///< that changes tell
    /// Any instance change: `type` is kOfxTypeParameter or kOfxTypeClip, or empty for the time.
    OfxStatus changed(const std::string& type, const std::string& name, const std::string& reason);
    /// kOfxActionBeginInstanceChanged or its End.
    OfxStatus bracket(const char* action, const std::string& reason);
    /// What the plugin has set together, the oldest first.
    const std::vector<UndoStep>& undo_steps() const { return effect_.params.steps; }
    /// Puts values back, and then tells of each as of the user's edits; those that were there.
    std::map<std::string, Value> put_back(const std::map<std::string, Value>& values);
    /// The user undoes the last step of the plugin's; what put_back() does it again with.
    std::map<std::string, Value> undo();
    /// The host's button: every parameter goes to its default, a colour component after component,
    /// each reported as the user's edit, and then all of them once more.
    void restore_defaults() { restore_defaults(effect_.params.order); }
    void restore_defaults(const std::vector<std::string>& names);
    /// A colour parameter as the host's panel displays it, in the display's sRGB.
    Colour swatch(const std::string& param);
    /// The user picks a displayed colour for it, from the panel or from the picture.
    OfxStatus pick(const std::string& param, const Colour& displayed);
    /// How often the plugin has set a parameter.
    int settings(const std::string& param) { return settings_[param]; }
    OfxStatus sync();
    std::string text(const std::string& param);
    const Value& value(const std::string& param);
    /// A property that the plugin has set on an instance's parameter.
    const OfxPropertySetStruct& properties(const std::string& param);
    /// kOfxStatOK: the clip's name and time are filled in.
    OfxStatus is_identity(double time, std::string& clip, double& clip_time);
    OfxStatus clip_preferences(bool& frame_varying);
    /// All that GetClipPreferences says.
    OfxStatus clip_preferences(OfxPropertySetStruct& out);
    /// kOfxImageEffectActionGetRegionsOfInterest: the source's, in canonical coordinates, of
    /// `region`, which is left as it is where the plugin asks for no more.
    OfxStatus region_of_interest(double time, double scale, std::array<double, 4>& region);
    /// kOfxImageEffectActionGetOutputColourspace.
    OfxStatus output_colourspace(std::string& name);
    /// Renders `window`; null source: the host has no picture. Checks images and guards afterwards.
    OfxStatus render(double time, const Picture* source, Picture& output, const OfxRectI& window);
    /// Renders all of `output` where pictures are in the Gpu's memory, and stay there unchecked.
    OfxStatus render_there(double time, const Picture& source, Picture& output,
                           const std::map<const Picture*, void*>& memory);
    /// The same from a host's cache, which knows a frame by its time and by the parameters that are
    /// evaluated on change.
    std::vector<unsigned char> cached(double time, const Picture& source);
    /// What the next renders' arguments say besides the ordinary.
    std::map<std::string, Value> extra_arguments;
    /// Of the Paint context.
    const Picture* brush = nullptr;
    /// Renders get their pictures in its memory; null: in the host's.
    Gpu* gpu = nullptr;
    /// Every render is done twice, and a difference is a fault.
    bool twice = false;
    /// The source's pictures for a plugin that fetches them after a user's edit; empty: it may not.
    std::function<const Picture*(double time)> frames;

private:
    Plugin& plugin_;
    OfxImageEffectStruct effect_;
    bool created_ = false;
    std::map<std::string, int> settings_;
    bool telling_ = false;                   ///< the plugin is being told of its own setting
    std::set<std::string> slaves_;           ///< parameters that the preferences depend on
    std::set<std::string> set_since_;        ///< parameters that were set since preferred_
    std::optional<Properties> preferred_{};  ///< what the plugin last answered
    using FrameKey = std::pair<double, std::vector<std::pair<Value, std::map<double, Value>>>>;
    std::map<FrameKey, std::vector<unsigned char>> cache_;

    void tell(const std::string& param, const Value& before);
    /// Asks for the clip preferences as hosts do, after CreateInstance and changes of the
    /// parameters named for it. That they differ after any other change is a fault: no host would
    /// have heard of it.
    void check_preferences();
    /// What the plugin has fetched must be released.
    static void check_released(const std::set<OfxPropertySetHandle>& images, const char* action);
    OfxStatus render_once(double time, const Picture* source, Picture& output,
                          const OfxRectI& window);
    /// The render action itself, with pictures that are copied to the Gpu and back.
    OfxStatus render_copied(OfxPropertySetStruct& arguments, const Picture* source,
                            Picture& output);
};

}  // namespace strict
