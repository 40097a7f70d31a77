// Pictures that several tests use.
#pragma once

#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "recolour/recolour.hpp"

namespace images {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// A packed image, and views of it.
struct Image {
    int width, height, channels;
    std::vector<float> data;
    Image(int w, int h, int c)
        : width(w), height(h), channels(c), data(static_cast<std::size_t>(w) * h * c) {}
    std::ptrdiff_t row() const {
        return static_cast<std::ptrdiff_t>(sizeof(float)) * width * channels;
    }
    palette4d::ConstImageView in() const { return {data.data(), width, height, channels, row()}; }
    palette4d::ImageView out() { return {data.data(), width, height, channels, row()}; }
};

inline bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

}  // namespace images
