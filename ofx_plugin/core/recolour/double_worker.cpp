#include "recolour/double_worker.hpp"

#include <cstdint>
#include <cstring>

#include "model/vec3.hpp"
#include "recolour/recolour_plan.hpp"

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

DoubleWorker::DoubleWorker(const Recolourer& recolourer, const RecolourOptions& options,
                           int channels)
    : recolourer_(recolourer),
      strength_(options.strength),
      divide_(options.premultiplied),
      channels_(channels),
      picks_(!recolourer.plan().twofold.picks.plan().empty()),
      plan_(recolourer.plan().twofold.picks.plan()),
      weights_(recolourer.original().size()) {}

void DoubleWorker::row(const float* from, float* to, int width) {
    for (int x = 0; x < width; ++x, from += channels_, to += channels_) {
        if (channels_ == 4) to[3] = from[3];
        if (recolourable(from, divide_)) {
            recolour(from, to);
        } else {
            for (int c = 0; c < 3; ++c) to[c] = from[c];
        }
    }
}

void DoubleWorker::recolour(const float* from, float* to) {
    ++count_;
    const double alpha = divide_ ? from[3] : 1.0;
    const Vec3& moved = displacement(straight_colour(from, divide_));
    for (std::size_t c = 0; c < 3; ++c) {
        // Equals multiplying the displaced colour by alpha, with less rounding.
        const double step = alpha * (strength_ * moved[c]);
        // Channels that do not move keep their bits, even a negative zero.
        to[c] = step != 0 ? static_cast<float>(from[c] + step) : from[c];
    }
}

const Vec3& DoubleWorker::displacement(const Vec3& p) {
    if (memory_.empty()) memory_.assign(kSlots, Entry{{0, 0, 0}, {0, 0, 0}, false});
    Entry& entry = memory_[slot(p)];
    if (!entry.known || entry.colour != p) {
        Vec3 moved = recolourer_.palette_displacement(p, weights_, workspace_);
        if (picks_) moved = with_picks(recolourer_.picks_, plan_, p, moved);
        entry = {p, moved, true};
    }
    return entry.displacement;
}

}  // namespace palette4d
