// One clip of an instance and its image at a time.
#pragma once

#include <optional>

#include "pixels.hpp"

namespace palette4d::node {

/// Always releases the image.
class ClipImage {
public:
    ClipImage(const Suites& suites, OfxImageEffectHandle effect, const char* name, OfxTime time);
    ~ClipImage();
    ClipImage(const ClipImage&) = delete;
    ClipImage& operator=(const ClipImage&) = delete;

    /// The host has no picture here: the standard then asks for transparent black.
    bool absent() const { return absent_; }
    /// Also empty for a picture that cannot be read.
    const std::optional<Image>& pixels() const { return pixels_; }

private:
    const Suites& suites_;
    OfxPropertySetHandle handle_ = nullptr;
    bool absent_ = false;
    std::optional<Image> pixels_;
};

}  // namespace palette4d::node
