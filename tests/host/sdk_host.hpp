// A host made of the OpenFX project's own host library (HostSupport), on which Natron is built: an
// effect with one clip in float RGBA, opaque, whose changes and preferences go as the library has
// it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

// The library's headers need what others include before them.
#include "ofxCore.h"
#include "ofxImageEffect.h"
#include "ofxPixels.h"
// clang-format off
#include "ofxhBinary.h"
#include "ofxhPropertySuite.h"
#include "ofxhClip.h"
#include "ofxhParam.h"
#include "ofxhMemory.h"
#include "ofxhImageEffect.h"
#include "ofxhPluginAPICache.h"
#include "ofxhPluginCache.h"
#include "ofxhHost.h"
#include "ofxhImageEffectAPI.h"
// clang-format on

namespace sdk_host {

namespace sdk = OFX::Host;

constexpr int kWidth = 61, kHeight = 37;
constexpr double kFirst = 0, kLast = 20;  ///< of the clip, at the golden sidecars' rate

inline int g_failures = 0;
#define EXPECT(condition)                                                           \
    do {                                                                            \
        if (!(condition)) {                                                         \
            std::cerr << __FILE__ << ":" << __LINE__ << ": " << #condition << "\n"; \
            ++g_failures;                                                           \
        }                                                                           \
    } while (false)

// ---------------------------------------------------------------- parameters with one value

template <class Base, class Value>
class One : public Base {
public:
    using Base::Base;
    OfxStatus get(Value& v) override { return v = value, kOfxStatOK; }
    OfxStatus get(OfxTime, Value& v) override { return v = value, kOfxStatOK; }
    OfxStatus set(Value v) override { return value = v, kOfxStatOK; }
    OfxStatus set(OfxTime, Value v) override { return value = v, kOfxStatOK; }
    Value value{};
};
using Integer = One<sdk::Param::IntegerInstance, int>;
using Choice = One<sdk::Param::ChoiceInstance, int>;
using Flag = One<sdk::Param::BooleanInstance, bool>;

class Number : public One<sdk::Param::DoubleInstance, double> {
public:
    using One::One;
    OfxStatus derive(OfxTime, double&) override { return kOfxStatErrUnsupported; }
    OfxStatus integrate(OfxTime, OfxTime, double&) override { return kOfxStatErrUnsupported; }
};

class Colour : public sdk::Param::RGBInstance {
public:
    using RGBInstance::RGBInstance;
    OfxStatus get(double& r, double& g, double& b) override {
        return r = rgb[0], g = rgb[1], b = rgb[2], kOfxStatOK;
    }
    OfxStatus get(OfxTime, double& r, double& g, double& b) override { return get(r, g, b); }
    OfxStatus set(double r, double g, double b) override { return rgb = {r, g, b}, kOfxStatOK; }
    OfxStatus set(OfxTime, double r, double g, double b) override { return set(r, g, b); }
    std::array<double, 3> rgb{};
};

class Text : public sdk::Param::StringInstance {
public:
    using StringInstance::StringInstance;
    OfxStatus get(std::string& v) override { return v = value, kOfxStatOK; }
    OfxStatus get(OfxTime, std::string& v) override { return v = value, kOfxStatOK; }
    OfxStatus set(const char* v) override { return value = v, kOfxStatOK; }
    OfxStatus set(OfxTime, const char* v) override { return value = v, kOfxStatOK; }
    std::string value;
};

// ---------------------------------------------------------------- clips

/// Colours inside and outside of the golden palettes, in float RGBA.
inline std::vector<float> source_pixels() {
    std::vector<float> pixels;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            pixels.insert(pixels.end(),
                          {static_cast<float>(x) / 50 - 0.1f, static_cast<float>(y) / 40,
                           static_cast<float>((x * y) % 29) / 30, 0.5f});
        }
    }
    return pixels;
}

