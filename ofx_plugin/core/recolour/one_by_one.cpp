#include "recolour/one_by_one.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>

namespace palette4d {
namespace {

constexpr std::size_t kSlots = 2048;

std::size_t slot(const Vec3& p) {
    std::uint64_t hash = 0;
    for (const double value : p) {
        std::uint64_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
        hash ^= hash >> 29;
    }
    return static_cast<std::size_t>((hash * 0x9E3779B97F4A7C15u) >> 53);
}

}  // namespace

OneByOne::OneByOne(const Recolourer& recolourer, const RecolourOptions& options)
    : recolourer_(recolourer),
      strength_(options.strength),
      divide_(options.premultiplied),
      weights_(recolourer.original().size()) {}

void OneByOne::row(const float* in, float* out, int width, int channels) {
    for (int x = 0; x < width; ++x, in += channels, out += channels) {
        const bool finite_colour =
            std::isfinite(in[0]) && std::isfinite(in[1]) && std::isfinite(in[2]);
        if (channels == 4) out[3] = in[3];
        if (finite_colour && (!divide_ || (in[3] != 0 && std::isfinite(in[3])))) {
            recolour(in, out);
        } else {
            for (int c = 0; c < 3; ++c) out[c] = in[c];
        }
    }
}

void OneByOne::recolour(const float* from, float* to) {
    ++count_;
    const double alpha = divide_ ? from[3] : 1.0;
    const Vec3 seen{from[0], from[1], from[2]};
    const Vec3& moved =
        displacement(divide_ ? Vec3{seen[0] / alpha, seen[1] / alpha, seen[2] / alpha} : seen);
    for (std::size_t c = 0; c < 3; ++c) {
        // Multiplying the displaced colour by alpha again is the same as this, less rounding.
        const double step = alpha * (strength_ * moved[c]);
        // Channels that do not move keep their bits, a negative zero included.
        to[c] = step != 0 ? static_cast<float>(seen[c] + step) : from[c];
    }
}

const Vec3& OneByOne::displacement(const Vec3& p) {
    if (memory_.empty()) memory_.assign(kSlots, Entry{{0, 0, 0}, {0, 0, 0}, false});
    Entry& entry = memory_[slot(p)];
    if (!entry.known || entry.colour != p) {
        entry = {p, recolourer_.displacement_at(p, weights_, workspace_), true};
    }
    return entry.displacement;
}

}  // namespace palette4d
