// One thread's work: colour by colour in double, and many colours at a time.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

#include "model/vec3.hpp"
#include "recolour/recolour.hpp"
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

/// Precision::kDouble, colour by colour. Caches some displacements, since colours repeat in flat
/// areas and in 8-bit images. They depend on the colour alone, so the cache does not change
/// results; where a window makes picks depend on the place, it has what the palette does.
class DoubleWorker final : public RowWorker {
public:
    /// `recolourer` must outlive this and move some colour.
    DoubleWorker(const Recolourer& recolourer, const RecolourOptions& options, int channels)
        : recolourer_(recolourer),
          strength_(options.strength),
          divide_(options.premultiplied),
          channels_(channels),
          plan_(recolourer.plan().twofold.picks.plan()),
          weights_(recolourer.original().size()) {}

    void row(const float* from, float* to, int width, const Spot* spots) override {
        for (int x = 0; x < width; ++x, from += channels_, to += channels_) {
            if (channels_ == 4) to[3] = from[3];
            if (recolourable(from, divide_)) {
                recolour(from, to, spots ? spots + x : nullptr);
            } else {
                for (int c = 0; c < 3; ++c) to[c] = from[c];
            }
        }
    }
    void finish() override {}
    RecolourCounts counts() const override { return {0, 0, count_}; }

    /// Recolours one pixel that is recolourable().
    void recolour(const float* from, float* to, const Spot* spot) {
        ++count_;
        const double alpha = divide_ ? from[3] : 1.0;
        const Vec3 moved = displacement(straight_colour(from, divide_), spot);
        for (std::size_t c = 0; c < 3; ++c) {
            // Equals multiplying the displaced colour by alpha, with less rounding.
            const double step = alpha * (strength_ * moved[c]);
            // Channels that do not move keep their bits, even a negative zero.
            to[c] = step != 0 ? static_cast<float>(from[c] + step) : from[c];
        }
    }

private:
    struct Entry {
        Vec3 colour, displacement;
        bool known;
    };

    Vec3 displacement(const Vec3& p, const Spot* spot) {
        if (memory_.empty()) memory_.assign(kSlots, Entry{{0, 0, 0}, {0, 0, 0}, false});
        Entry& entry = memory_[slot(p)];
        if (!entry.known || entry.colour != p) {
            Vec3 moved = recolourer_.palette_displacement(p, weights_, workspace_);
            if (!plan_.empty() && !spot) moved = with_picks(recolourer_.picks_, plan_, p, moved);
            entry = {p, moved, true};
        }
        if (spot) return with_picks(recolourer_.picks_, plan_, p, entry.displacement, spot);
        return entry.displacement;
    }

    const Recolourer& recolourer_;
    const double strength_;
    const bool divide_;
    const int channels_;
    const PickPlan<double> plan_;
    std::vector<double> weights_;
    PaletteBody::Workspace workspace_;
    std::vector<Entry> memory_;
    long long count_ = 0;
};

namespace {

/// In place of the palette's kernels where no vertex moves.
template <class T>
void stay(const Plan<T>&, Block<T>& block, int, T, T, T*) {
    for (T(&channel)[Block<T>::kSize] : block.moved) std::fill(channel, std::end(channel), T(0));
    std::fill_n(block.verdict, Block<T>::kSize, T(1));
}

/// Precision::kSingle. Collects pixels in blocks and sorts them into inside and outside the
/// palette; one kernel for each computes the displacement. Pixels whose error a kernel cannot
/// guarantee go to the next stage: float, double, one by one. A pixel's stage depends on its colour
/// alone.
class Pipeline final : public RowWorker {
public:
    Pipeline(const Recolourer& recolourer, const RecolourOptions& options, int channels)
        : channels_(channels),
          kernels_(kernels_of<MvcKernels>(options.instructions)),
          one_by_one_(recolourer, options, channels),
          twofold_(recolourer.plan().twofold, kernels_.twofold,
                   kernels_of<PickKernels>(options.instructions).add_twofold, options, one_by_one_),
          single_(recolourer.plan().single, kernels_.single,
                  kernels_of<PickKernels>(options.instructions).add_single, options, twofold_) {}

    void row(const float* from, float* to, int width, const Spot* spots) override {
        constexpr int kSize = Block<float>::kSize;
        for (int x = 0; x < width; x += kSize) {
            const int count = std::min(kSize, width - x);
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * channels_;
            single_.run(kernels_, from + at, to + at, channels_, count,
                        spots ? spots + x : nullptr);
        }
    }

