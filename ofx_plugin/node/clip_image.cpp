#include "clip_image.hpp"

namespace palette4d::node {

ClipImage::ClipImage(const Suites& suites, OfxImageEffectHandle effect, const char* name,
                     OfxTime time)
    : suites_(suites) {
    const OfxImageEffectSuiteV1& suite = *suites.effect;
    OfxImageClipHandle clip = nullptr;
    OfxPropertySetHandle clip_set = nullptr;
    if (!suite.clipGetHandle || !suite.clipGetImage ||
        suite.clipGetHandle(effect, name, &clip, &clip_set) != kOfxStatOK || !clip) {
        return;
    }
    const OfxStatus status = suite.clipGetImage(clip, time, nullptr, &handle_);
    if (status != kOfxStatOK) handle_ = nullptr;
    absent_ = !handle_ && (status == kOfxStatOK || status == kOfxStatFailed);
    if (handle_) {
        pixels_ = read_image(Properties(suites, handle_), Properties(suites, clip_set));
    }
}

ClipImage::~ClipImage() {
    if (handle_ && suites_.effect->clipReleaseImage) suites_.effect->clipReleaseImage(handle_);
}

}  // namespace palette4d::node
