#include "palette4d/recolour.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "vec3.hpp"

namespace palette4d {
namespace {

const float* row_of(const ConstImageView& view, int y) {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(view.data) +
                                          view.row_bytes * y);
}
float* row_of(const ImageView& view, int y) {
    return reinterpret_cast<float*>(reinterpret_cast<char*>(view.data) + view.row_bytes * y);
}

template <class View>
void check_view(const View& view, const char* name) {
    const std::string what = std::string("recolour: the ") + name + " image ";
    if (view.channels != 3 && view.channels != 4) {
        throw std::invalid_argument(what + "has " + std::to_string(view.channels) +
                                    " channels; expected 3 or 4");
    }
    if (view.width < 0 || view.height < 0) {
        throw std::invalid_argument(what + "is " + std::to_string(view.width) + " by " +
                                    std::to_string(view.height) + "; expected no negative size");
    }
    if (view.width == 0 || view.height == 0) return;
    if (view.data == nullptr) throw std::invalid_argument(what + "has no data");
    const auto row = static_cast<std::ptrdiff_t>(sizeof(float)) * view.width * view.channels;
    if (view.height > 1 && std::abs(view.row_bytes) < row) {
        throw std::invalid_argument(what + "has rows " + std::to_string(view.row_bytes) +
                                    " bytes apart; expected at least " + std::to_string(row));
    }
}

}  // namespace

Recolourer::Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
                       std::vector<Face> faces)
    : body_(std::move(original), std::move(faces)) {
    const std::vector<Vec3>& colours = body_.rgb();
    if (edited.size() != colours.size()) {
        throw std::invalid_argument("recolour: " + std::to_string(edited.size()) +
                                    " edited colours; expected as many as original ones, " +
                                    std::to_string(colours.size()));
    }
    for (std::size_t i = 0; i < colours.size(); ++i) {
        if (!finite(edited[i])) {
            throw std::invalid_argument("recolour: edited colour " + std::to_string(i) +
                                        " is not finite");
        }
        displacement_.push_back(edited[i] - colours[i]);
        if (std::memcmp(&edited[i], &colours[i], sizeof(Vec3)) != 0) identity_ = false;
        if (displacement_[i] != Vec3{0, 0, 0}) displaced_.push_back(static_cast<int>(i));
    }
}

/// Colours repeat, in flat areas next to each other and in 8-bit pictures all over: a worker
/// remembers some that it has met. The displacement depends on the colour alone, so that what is
/// remembered never shows in the result.
class Recolourer::Worker {
public:
    explicit Worker(const Recolourer& recolourer)
        : recolourer_(recolourer),
          weights_(recolourer.body_.rgb().size()),
          memory_(kSlots, Entry{{0, 0, 0}, {0, 0, 0}, false}) {}

    /// Without the strength. `p` must be finite.
    Vec3 displacement(const Vec3& p) {
        Entry& entry = memory_[slot(p)];
        if (!entry.known || entry.colour != p) {
            entry = {p, recolourer_.displacement_at(p, weights_, workspace_), true};
        }
        return entry.displacement;
    }

    void row(const float* in, float* out, int width, int channels, const RecolourOptions& options) {
        const bool divide = options.premultiplied && channels == 4;
        for (int x = 0; x < width; ++x, in += channels, out += channels) {
            float pixel[4];
            const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(channels);
            std::memcpy(pixel, in, bytes);
            recolour(pixel, divide, options.strength);
            std::memcpy(out, pixel, bytes);
        }
    }

private:
    struct Entry {
        Vec3 colour, displacement;
        bool known;
    };
    static constexpr std::size_t kSlots = 2048;

    static std::size_t slot(const Vec3& p) {
        std::uint64_t hash = 0;
        for (const double value : p) {
            std::uint64_t bits;
            std::memcpy(&bits, &value, sizeof bits);
            hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
            hash ^= hash >> 29;
        }
        return static_cast<std::size_t>((hash * 0x9E3779B97F4A7C15u) >> 53);
    }

