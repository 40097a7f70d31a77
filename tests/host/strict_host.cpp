// The host itself: configuration, faults, pictures, and the actions it sends.
#include "strict_host.hpp"

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace strict {
namespace {

constexpr std::size_t kGuard = 256;

std::vector<std::unique_ptr<std::string>>& lent() {
    thread_local std::vector<std::unique_ptr<std::string>> strings;
    return strings;
}

const void* fetch_suite(OfxPropertySetHandle, const char* name, int version) {
    return name ? Host::get().suite(name, version) : nullptr;
}

}  // namespace

// ---------------------------------------------------------------- host

Host& Host::get() {
    static Host host;
    return host;
}

Host::Host() {
    properties_.put(kOfxPropType, std::string(kOfxTypeImageEffectHost));
    properties_.put(kOfxPropName, std::string("org.palette4d.StrictHost"));
    properties_.put(kOfxPropLabel, std::string("Strict host"));
    properties_.put_all(kOfxPropAPIVersion, {1, 4});
    ofx_ = {&properties_, &fetch_suite};
}

void Host::configure(Config config) {
    config_ = std::move(config);
    calls_ = 0;
    refused_ = false;
    properties_.put_all(kOfxPropAPIVersion, {1, config_.api_minor});
    properties_.put(kOfxImageEffectPropSupportsTiles, int{config_.tiles});
    properties_.put(kOfxImageEffectPropSupportsMultiResolution, int{config_.multi_resolution});
}

void Host::fault(const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string& action = activity().action;
    faults_.push_back((action.empty() ? "" : action + ": ") + what);
}

std::vector<std::string> Host::take_faults() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(faults_, {});
}

void Host::asked(const std::string& property) {
    const std::lock_guard<std::mutex> lock(mutex_);
    asked_.insert(property);
}

std::set<std::string> Host::take_asked() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(asked_, {});
}

