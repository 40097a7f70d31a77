#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "lattice/converted_recolour.hpp"
#include "model/vec3.hpp"
#include "recolour/image_rows.hpp"

namespace palette4d {
namespace {

/// Pixels that are converted before they are recoloured together.
constexpr std::size_t kPiece = 16384;

const Recolourer& edit_of(const Recolourer& recolourer) { return recolourer; }
const Recolourer& edit_of(const Lattice& lattice) { return lattice.recolourer(); }

/// A thread's work: pixels are gathered, recoloured as a row of their own by a Recolourer or a
/// Lattice, and written.
template <class Way, class Counts>
class Piece {
public:
    Piece(const Way& way, const ColourConversion& conversion, const RecolourOptions& options)
        : way_(way), conversion_(conversion), options_(options) {
        options_.threads = 1;
        options_.premultiplied = false;
        pixels_.reserve(kPiece);
        before_.reserve(3 * kPiece);
    }

    void row(const float* in, float* out, int width, int channels, bool divide) {
        for (int x = 0; x < width; ++x, in += channels, out += channels) {
            const double alpha = divide ? in[3] : 1.0;
            const Vec3 seen{in[0] / alpha, in[1] / alpha, in[2] / alpha};
            const Vec3 exact = alpha != 0 && std::isfinite(alpha) && finite(seen)
                                   ? conversion_.to_palette(seen)
                                   : kNowhere;
            float rounded[3];
            for (std::size_t c = 0; c < 3; ++c) rounded[c] = static_cast<float>(exact[c]);
            for (int c = 0; c < channels; ++c) out[c] = in[c];
            if (!std::isfinite(rounded[0] + rounded[1] + rounded[2])) continue;
            pixels_.push_back({exact, alpha, out});
            before_.insert(before_.end(), rounded, rounded + 3);
            if (pixels_.size() == kPiece) finish();
        }
    }

    void finish() {
        if (pixels_.empty()) return;
        after_.resize(before_.size());
        const int count = static_cast<int>(pixels_.size());
        const auto bytes = static_cast<std::ptrdiff_t>(before_.size() * sizeof(float));
        counts_ += way_.apply({before_.data(), count, 1, 3, bytes},
                              {after_.data(), count, 1, 3, bytes}, options_);
        for (std::size_t i = 0; i < pixels_.size(); ++i) {
            Vec3 at = pixels_[i].exact;
            bool moved = false;
            for (std::size_t c = 0; c < 3; ++c) {
                // What the edit adds goes onto the number that was not rounded.
                const double step = static_cast<double>(after_[3 * i + c]) - before_[3 * i + c];
                at[c] += step;
                moved |= step != 0;
            }
            if (moved) write(conversion_.to_clip(at), pixels_[i]);
        }
        pixels_.clear();
        before_.clear();
    }

    const Counts& counts() const { return counts_; }

private:
    struct Pixel {
        Vec3 exact;
        double alpha;
        float* out;
    };
    static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    static constexpr Vec3 kNowhere{kNan, kNan, kNan};
    static constexpr double kLargest = std::numeric_limits<float>::max();

    static void write(const Vec3& colour, const Pixel& pixel) {
        if (!finite(colour)) return;
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = std::clamp(pixel.alpha * colour[c], -kLargest, kLargest);
            pixel.out[c] = static_cast<float>(value);
        }
    }

    const Way& way_;
    const ColourConversion& conversion_;
    RecolourOptions options_;
    std::vector<Pixel> pixels_;
    std::vector<float> before_, after_;
    Counts counts_;
};

template <class Counts, class Way>
Counts apply_between(const Way& way, const ColourConversion* conversion, const ConstImageView& in,
                     const ImageView& out, const RecolourOptions& options) {
    if (!conversion || conversion->identity()) return way.apply(in, out, options);
    check_recolouring(in, out, options);
    if (in.width == 0 || in.height == 0) return {};
    if (edit_of(way).identity() || options.strength == 0) {
        copy_rows(in, out);
        return {};
    }
    const bool divide = options.premultiplied && in.channels == 4;
    Counts counts;
    std::mutex guard;
    share_rows(in.height, options.threads, [&](const NextRow& next) {
        Piece<Way, Counts> piece(way, *conversion, options);
        for (int y = next(); y >= 0; y = next()) {
            piece.row(row_of(in, y), row_of(out, y), in.width, in.channels, divide);
        }
        piece.finish();
        const std::lock_guard<std::mutex> lock(guard);
        counts += piece.counts();
    });
    return counts;
}

}  // namespace

RecolourCounts apply_converted(const Recolourer& recolourer, const ColourConversion* conversion,
                               const ConstImageView& in, const ImageView& out,
                               const RecolourOptions& options) {
    return apply_between<RecolourCounts>(recolourer, conversion, in, out, options);
}

LatticeCounts apply_converted(const Lattice& lattice, const ColourConversion* conversion,
                              const ConstImageView& in, const ImageView& out,
                              const RecolourOptions& options) {
    return apply_between<LatticeCounts>(lattice, conversion, in, out, options);
}

}  // namespace palette4d