    /// Channels that do not move keep their bits, a negative zero included.
    void recolour(float* pixel, bool divide, double strength) {
        const Vec3 seen{pixel[0], pixel[1], pixel[2]};
        if (!finite(seen)) return;
        double alpha = 1;
        if (divide) {
            alpha = pixel[3];
            if (alpha == 0 || !std::isfinite(alpha)) return;
        }
        const Vec3 moved =
            displacement(divide ? Vec3{seen[0] / alpha, seen[1] / alpha, seen[2] / alpha} : seen);
        for (std::size_t c = 0; c < 3; ++c) {
            // Multiplying the displaced colour by alpha again is the same as this, less rounding.
            const double step = alpha * (strength * moved[c]);
            if (step != 0) pixel[c] = static_cast<float>(seen[c] + step);
        }
    }

    const Recolourer& recolourer_;
    std::vector<double> weights_;
    PaletteBody::Workspace workspace_;
    std::vector<Entry> memory_;
};

Vec3 Recolourer::displacement_at(const Vec3& p, std::vector<double>& weights,
                                 PaletteBody::Workspace& workspace) const {
    body_.project(p, weights.data(), workspace);
    Vec3 sum{};
    for (const int i : displaced_) sum = sum + weights[i] * displacement_[i];
    return sum;
}

Vec3 Recolourer::displaced(const Vec3& p, double strength) const {
    if (identity_ || strength == 0 || !finite(p)) return p;
    std::vector<double> weights(body_.rgb().size());
    PaletteBody::Workspace workspace;
    const Vec3 moved = displacement_at(p, weights, workspace);
    Vec3 result = p;
    for (std::size_t c = 0; c < 3; ++c) {
        const double step = strength * moved[c];
        if (step != 0) result[c] += step;
    }
    return result;
}

void Recolourer::apply(const ConstImageView& in, const ImageView& out,
                       const RecolourOptions& options) const {
    check_view(in, "input");
    check_view(out, "output");
    if (in.width != out.width || in.height != out.height || in.channels != out.channels) {
        const auto size = [](const auto& view) {
            return std::to_string(view.width) + " by " + std::to_string(view.height) + " with " +
                   std::to_string(view.channels) + " channels";
        };
        throw std::invalid_argument("recolour: the output image is " + size(out) +
                                    "; expected that of the input image, " + size(in));
    }
    if (!std::isfinite(options.strength)) {
        throw std::invalid_argument("recolour: the strength is not finite");
    }
    if (options.threads < 0) {
        throw std::invalid_argument("recolour: " + std::to_string(options.threads) +
                                    " threads; expected 0 (one per processor) or more");
    }
    if (in.width == 0 || in.height == 0) return;

    if (identity_ || displaced_.empty() || options.strength == 0) {
        const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(in.width) *
                                  static_cast<std::size_t>(in.channels);
        for (int y = 0; y < in.height; ++y) {
            if (row_of(in, y) != row_of(out, y)) std::memmove(row_of(out, y), row_of(in, y), bytes);
        }
        return;
    }

    int threads = options.threads;
    if (threads == 0) threads = static_cast<int>(std::thread::hardware_concurrency());
    threads = std::clamp(threads, 1, in.height);

    std::atomic<int> next{0};
    std::exception_ptr problem;
    std::mutex guard;
    const auto work = [&] {
        try {
            Worker worker(*this);
            for (int y = next++; y < in.height; y = next++) {
                worker.row(row_of(in, y), row_of(out, y), in.width, in.channels, options);
            }
        } catch (...) {
            const std::lock_guard<std::mutex> lock(guard);
            if (!problem) problem = std::current_exception();
            next = in.height;
        }
    };
    std::vector<std::thread> helpers;
    helpers.reserve(static_cast<std::size_t>(threads - 1));
    try {
        for (int i = 1; i < threads; ++i) helpers.emplace_back(work);
    } catch (const std::system_error&) {
        // No more threads to be had: those that run share the rows.
    }
    work();
    for (std::thread& helper : helpers) helper.join();
    if (problem) std::rethrow_exception(problem);
}

}  // namespace palette4d