const void* Host::suite(const std::string& name, int version) {
    const std::string key = name + "/" + std::to_string(version);
    SuiteTable table{};
    if (key == std::string(kOfxPropertySuite) + "/1") table = property_suite();
    if (key == std::string(kOfxParameterSuite) + "/1") table = parameter_suite();
    if (key == std::string(kOfxImageEffectSuite) + "/1") table = effect_suite();
    if (key == std::string(kOfxMemorySuite) + "/1") table = memory_suite();
    if (key == std::string(kOfxMultiThreadSuite) + "/1") table = thread_suite();
    if (key == std::string(kOfxMessageSuite) + "/1") table = message_suite_v1();
    if (key == std::string(kOfxMessageSuite) + "/2") table = message_suite_v2();
    if (!table.data) {
        fault("fetchSuite: this host knows no suite " + key);
        return nullptr;
    }
    if (config_.missing_suites.count(key)) return nullptr;
    // A copy with holes where functions are to be missing; kept for as long as the process lives.
    const auto* bytes = static_cast<const unsigned char*>(table.data);
    auto copy = std::make_unique<std::vector<unsigned char>>(bytes, bytes + table.size);
    for (const auto& [function, offset] : table.functions) {
        if (config_.null_functions.count(function)) {
            std::memset(copy->data() + offset, 0, sizeof(void (*)()));
        }
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    handed_out_.push_back(std::move(copy));
    return handed_out_.back()->data();
}

bool Host::count_call(const char*) {
    if (uncounted_ > 0) return true;
    if (calls_.fetch_add(1) != config_.refused_call) return true;
    refused_ = true;
    return false;
}

Activity& activity() {
    thread_local Activity now;
    return now;
}

Call::Call(const char* function, bool allowed_in_worker) : function_(function) {
    for (std::unique_ptr<std::string>& text : lent()) std::fill(text->begin(), text->end(), '#');
    if (lent().size() > 8) lent().erase(lent().begin());
    if (activity().worker && !allowed_in_worker) {
        Host::get().fault(std::string(function) + ": called in a spawned thread");
    }
    refused_ = !Host::get().count_call(function);
}

char* lend(const std::string& text) {
    lent().push_back(std::make_unique<std::string>(text));
    return lent().back()->data();
}

// ---------------------------------------------------------------- pictures

Picture::Picture(const Layout& layout, std::uint8_t fill)
    : layout_(layout),
      stride_(static_cast<std::size_t>(layout.width() * layout.pixel_bytes()) +
              static_cast<std::size_t>(layout.padding)),
      storage_(2 * kGuard + stride_ * static_cast<std::size_t>(layout.height()), fill) {}

std::ptrdiff_t Picture::row_bytes() const {
    const auto stride = static_cast<std::ptrdiff_t>(stride_);
    return layout_.upside_down ? -stride : stride;
}

const unsigned char* Picture::at(int x, int y) const {
    const std::ptrdiff_t row =
        layout_.upside_down ? layout_.bounds.y2 - 1 - y : y - layout_.bounds.y1;
    return storage_.data() + kGuard + row * static_cast<std::ptrdiff_t>(stride_) +
           static_cast<std::ptrdiff_t>(x - layout_.bounds.x1) * layout_.pixel_bytes();
}

unsigned char* Picture::at(int x, int y) {
    return const_cast<unsigned char*>(static_cast<const Picture*>(this)->at(x, y));
}

std::vector<unsigned char> Picture::pixels(const OfxRectI& area) const {
    std::vector<unsigned char> all;
    for (int y = area.y1; y < area.y2; ++y) {
        all.insert(all.end(), at(area.x1, y),
                   at(area.x1, y) + (area.x2 - area.x1) * layout_.pixel_bytes());
    }
    return all;
}

std::vector<bool> Picture::mask(const OfxRectI& area) const {
    std::vector<bool> inside(storage_.size(), false);
    for (int y = area.y1; y < area.y2; ++y) {
        const auto begin = at(area.x1, y) - storage_.data();
        std::fill_n(inside.begin() + begin, (area.x2 - area.x1) * layout_.pixel_bytes(), true);
    }
    return inside;
}

// ---------------------------------------------------------------- plugin

namespace {

std::string binary_of(const std::string& bundle) {
    namespace fs = std::filesystem;
    for (const auto& entry : fs::recursive_directory_iterator(fs::u8path(bundle))) {
        if (entry.path().extension() == ".ofx") return entry.path().u8string();
    }
    throw std::runtime_error(bundle + ": no .ofx file inside");
}

}  // namespace

Plugin::Plugin(const std::string& bundle) {
    const std::string binary = binary_of(bundle);
#if defined(_WIN32)
    library_ = LoadLibraryA(binary.c_str());
    if (!library_) throw std::runtime_error(binary + ": cannot be loaded");
    const auto symbol = [this](const char* name) {
        return reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(library_), name));
    };
#else
    library_ = dlopen(binary.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library_) throw std::runtime_error(dlerror());
    const auto symbol = [this](const char* name) { return dlsym(library_, name); };
#endif
    const auto count = reinterpret_cast<int (*)()>(symbol("OfxGetNumberOfPlugins"));
    const auto plugin = reinterpret_cast<OfxPlugin* (*)(int)>(symbol("OfxGetPlugin"));
    const auto set_host = reinterpret_cast<OfxStatus (*)(const OfxHost*)>(symbol("OfxSetHost"));
    if (!count || !plugin || !set_host) throw std::runtime_error(binary + ": no entry points");
    if (set_host(Host::get().ofx()) != kOfxStatOK) Host::get().fault("OfxSetHost refused");
    if (count() != 1 || plugin(1) || plugin(-1)) Host::get().fault("not exactly one plugin");
    plugin_ = plugin(0);
    plugin_->setHost(Host::get().ofx());
}

Plugin::Plugin(OfxPlugin& resident) : plugin_(&resident) { plugin_->setHost(Host::get().ofx()); }