class Image : public sdk::ImageEffect::Image {
public:
    Image(sdk::ImageEffect::ClipInstance& clip, std::vector<float> values)
        : sdk::ImageEffect::Image(clip), pixels(std::move(values)) {
        const int bounds[] = {0, 0, kWidth, kHeight};
        for (int i = 0; i < 4; ++i) {
            setIntProperty(kOfxImagePropBounds, bounds[i], i);
            setIntProperty(kOfxImagePropRegionOfDefinition, bounds[i], i);
        }
        for (int i = 0; i < 2; ++i) setDoubleProperty(kOfxImageEffectPropRenderScale, 1, i);
        setPointerProperty(kOfxImagePropData, pixels.data());
        setIntProperty(kOfxImagePropRowBytes, kWidth * 16);
    }
    std::vector<float> pixels;
};

class Clip : public sdk::ImageEffect::ClipInstance {
public:
    Clip(sdk::ImageEffect::Instance* effect, sdk::ImageEffect::ClipDescriptor& described)
        : ClipInstance(effect, described) {}
    ~Clip() override {
        if (output) output->releaseReference();
    }
    const std::string& getUnmappedBitDepth() const override { return text(kOfxBitDepthFloat); }
    const std::string& getUnmappedComponents() const override {
        return text(kOfxImageComponentRGBA);
    }
    const std::string& getPremult() const override { return text(kOfxImageOpaque); }
    double getAspectRatio() const override { return 1; }
    double getFrameRate() const override { return 24; }
    void getFrameRange(double& first, double& last) const override {
        first = kFirst;
        last = kLast;
    }
    const std::string& getFieldOrder() const override { return text(kOfxImageFieldNone); }
    bool getConnected() const override { return true; }
    double getUnmappedFrameRate() const override { return 24; }
    void getUnmappedFrameRange(double& first, double& last) const override {
        getFrameRange(first, last);
    }
    bool getContinuousSamples() const override { return false; }
    sdk::ImageEffect::Image* getImage(OfxTime, const OfxRectD*) override {
        if (!isOutput()) return new Image(*this, source_pixels());
        if (!output) output = new Image(*this, std::vector<float>(kWidth * kHeight * 4, -1.0f));
        output->addReference();
        return output;
    }
    OfxRectD getRegionOfDefinition(OfxTime) const override { return {0, 0, kWidth, kHeight}; }
    Image* output = nullptr;

private:
    static const std::string& text(const char* word) {
        static std::set<std::string> words;
        return *words.insert(word).first;
    }
};

// ---------------------------------------------------------------- the effect and the host

inline const OfxPointD kScale = {1, 1};

