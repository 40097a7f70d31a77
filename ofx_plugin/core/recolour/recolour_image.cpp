#include "recolour/recolour_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/alpha.hpp"
#include "model/vec3.hpp"
#include "recolour/recolour.hpp"
#include "threads/share_rows.hpp"

namespace palette4d {
namespace {

/// Rows whose code values differ from the palette's: pixels are collected, converted, and
/// recoloured as one row.
class ConvertedRows : public RowWorker {
public:
    ConvertedRows(const Recolourer& recolourer, const RecolourOptions& options, int channels)
        : conversion_(*options.conversion),
          premultiplied_(options.premultiplied),
          channels_(channels) {
        RecolourOptions straight = options;
        straight.premultiplied = false;
        worker_ = recolourer.worker(straight, 3);
        pixels_.reserve(kPiece);
        before_.reserve(3 * kPiece);
    }

    void row(const float* from, float* to, int width, const Spot* spots) override {
        for (int x = 0; x < width; ++x, from += channels_, to += channels_) {
            const bool good = recolourable(from, premultiplied_);
            const double alpha = premultiplied_ ? from[3] : 1.0;
            const Vec3 seen = straight_colour(from, premultiplied_);
            if (to != from) std::copy_n(from, channels_, to);
            if (!good) continue;
            const Vec3 exact = conversion_.to_palette(seen);
            float rounded[3];
            for (std::size_t c = 0; c < 3; ++c) rounded[c] = static_cast<float>(exact[c]);
            if (!std::isfinite(rounded[0] + rounded[1] + rounded[2])) continue;
            pixels_.push_back({exact, alpha, to});
            if (spots) spots_.push_back(spots[x]);
            before_.insert(before_.end(), rounded, rounded + 3);
            if (pixels_.size() == kPiece) finish();
        }
    }

    void finish() override {
        if (pixels_.empty()) return;
        after_.resize(before_.size());
        worker_->row(before_.data(), after_.data(), static_cast<int>(pixels_.size()),
                     spots_.empty() ? nullptr : spots_.data());
        worker_->finish();
        for (std::size_t i = 0; i < pixels_.size(); ++i) {
            Vec3 at = pixels_[i].exact;
            bool moved = false;
            for (std::size_t c = 0; c < 3; ++c) {
                // Adds the edit's step to the unrounded value, so that there is no jump where an
                // edit begins.
                const double step = static_cast<double>(after_[3 * i + c]) - before_[3 * i + c];
                at[c] += step;
                moved |= step != 0;
            }
            if (moved) write(conversion_.to_clip(at), pixels_[i]);
        }
        pixels_.clear();
        before_.clear();
        spots_.clear();
    }

    RecolourCounts counts() const override { return worker_->counts(); }

private:
    struct Pixel {
        Vec3 exact;
        double alpha;
        float* out;
    };
    /// Pixels converted and recoloured at a time.
    static constexpr std::size_t kPiece = 16384;
    static constexpr double kLargest = std::numeric_limits<float>::max();

    static void write(const Vec3& colour, const Pixel& pixel) {
        if (!finite(colour)) return;
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = std::clamp(pixel.alpha * colour[c], -kLargest, kLargest);
            pixel.out[c] = static_cast<float>(value);
        }
    }

    const ColourConversion& conversion_;
    const bool premultiplied_;
    const int channels_;
    std::unique_ptr<RowWorker> worker_;
    std::vector<Pixel> pixels_;
    std::vector<float> before_, after_;
    std::vector<Spot> spots_;
};

}  // namespace

void copy_rows(const ConstImageView& in, const ImageView& out) {
    const std::size_t bytes =
        sizeof(float) * static_cast<std::size_t>(in.width) * static_cast<std::size_t>(in.channels);
    for (int y = 0; y < in.height; ++y) {
        if (out.row(y) != in.row(y)) std::memmove(out.row(y), in.row(y), bytes);
    }
}

Vec3 straight_colour(const float* pixel, bool premultiplied) {
    const double alpha = premultiplied ? pixel[3] : 1.0;
    return {straight<double>(pixel[0], alpha), straight<double>(pixel[1], alpha),
            straight<double>(pixel[2], alpha)};
}

RecolourCounts Recolourer::apply(const ConstImageView& in, const ImageView& out,
                                 const RecolourOptions& given) const {
    RecolourOptions options = given;
    options.premultiplied = options.premultiplied && in.channels == 4;
    if (!std::isfinite(options.strength)) {
        throw std::invalid_argument("recolour: the strength is not finite");
    }
    if (options.threads < 0) {
        throw std::invalid_argument("recolour: " + std::to_string(options.threads) +
                                    " threads; expected 0 (one per processor) or more");
    }
    resolved(options.instructions);
    if (in.width == 0 || in.height == 0) return {};
    if (!moves() || options.strength == 0) {
        copy_rows(in, out);
        return {};
    }
    const bool converts = options.conversion && !options.conversion->identity();
    RecolourCounts counts;
    std::mutex guard;
    share_rows(in.height, options.threads, [&](const NextRow& next) {
        const std::unique_ptr<RowWorker> rows =
            converts ? std::make_unique<ConvertedRows>(*this, options, in.channels)
                     : worker(options, in.channels);
        std::vector<Spot> spots(
            options.place && picks().windows() ? static_cast<std::size_t>(in.width) : 0);
        for (int y = next(); y >= 0; y = next()) {
            for (std::size_t x = 0; x < spots.size(); ++x) {
                spots[x] = options.place->at(static_cast<int>(x), y);
            }
            rows->row(in.row(y), out.row(y), in.width, spots.empty() ? nullptr : spots.data());
        }
        rows->finish();
        const std::lock_guard<std::mutex> lock(guard);
        counts += rows->counts();
    });
    return counts;
}

}  // namespace palette4d