Plugin::~Plugin() {
    if (!library_) return;
#if defined(_WIN32)
    FreeLibrary(static_cast<HMODULE>(library_));
#else
    dlclose(library_);
#endif
}

OfxStatus Plugin::call(const char* action, const void* handle, OfxPropertySetHandle in_args,
                       OfxPropertySetHandle out_args) {
    const std::string before = std::exchange(activity().action, action);
    const OfxStatus status = plugin_->mainEntry(action, handle, in_args, out_args);
    activity().action = before;
    return status;
}

OfxStatus Plugin::load() { return call(kOfxActionLoad, nullptr, nullptr, nullptr); }
OfxStatus Plugin::unload() { return call(kOfxActionUnload, nullptr, nullptr, nullptr); }

std::unique_ptr<OfxImageEffectStruct> Plugin::describe(const std::string& context) {
    auto effect = std::make_unique<OfxImageEffectStruct>(true);
    effect->properties.put(kOfxPropType, std::string(kOfxTypeImageEffect));
    if (call(kOfxActionDescribe, effect.get(), nullptr, nullptr) != kOfxStatOK) return nullptr;
    OfxPropertySetStruct in(kInArgs);
    in.put(kOfxImageEffectPropContext, context);
    if (call(kOfxImageEffectActionDescribeInContext, effect.get(), &in, nullptr) != kOfxStatOK) {
        return nullptr;
    }
    const Config& config = Host::get().config();
    if (!Host::get().refused() && !config.incomplete) {
        check_descriptor(*effect);
    }
    return effect;
}

std::unique_ptr<Instance> Plugin::create(const std::string& context) {
    if (load() != kOfxStatOK) throw std::runtime_error("Load failed");
    const auto descriptor = describe(context);
    if (!descriptor) throw std::runtime_error("describing failed");
    auto instance = std::make_unique<Instance>(*this, *descriptor, context);
    if (instance->create() != kOfxStatOK) throw std::runtime_error("CreateInstance failed");
    return instance;
}

// ---------------------------------------------------------------- instance

namespace {

Value initial_value(const OfxParamStruct& param) {
    const OfxPropertySetStruct& p = param.properties;
    if (param.type == kOfxParamTypeString) return p.text(kOfxParamPropDefault);
    if (param.type == kOfxParamTypeDouble) return p.number(kOfxParamPropDefault);
    if (param.type == kOfxParamTypeRGB) {
        return Colour{p.number(kOfxParamPropDefault, 0), p.number(kOfxParamPropDefault, 1),
                      p.number(kOfxParamPropDefault, 2)};
    }
    return static_cast<int>(p.number(kOfxParamPropDefault));
}

}  // namespace

Instance::Instance(Plugin& plugin, const OfxImageEffectStruct& descriptor,
                   const std::string& context)
    : plugin_(plugin), effect_(false), slaves_(slave_params(descriptor)) {
    effect_.properties.put(kOfxPropType, std::string(kOfxTypeImageEffectInstance));
    effect_.properties.put(kOfxImageEffectPropContext, context);
    for (const auto& [name, clip] : descriptor.clips) {
        auto copy =
            std::make_unique<OfxImageClipStruct>(OfxImageClipStruct{name, clip->properties});
        copy->properties.kind = kClip;
        copy->properties.put(kOfxImageClipPropConnected, 1);
        copy->properties.put(kOfxImageEffectPropPixelDepth, std::string(kOfxBitDepthFloat));
        copy->properties.put(kOfxImageEffectPropComponents, std::string(kOfxImageComponentRGBA));
        copy->properties.put(kOfxImageEffectPropPreMultiplication,
                             std::string(kOfxImageUnPreMultiplied));
        const Config& config = Host::get().config();
        if (name == kOfxImageEffectSimpleSourceClipName && config.frame_range.size() == 2) {
            copy->properties.put_all(kOfxImageEffectPropFrameRange,
                                     {config.frame_range[0], config.frame_range[1]});
        }
        if (config.frame_rate > 0) {
            copy->properties.put(kOfxImageEffectPropFrameRate, config.frame_rate);
        }
        effect_.clips[name] = std::move(copy);
    }
    for (const std::string& name : descriptor.params.order) {
        const OfxParamStruct& param = *descriptor.params.params.at(name);
        auto copy = std::make_unique<OfxParamStruct>(param);
        copy->properties.kind = kParam;
        // Not a property of the standard: nobody can ask for it.
        copy->properties.put(" described as secret",
                             static_cast<int>(copy->properties.number(kOfxParamPropSecret)));
        copy->value = initial_value(param);
        copy->on_set = [this](const std::string& set) { tell(set); };
        effect_.params.params[name] = std::move(copy);
        effect_.params.order.push_back(name);
    }
}