    void finish() override {
        single_.finish();
        twofold_.finish();
    }

    RecolourCounts counts() const override {
        return {single_.count(), twofold_.count(), one_by_one_.counts().one};
    }

private:
    template <class T, class Next>
    class Stage {
        using AddPicks = void (*)(const PickPlan<T>&, PickKernels::Channels<const T>,
                                  PickKernels::Channels<const T>, PickKernels::Channels<T>, int);

    public:
        Stage(const PlanOf<T>& plan, const Kernels<T>& kernels, AddPicks add_picks,
              const RecolourOptions& options, Next& next)
            : plan_(plan.palette.plan()),
              kernels_(plan_.mover_count == 0 ? Kernels<T>{&stay<T>, nullptr, kernels.move}
                                              : kernels),
              picks_(plan.picks.plan()),
              add_picks_(picks_.empty() ? nullptr : add_picks),
              strength_(static_cast<T>(options.strength)),
              divide_(options.premultiplied),
              // Half of the guaranteed tolerance; the other half is for rounding the result.
              tolerance_(static_cast<T>(
                  kSingleTolerance / 2 *
                  std::max(1 / std::abs(options.strength), static_cast<double>(plan_.spread)))),
              next_(next),
              scratch_(scratch_size(plan_) + 1) {  // never empty
            // Many colours lie exactly on the surface, where a channel is 0 or 1: they use the
            // closest point. The surface itself is rounded by about `step`. Where a step of that
            // length matters, the next stage decides.
            const T step = std::numeric_limits<T>::epsilon() * plan_.size * plan_.steepness;
            if (16 * step > tolerance_ / 4) shell_ = 16 * step / plan_.steepness;
            usable_ = plan.palette.usable() && step <= tolerance_ / 8;
        }

        /// Up to Block::kSize adjacent pixels.
        void run(const MvcKernels& kernels, const float* in, float* out, int channels, int count,
                 const Spot* spots) {
            Batch& batch = incoming_;
            placed_ = spots != nullptr;
            for (int i = 0; placed_ && i < count; ++i) batch.put(i, spots[i]);
            const bool good = kernels.read(in, channels, count, divide_, batch.block);
            if (displace(batch.block, count) && good) {
                kernels.write(batch.block, channels, count, out);
                count_ += count;
                return;
            }
            for (int i = 0; i < count; ++i, in += channels, out += channels) {
                if (channels == 4) out[3] = in[3];
                if (good || recolourable(in, divide_)) {
                    settle(batch, i, in, out);
                } else {
                    for (int c = 0; c < 3; ++c) out[c] = in[c];
                }
            }
        }

        /// Recolours one pixel that is recolourable(); `to` may be `from`.
        void recolour(const float* from, float* to, const Spot* spot) {
            Batch& batch = incoming_;
            const int at = batch.count++;
            placed_ = spot != nullptr;
            if (spot) batch.put(at, *spot);
            batch.from[at] = from;
            batch.to[at] = to;
            for (int c = 0; c < 3; ++c) batch.block.colour[c][at] = from[c];
            if (divide_) batch.divide(at, from[3]);
            if (batch.count == kSize) sort();
        }

        void finish() {
            sort();
            flush();
        }

        long long count() const { return count_; }

    private:
        static constexpr int kSize = Block<T>::kSize;
        /// Above this, differences of channels have too few digits for the amounts of picks.
        static constexpr T kLargestPicked = 8;

        struct Batch {
            Block<T> block{};
            const float* from[kSize];
            float* to[kSize];
            int count = 0;

            void put(int at, const Spot& spot) {
                block.place[0][at] = static_cast<T>(spot.x);
                block.place[1][at] = static_cast<T>(spot.y);
            }
            Spot spot(int at) const {
                return {static_cast<float>(block.place[0][at]),
                        static_cast<float>(block.place[1][at])};
            }

            void divide(int at, float by) {
                block.alpha[at] = by;
                for (int c = 0; c < 3; ++c) {
                    block.seen[c][at] = block.colour[c][at];
                    block.colour[c][at] = static_cast<T>(straight<double>(block.seen[c][at], by));
                }
            }
        };