class Effect : public sdk::ImageEffect::Instance {
public:
    using Instance::Instance;
    const std::string& getDefaultOutputFielding() const override {
        static const std::string none = kOfxImageFieldNone;
        return none;
    }
    sdk::ImageEffect::ClipInstance* newClipInstance(Instance*,
                                                    sdk::ImageEffect::ClipDescriptor* described,
                                                    int) override {
        return new Clip(this, *described);
    }
    OfxStatus vmessage(const char*, const char*, const char*, va_list) override {
        return kOfxStatOK;
    }
    OfxStatus setPersistentMessage(const char*, const char*, const char* format,
                                   va_list args) override {
        char words[1000];
        std::vsnprintf(words, sizeof words, format, args);
        message = words;
        return kOfxStatOK;
    }
    OfxStatus clearPersistentMessage() override {
        message.clear();
        return kOfxStatOK;
    }
    void getProjectSize(double& x, double& y) const override { x = kWidth, y = kHeight; }
    void getProjectOffset(double& x, double& y) const override { x = y = 0; }
    void getProjectExtent(double& x, double& y) const override { getProjectSize(x, y); }
    double getProjectPixelAspectRatio() const override { return 1; }
    double getEffectDuration() const override { return kLast - kFirst + 1; }
    double getFrameRate() const override { return 24; }
    double getFrameRecursive() const override { return kFirst; }
    void getRenderScaleRecursive(double& x, double& y) const override { x = y = 1; }
    sdk::Param::Instance* newParam(const std::string&, sdk::Param::Descriptor& d) override {
        const std::string& type = d.getType();
        const auto initial = [&](int i = 0) {
            return d.getProperties().getDoubleProperty(kOfxParamPropDefault, i);
        };
        const auto with = [&](auto* param) {
            param->value = d.getProperties().getIntProperty(kOfxParamPropDefault);
            return param;
        };
        if (type == kOfxParamTypeInteger) return with(new Integer(d, this));
        if (type == kOfxParamTypeChoice) return with(new Choice(d, this));
        if (type == kOfxParamTypeBoolean) {
            auto* flag = new Flag(d, this);
            flag->value = d.getProperties().getIntProperty(kOfxParamPropDefault) != 0;
            return flag;
        }
        if (type == kOfxParamTypeDouble) {
            auto* number = new Number(d, this);
            number->value = initial();
            return number;
        }
        if (type == kOfxParamTypeRGB) {
            auto* colour = new Colour(d, this);
            colour->rgb = {initial(0), initial(1), initial(2)};
            return colour;
        }
        if (type == kOfxParamTypeString) {
            auto* text = new Text(d, this);
            text->value = d.getProperties().getStringProperty(kOfxParamPropDefault);
            return text;
        }
        if (type == kOfxParamTypePushButton) return new sdk::Param::PushbuttonInstance(d, this);
        if (type == kOfxParamTypeGroup) return new sdk::Param::GroupInstance(d, this);
        return nullptr;
    }
    OfxStatus editBegin(const std::string& label) override {
        EXPECT(!in_step && !label.empty());
        in_step = true;
        return kOfxStatOK;
    }
    OfxStatus editEnd() override {
        EXPECT(in_step);
        in_step = false;
        ++steps;
        return kOfxStatOK;
    }
    void progressStart(const std::string&, const std::string&) override {}
    void progressEnd() override {}
    bool progressUpdate(double) override { return true; }
    double timeLineGetTime() override { return kFirst; }
    void timeLineGotoTime(double) override {}
    void timeLineGetBounds(double& first, double& last) override { first = kFirst, last = kLast; }

    template <class Param>
    Param& param(const std::string& name) {
        return dynamic_cast<Param&>(*getParam(name));
    }
    /// The user has changed a parameter; whether the host must ask for the clips' preferences.
    bool changed(const std::string& name, double time = kFirst) {
        beginInstanceChangedAction(kOfxChangeUserEdited);
        EXPECT(paramInstanceChangedAction(name, kOfxChangeUserEdited, time, kScale) == kOfxStatOK);
        endInstanceChangedAction(kOfxChangeUserEdited);
        EXPECT(!in_step);
        const bool asks = areClipPrefsDirty();
        if (asks) EXPECT(getClipPreferences());
        return asks;
    }
    template <class Param, class Value>
    bool change(const std::string& name, const Value& value) {
        param<Param>(name).value = value;
        return changed(name);
    }
    bool identity(double time) {
        std::string clip;
        const OfxRectI all = {0, 0, kWidth, kHeight};
        return isIdentityAction(time, kOfxImageFieldNone, all, kScale, clip) == kOfxStatOK &&
               clip == kOfxImageEffectSimpleSourceClipName;
    }
    std::vector<float> rendered(double time, int tile = 1000) {
        auto& clip = dynamic_cast<Clip&>(*getClip(kOfxImageEffectOutputClipName));
        if (clip.output) std::fill(clip.output->pixels.begin(), clip.output->pixels.end(), -1.0f);
        beginRenderAction(time, time, 1, false, kScale, true, false);
        for (int y = 0; y < kHeight; y += tile) {
            for (int x = 0; x < kWidth; x += tile) {
                const OfxRectI window = {x, y, std::min(x + tile, kWidth),
                                         std::min(y + tile, kHeight)};
                EXPECT(renderAction(time, kOfxImageFieldNone, window, kScale, true, false, false) ==
                       kOfxStatOK);
            }
        }
        endRenderAction(time, time, 1, false, kScale, true, false);
        return clip.output ? clip.output->pixels : std::vector<float>();
    }
    std::string message;
    bool in_step = false;
    int steps = 0;  ///< of undo
};