Instance::~Instance() {
    if (created_) destroy();
}

OfxStatus Instance::create() {
    const OfxStatus status = plugin_.call(kOfxActionCreateInstance, &effect_, nullptr, nullptr);
    created_ = status == kOfxStatOK;
    if (created_) check_preferences();
    return status;
}

OfxStatus Instance::destroy() {
    created_ = false;
    return plugin_.call(kOfxActionDestroyInstance, &effect_, nullptr, nullptr);
}

void Instance::set(const std::string& param, Value value) {
    const auto found = effect_.params.params.find(param);
    if (found == effect_.params.params.end()) {
        if (!Host::get().refused()) throw std::runtime_error("no parameter " + param);
        return;
    }
    // A test's own slip: a value of another type would be read as something that it is not.
    if (found->second->value.index() != value.index()) {
        throw std::runtime_error("a value of the wrong type for " + param);
    }
    found->second->value = std::move(value);
    set_since_.insert(param);
}

void Instance::animate(const std::string& param, std::map<double, Value> keys) {
    effect_.params.params.at(param)->keys = std::move(keys);
}

OfxStatus Instance::changed(const std::string& param) {
    // Hosts set the value, or several, before they say so: it is there when the bracket opens.
    bracket(kOfxActionBeginInstanceChanged, kOfxChangeUserEdited);
    const OfxStatus status = changed(kOfxTypeParameter, param, kOfxChangeUserEdited);
    bracket(kOfxActionEndInstanceChanged, kOfxChangeUserEdited);
    return status;
}

OfxStatus Instance::changed(const std::string& type, const std::string& name,
                            const std::string& reason) {
    OfxPropertySetStruct in(kInArgs);
    if (!type.empty()) {
        in.put(kOfxPropType, type);
        in.put(kOfxPropName, name);
    }
    in.put(kOfxPropChangeReason, reason);
    in.put(kOfxPropTime, shown_time);
    in.put_all(kOfxImageEffectPropRenderScale, {1.0, 1.0});
    const OfxStatus status = plugin_.call(kOfxActionInstanceChanged, &effect_, &in, nullptr);
    if (!telling_) check_preferences();
    return status;
}

OfxStatus Instance::bracket(const char* action, const std::string& reason) {
    OfxPropertySetStruct in(kInArgs);
    in.put(kOfxPropChangeReason, reason);
    return plugin_.call(action, &effect_, &in, nullptr);
}

// Hosts built on the standard's host library do the same: the plugin hears of its own setting
// before the call that sets returns. It may not answer that with another setting.
void Instance::tell(const std::string& param) {
    ++settings_[param];
    set_since_.insert(param);
    if (telling_) {
        Host::get().fault("paramSetValue: in answer to the plugin's own setting");
        return;
    }
    telling_ = true;
    bracket(kOfxActionBeginInstanceChanged, kOfxChangePluginEdited);
    changed(kOfxTypeParameter, param, kOfxChangePluginEdited);
    bracket(kOfxActionEndInstanceChanged, kOfxChangePluginEdited);
    telling_ = false;
}

OfxStatus Instance::sync() {
    return plugin_.call(kOfxActionSyncPrivateData, &effect_, nullptr, nullptr);
}