        /// Whether all colours are inside and their results guaranteed.
        bool displace(Block<T>& block, int count) {
            if (usable_) {
                kernels_.inside(plan_, block, count, tolerance_, shell_, scratch_.data()->numbers);
                // Colours inside the palette are not larger than it.
                finish(block, count, plan_.mover_count > 0 && plan_.size <= kLargestPicked);
            } else {
                std::fill_n(block.verdict, count, T(0));
            }
            int inside = 0;
            for (int i = 0; i < count; ++i) inside += block.verdict[i] > 0;
            return inside == count;
        }

        /// Adds the picks, and applies the strength. `small`: no good colour is above
        /// kLargestPicked.
        void finish(Block<T>& block, int count, bool small) {
            if (add_picks_) {
                add_picks_(picks_, block.colour, placed_ ? block.place : nullptr, block.moved,
                           count);
                if (sizeof(T) == sizeof(float) && !small) leave_large(block, count);
            }
            kernels_.move(block, count, strength_, divide_);
        }

        /// Leaves colours that are too large for picks to the next stage.
        static void leave_large(Block<T>& block, int count) {
            const auto fits = [&](int i) {  // not NaN
                return static_cast<int>(std::abs(block.colour[0][i]) <= kLargestPicked) &
                       static_cast<int>(std::abs(block.colour[1][i]) <= kLargestPicked) &
                       static_cast<int>(std::abs(block.colour[2][i]) <= kLargestPicked);
            };
            int fitting = 0;
            for (int i = 0; i < count; ++i) fitting += fits(i);
            for (int i = 0; fitting < count && i < count; ++i) {
                if (!fits(i) && block.verdict[i] > 0) block.verdict[i] = 0;
            }
        }

        void sort() {
            Batch& batch = incoming_;
            if (batch.count == 0) return;
            displace(batch.block, batch.count);
            for (int i = 0; i < batch.count; ++i) settle(batch, i, batch.from[i], batch.to[i]);
            batch.count = 0;
        }

        /// Writes the pixel, or hands it on as its verdict says.
        void settle(const Batch& batch, int i, const float* from, float* to) {
            const T verdict = batch.block.verdict[i];
            if (verdict < 0) {
                const int at = outside_.count++;
                outside_.from[at] = from;
                outside_.to[at] = to;
                for (int c = 0; c < 3; ++c) {
                    outside_.block.colour[c][at] = batch.block.colour[c][i];
                    outside_.block.seen[c][at] = batch.block.seen[c][i];
                }
                outside_.block.alpha[at] = batch.block.alpha[i];
                if (placed_) outside_.put(at, batch.spot(i));
                if (outside_.count == kSize) flush();
            } else if (verdict > 0) {
                for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(batch.block.moved[c][i]);
                ++count_;
            } else {
                const Spot spot = placed_ ? batch.spot(i) : Spot{};
                next_.recolour(from, to, placed_ ? &spot : nullptr);
            }
        }

        void flush() {
            if (outside_.count == 0) return;
            const int count = outside_.count;
            outside_.count = 0;
            kernels_.closest(plan_, outside_.block, count, tolerance_, scratch_.data()->numbers);
            finish(outside_.block, count, false);
            for (int i = 0; i < count; ++i) {
                settle(outside_, i, outside_.from[i], outside_.to[i]);
            }
        }

        const Plan<T>& plan_;
        const Kernels<T> kernels_;
        const PickPlan<T> picks_;
        const AddPicks add_picks_;
        const T strength_;
        const bool divide_;
        const T tolerance_;
        bool usable_;
        bool placed_ = false;  ///< the batches have places; the same for all pixels of a worker
        T shell_ = 0;
        Next& next_;
        std::vector<ScratchPart<T>> scratch_;
        Batch incoming_, outside_;
        long long count_ = 0;
    };

    const int channels_;
    const MvcKernels& kernels_;
    DoubleWorker one_by_one_;
    Stage<double, DoubleWorker> twofold_;
    Stage<float, Stage<double, DoubleWorker>> single_;
};

}  // namespace

std::unique_ptr<RowWorker> Recolourer::worker(const RecolourOptions& options, int channels) const {
    if (options.precision == Precision::kDouble) {
        return std::make_unique<DoubleWorker>(*this, options, channels);
    }
    return std::make_unique<Pipeline>(*this, options, channels);
}

}  // namespace palette4d