class Host : public sdk::ImageEffect::Host {
public:
    Host() {
        _properties.setIntProperty(kOfxPropAPIVersion, 1, 0);
        _properties.setIntProperty(kOfxPropAPIVersion, 4, 1);
        _properties.setStringProperty(kOfxPropName, "org.palette4d.tests.sdk_host");
        for (const char* supported :
             {kOfxImageEffectPropSupportsTiles, kOfxImageEffectPropSupportsMultiResolution}) {
            _properties.setIntProperty(supported, 1);
        }
        _properties.setStringProperty(kOfxImageEffectPropSupportedComponents,
                                      kOfxImageComponentRGBA);
        _properties.setStringProperty(kOfxImageEffectPropSupportedPixelDepths, kOfxBitDepthFloat);
        _properties.setStringProperty(kOfxImageEffectPropSupportedContexts,
                                      kOfxImageEffectContextFilter, 0);
        _properties.setStringProperty(kOfxImageEffectPropSupportedContexts,
                                      kOfxImageEffectContextGeneral, 1);
        _properties.setIntProperty(kOfxParamHostPropMaxParameters, -1);
    }
    sdk::ImageEffect::Instance* newInstance(void*, sdk::ImageEffect::ImageEffectPlugin* plugin,
                                            sdk::ImageEffect::Descriptor& described,
                                            const std::string& context) override {
        return new Effect(plugin, described, context, false);
    }
    using Plugin = sdk::ImageEffect::ImageEffectPlugin;
    using Descriptor = sdk::ImageEffect::Descriptor;
    Descriptor* makeDescriptor(Plugin* plugin) override { return new Descriptor(plugin); }
    Descriptor* makeDescriptor(const Descriptor& root, Plugin* plugin) override {
        return new Descriptor(root, plugin);
    }
    Descriptor* makeDescriptor(const std::string& bundle, Plugin* plugin) override {
        return new Descriptor(bundle, plugin);
    }
    OfxStatus vmessage(const char*, const char*, const char*, va_list) override {
        return kOfxStatOK;
    }
    OfxStatus setPersistentMessage(const char*, const char*, const char*, va_list) override {
        return kOfxStatOK;
    }
    OfxStatus clearPersistentMessage() override { return kOfxStatOK; }
    OfxStatus multiThread(OfxThreadFunctionV1 work, unsigned count, void* data) override {
        std::vector<std::thread> threads;
        for (unsigned i = 0; i < count; ++i) threads.emplace_back(work, i, count, data);
        for (std::thread& thread : threads) thread.join();
        return kOfxStatOK;
    }
    OfxStatus multiThreadNumCPUS(unsigned* count) const override { return *count = 3, kOfxStatOK; }
    OfxStatus multiThreadIndex(unsigned*) const override { return kOfxStatErrUnsupported; }
    int multiThreadIsSpawnedThread() const override { return 0; }
    OfxStatus mutexCreate(OfxMutexHandle*, int) override { return kOfxStatErrUnsupported; }
    OfxStatus mutexDestroy(const OfxMutexHandle) override { return kOfxStatErrUnsupported; }
    OfxStatus mutexLock(const OfxMutexHandle) override { return kOfxStatErrUnsupported; }
    OfxStatus mutexUnLock(const OfxMutexHandle) override { return kOfxStatErrUnsupported; }
    OfxStatus mutexTryLock(const OfxMutexHandle) override { return kOfxStatErrUnsupported; }
};

}  // namespace sdk_host
