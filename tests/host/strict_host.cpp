// The host itself: configuration, faults, pictures, and the plugins it opens.
#include "strict_host.hpp"

#if defined(_WIN32)
#include <windows.h>
// After windows.h, which it needs.
#include <shellapi.h>
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
    properties_.put("NatronOfxHostIsNatron", int{config_.natron});
    properties_.put(kOfxImageEffectPropSupportsMultiResolution, int{config_.multi_resolution});
    for (const char* system : {"OpenCL", "Cuda"}) {
        properties_.put("OfxImageEffectProp" + std::string(system) + "RenderSupported",
                        std::string(config_.gpus ? "true" : "false"));
    }
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

bool Host::has_undo_steps() const {
    // Natron's window undoes nothing that a plugin sets outside of such a block.
    return !config_.natron && config_.edit_answer == kOfxStatOK &&
           !config_.null_functions.count("paramEditBegin") &&
           !config_.null_functions.count("paramEditEnd") && !refused() && !config_.incomplete;
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
    if (key == std::string(kOfxProgressSuite) + "/1") table = progress_suite();
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

namespace fs = std::filesystem;

fs::path binary_of(const std::string& bundle) {
    const fs::path folder = fs::u8path(bundle) / "Contents" / PALETTE4D_ARCHITECTURE;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".ofx") return entry.path();
    }
    throw std::runtime_error(folder.u8string() + ": no .ofx file inside");
}

}  // namespace

std::vector<std::string> arguments(int argc, char** argv) {
    std::vector<std::string> all(argv, argv + argc);
#if defined(_WIN32)
    int count = 0;
    wchar_t** const wide = CommandLineToArgvW(GetCommandLineW(), &count);
    if (!wide) throw std::runtime_error("no command line");
    all.clear();
    for (int i = 0; i < count; ++i) all.push_back(fs::path(wide[i]).u8string());
    LocalFree(wide);
#endif
    return all;
}

void set_variable(const std::string& name, const std::optional<std::string>& value) {
#if defined(_WIN32)
    const std::wstring text = fs::u8path(value.value_or("")).wstring();
    SetEnvironmentVariableW(fs::u8path(name).c_str(), value ? text.c_str() : nullptr);
#else
    if (value) {
        setenv(name.c_str(), value->c_str(), 1);
    } else {
        unsetenv(name.c_str());
    }
#endif
}

Plugin::Plugin(const std::string& bundle, int which) {
    const fs::path path = binary_of(bundle);
    const std::string binary = path.u8string();
#if defined(_WIN32)
    library_ = LoadLibraryW(path.c_str());
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
    if (count() != 2 || plugin(2) || plugin(-1)) Host::get().fault("not exactly two plugins");
    plugin_ = plugin(which);
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
    if (activity().locked) {
        Host::get().fault("paramEditEnd: " + std::string(action) + " waits for its lock for ever");
    }
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
    activity().context = context;
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

}  // namespace strict
