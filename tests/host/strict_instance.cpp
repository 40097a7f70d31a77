// One instance of a plugin: the actions that the host sends it, and what it says to each.
#include <cmath>
#include <stdexcept>
#include <utility>

#include "strict_gpu.hpp"
#include "strict_host.hpp"

namespace strict {
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

double srgb_of(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}
double linear_of(double srgb) {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

/// Hosts show the numbers of a colour as they are, Natron as linear light.
Colour through(double (*curve)(double), Colour colour) {
    if (!Host::get().config().natron) return colour;
    for (double& component : colour) component = curve(component);
    return colour;
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
        const char* const temporal = kOfxImageEffectPropTemporalClipAccess;
        copy->properties.put(kTemporal,
                             static_cast<int>(clip->properties.number(temporal) != 0 &&
                                              descriptor.properties.number(temporal) != 0));
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
        copy->on_set = [this](const std::string& set, const Value& before) { tell(set, before); };
        copy->set = &effect_.params;
        effect_.params.params[name] = std::move(copy);
        effect_.params.order.push_back(name);
    }
    effect_.params.on_edit_end = [this] {
        for (const std::string& name : set_since_) {
            if (slaves_.count(name) == 0) continue;
            OfxPropertySetStruct out(kOutArgs);
            clip_preferences(out);
            return;
        }
    };
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
    std::set<OfxPropertySetHandle> images;
    const Activity before = activity();
    activity().time = shown_time;
    if (frames && reason == kOfxChangeUserEdited) {
        activity().images = &images;
        activity().frames = &frames;
    }
    const OfxStatus status = plugin_.call(kOfxActionInstanceChanged, &effect_, &in, nullptr);
    activity() = before;
    check_released(images, "instanceChanged");
    if (telling_) return status;
    if (effect_.in_progress) Host::get().fault("progressStart without its End");
    if (effect_.params.open_step) {
        Host::get().fault("paramEditBegin without its End");
        effect_.params.open_step.reset();
    }
    check_preferences();
    return status;
}

std::map<std::string, Value> Instance::put_back(const std::map<std::string, Value>& values) {
    std::map<std::string, Value> there;
    for (const auto& [name, value] : values) {
        there[name] = this->value(name);
        set(name, value);
    }
    for (const auto& [name, value] : values) changed(name);
    return there;
}

std::map<std::string, Value> Instance::undo() {
    if (undo_steps().empty()) throw std::runtime_error("nothing to undo");
    const UndoStep step = undo_steps().back();
    effect_.params.steps.pop_back();
    for (const auto& [name, keys] : step.keys) animate(name, keys);
    return put_back(step.before);
}

void Instance::restore_defaults(const std::vector<std::string>& names) {
    const auto has_value = [&](const std::string& name) {
        const std::string& type = effect_.params.params.at(name)->type;
        return type != kOfxParamTypeGroup && type != kOfxParamTypePushButton;
    };
    for (const std::string& name : names) {
        OfxParamStruct& param = *effect_.params.params.at(name);
        if (!has_value(name)) continue;
        param.keys.clear();
        const Value initial = initial_value(param);
        if (param.type != kOfxParamTypeRGB) {
            if (param.value == initial) continue;
            set(name, initial);
            changed(name);
            continue;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            Colour colour = std::get<Colour>(param.value);
            if (colour[c] == std::get<Colour>(initial)[c]) continue;
            colour[c] = std::get<Colour>(initial)[c];
            set(name, colour);
            changed(name);
        }
    }
    for (const std::string& name : names) {
        if (has_value(name)) changed(name);
    }
}

std::vector<unsigned char> Instance::cached(double time, const Picture& source) {
    FrameKey key{time, {}};
    for (const std::string& name : effect_.params.order) {
        const OfxParamStruct& param = *effect_.params.params.at(name);
        const OfxPropertySetStruct& p = param.properties;
        if (p.has(kOfxParamPropEvaluateOnChange) && p.number(kOfxParamPropEvaluateOnChange) == 0) {
            continue;
        }
        key.second.emplace_back(param.value, param.keys);
    }
    const auto found = cache_.find(key);
    if (found != cache_.end()) return found->second;
    Picture output(source.layout());
    const OfxRectI& all = source.layout().bounds;
    if (render(time, &source, output, all) != kOfxStatOK) return {};
    return cache_[key] = output.pixels(all);
}

OfxStatus Instance::bracket(const char* action, const std::string& reason) {
    OfxPropertySetStruct in(kInArgs);
    in.put(kOfxPropChangeReason, reason);
    return plugin_.call(action, &effect_, &in, nullptr);
}

// Hosts built on the standard's host library do the same: the plugin hears of its own setting
// before the call that sets returns. It may not answer that with another setting.
void Instance::tell(const std::string& param, const Value& before) {
    ++settings_[param];
    set_since_.insert(param);
    if (telling_) {
        Host::get().fault("paramSetValue: in answer to the plugin's own setting");
        return;
    }
    const OfxPropertySetStruct& about = properties(param);
    const bool undone = !about.has(kOfxParamPropCanUndo) || about.number(kOfxParamPropCanUndo) != 0;
    if (undone && activity().action == kOfxActionInstanceChanged) {
        if (effect_.params.open_step) {
            effect_.params.open_step->before.emplace(param, before);
        } else if (Host::get().has_undo_steps()) {
            Host::get().fault("paramSetValue: " + param + " would be undone in a step of its own");
        }
    }
    telling_ = true;
    bracket(kOfxActionBeginInstanceChanged, kOfxChangePluginEdited);
    changed(kOfxTypeParameter, param, kOfxChangePluginEdited);
    bracket(kOfxActionEndInstanceChanged, kOfxChangePluginEdited);
    telling_ = false;
}

Colour Instance::swatch(const std::string& param) {
    return through(srgb_of, std::get<Colour>(value(param)));
}

OfxStatus Instance::pick(const std::string& param, const Colour& displayed) {
    set(param, through(linear_of, displayed));
    return changed(param);
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

OfxStatus Instance::region_of_interest(double time, double scale, std::array<double, 4>& region) {
    OfxPropertySetStruct in(kInArgs), out(kOutArgs);
    const std::vector<Value> asked(region.begin(), region.end());
    in.put(kOfxPropTime, time);
    in.put_all(kOfxImageEffectPropRenderScale, {scale, scale});
    in.put_all(kOfxImageEffectPropRegionOfInterest, asked);
    out.put_all("OfxImageClipPropRoI_Source", asked);
    const OfxStatus status =
        plugin_.call(kOfxImageEffectActionGetRegionsOfInterest, &effect_, &in, &out);
    for (std::size_t i = 0; i < region.size(); ++i) {
        region[i] = out.number("OfxImageClipPropRoI_Source", i);
    }
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

void Instance::check_released(const std::set<OfxPropertySetHandle>& images, const char* action) {
    Host& host = Host::get();
    if (!images.empty() && !host.config().null_functions.count("clipReleaseImage")) {
        host.fault(std::string(action) + ": " + std::to_string(images.size()) +
                   " images were not released");
    }
    for (OfxPropertySetHandle image : images) delete image;
}

OfxStatus Instance::render_there(double time, const Picture& source, Picture& output,
                                 const std::map<const Picture*, void*>& memory) {
    std::set<OfxPropertySetHandle> images;
    const Activity before = activity();
    activity() = {"", false, false, &output, &source, nullptr, &images, "", time};
    activity().devices = &memory;
    OfxPropertySetStruct in = render_arguments(time, output.layout().bounds);
    gpu->describe(in);
    const OfxStatus status = plugin_.call(kOfxImageEffectActionRender, &effect_, &in, nullptr);
    activity() = before;
    check_released(images, "render");
    return status;
}

OfxStatus Instance::render_copied(OfxPropertySetStruct& arguments, const Picture* source,
                                  Picture& output) {
    std::map<const Picture*, void*> devices;
    for (const Picture* picture : {source, static_cast<const Picture*>(&output), brush}) {
        if (!picture || devices.count(picture)) continue;
        auto& all = const_cast<Picture&>(*picture);
        devices[picture] = gpu->allocate(all.rest(), all.rest_size());
    }
    gpu->describe(arguments);
    activity().devices = &devices;
    const OfxStatus status =
        plugin_.call(kOfxImageEffectActionRender, &effect_, &arguments, nullptr);
    for (const auto& [picture, memory] : devices) {
        auto& all = const_cast<Picture&>(*picture);
        if (picture == &output) {
            gpu->download(memory, all.rest(), all.rest_size());
        } else {
            std::vector<unsigned char> after(all.rest_size());
            gpu->download(memory, after.data(), after.size());
            if (!std::equal(after.begin(), after.end(), all.rest())) {
                Host::get().fault("render: a source on the device was written");
            }
        }
        gpu->release(memory);
    }
    return status;
}

OfxStatus Instance::render_once(double time, const Picture* source, Picture& output,
                                const OfxRectI& window) {
    Host& host = Host::get();
    const std::vector<unsigned char> source_before =
        source ? source->storage() : std::vector<unsigned char>();
    const std::vector<unsigned char> output_before = output.storage();
    if (host.config().natron) {
        const std::lock_guard<std::mutex> lock(effect_.mutex);
        effect_.persistent_message.clear();
    }
    std::set<OfxPropertySetHandle> images;
    const Activity before = activity();
    activity() = {"", false, false, &output, source, brush, &images, "", time};
    OfxPropertySetStruct in = render_arguments(time, window);
    in.put_all(kOfxImageEffectPropRenderScale, {output.layout().scale, output.layout().scale});
    for (const auto& [name, value] : extra_arguments) in.put(name, value);
    const OfxStatus status =
        gpu ? render_copied(in, source, output)
            : plugin_.call(kOfxImageEffectActionRender, &effect_, &in, nullptr);
    activity() = before;

    check_released(images, "render");
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