std::string Instance::text(const std::string& param) {
    const auto found = effect_.params.params.find(param);
    return found == effect_.params.params.end() ? "" : std::get<std::string>(found->second->value);
}

const Value& Instance::value(const std::string& param) {
    return effect_.params.params.at(param)->value;
}

const OfxPropertySetStruct& Instance::properties(const std::string& param) {
    return effect_.params.params.at(param)->properties;
}

namespace {

OfxPropertySetStruct render_arguments(double time, const OfxRectI& window) {
    OfxPropertySetStruct in(kInArgs);
    in.put(kOfxPropTime, time);
    in.put(kOfxImageEffectPropFieldToRender, std::string(kOfxImageFieldNone));
    in.put_all(kOfxImageEffectPropRenderWindow, {window.x1, window.y1, window.x2, window.y2});
    in.put_all(kOfxImageEffectPropRenderScale, {1.0, 1.0});
    in.put(kOfxImageEffectPropSequentialRenderStatus, 0);
    in.put(kOfxImageEffectPropInteractiveRenderStatus, 0);
    return in;
}

}  // namespace

OfxStatus Instance::is_identity(double time, std::string& clip, double& clip_time) {
    OfxPropertySetStruct in = render_arguments(time, {0, 0, 16, 16});
    OfxPropertySetStruct out(kOutArgs);
    out.put(kOfxPropName, std::string());
    out.put(kOfxPropTime, time);
    const OfxStatus status = plugin_.call(kOfxImageEffectActionIsIdentity, &effect_, &in, &out);
    clip = out.text(kOfxPropName);
    clip_time = out.number(kOfxPropTime);
    return status;
}

OfxStatus Instance::output_colourspace(std::string& name) {
    OfxPropertySetStruct in(kInArgs), out(kOutArgs);
    in.put_all(kOfxImageClipPropPreferredColourspaces, {std::string("ofx_scene_linear")});
    const OfxStatus status =
        plugin_.call(kOfxImageEffectActionGetOutputColourspace, &effect_, &in, &out);
    name = out.text(kOfxImageClipPropColourspace);
    return status;
}

OfxStatus Instance::render(double time, const Picture* source, Picture& output,
                           const OfxRectI& window) {
    if (!twice) return render_once(time, source, output, window);
    Picture again = output;
    const OfxStatus second = render_once(time, source, again, window);
    const OfxStatus status = render_once(time, source, output, window);
    if (status != second || again.storage() != output.storage()) {
        Host::get().fault("render: not the same twice");
    }
    return status;
}

OfxStatus Instance::render_once(double time, const Picture* source, Picture& output,
                                const OfxRectI& window) {
    Host& host = Host::get();
    const std::vector<unsigned char> source_before =
        source ? source->storage() : std::vector<unsigned char>();
    const std::vector<unsigned char> output_before = output.storage();
    std::set<OfxPropertySetHandle> images;
    const Activity before = activity();
    activity() = {"", false, &output, source, &images};
    OfxPropertySetStruct in = render_arguments(time, window);
    in.put_all(kOfxImageEffectPropRenderScale, {output.layout().scale, output.layout().scale});
    for (const auto& [name, value] : extra_arguments) in.put(name, value);
    const OfxStatus status = plugin_.call(kOfxImageEffectActionRender, &effect_, &in, nullptr);
    activity() = before;

    if (!images.empty() && !host.config().null_functions.count("clipReleaseImage")) {
        host.fault("render: " + std::to_string(images.size()) + " images were not released");
    }
    for (OfxPropertySetHandle image : images) delete image;
    if (source && source->storage() != source_before) host.fault("render: the source was written");
    const std::vector<bool> inside = output.mask(window);
    for (std::size_t i = 0; i < inside.size(); ++i) {
        if (!inside[i] && output.storage()[i] != output_before[i]) {
            host.fault("render: wrote outside the render window");
            break;
        }
    }
    if (status == kOfxStatReplyDefault) host.fault("render: must be handled");
    return status;
}

}  // namespace strict
