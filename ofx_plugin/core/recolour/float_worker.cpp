#include "recolour/float_worker.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "recolour/double_worker.hpp"
#include "recolour/recolour_plan.hpp"
#include "simd/kernel_choice.hpp"
#include "simd/split.hpp"

namespace palette4d {

namespace {

/// In place of the palette's kernels where no vertex moves.
template <class T>
void all_inside(const Plan<T>&, Block<T>& block, int count, T, T, T*) {
    std::fill_n(block.verdict, count, T(1));
}
template <class T>
void stay(const Plan<T>&, Block<T>& block, int, T, T*) {
    for (T(&channel)[Block<T>::kSize] : block.moved) std::fill(channel, std::end(channel), T(0));
    // All are known, whatever the block held before.
    std::fill_n(block.verdict, Block<T>::kSize, T(1));
}

/// Collects pixels in blocks and sorts them into inside and outside the palette; one kernel for
/// each computes the displacement. Pixels whose error a kernel cannot guarantee go to the next
/// stage: float, double, one by one. A pixel's stage depends on its colour alone.
class Pipeline final : public FloatWorker {
public:
    Pipeline(const Recolourer& recolourer, const RecolourOptions& options, int channels, bool picks)
        : divide_(options.premultiplied),
          channels_(channels),
          one_by_one_(recolourer, options, channels, picks),
          twofold_(recolourer.plan().twofold, kernels_of<MvcKernels>(options.instructions).twofold,
                   picks ? kernels_of<PickKernels>(options.instructions).add_twofold : nullptr,
                   options, one_by_one_),
          single_(recolourer.plan().single, kernels_of<MvcKernels>(options.instructions).single,
                  picks ? kernels_of<PickKernels>(options.instructions).add_single : nullptr,
                  options, twofold_) {}

    void row(const float* from, float* to, int width) override {
        constexpr int kSize = Block<float>::kSize;
        for (int x = 0; x < width; x += kSize) {
            const int count = std::min(kSize, width - x);
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * channels_;
            if (channels_ == 3) {
                single_.run<3>(from + at, to + at, count);
            } else {
                single_.run<4>(from + at, to + at, count);
            }
        }
    }

    void pixel(const float* from, float* to) override {
        if (channels_ == 4) to[3] = from[3];
        if (recolourable(from, divide_)) {
            single_.recolour(from, to);
        } else {
            for (int c = 0; c < 3; ++c) to[c] = from[c];
        }
    }

    void finish() override {
        single_.finish();
        twofold_.finish();
    }

    RecolourCounts counts() const override {
        return {0, single_.count(), twofold_.count(), one_by_one_.counts().one};
    }

private:
    template <class T, class Next>
    class Stage {
        using AddPicks = void (*)(const PickPlan<T>&, PickKernels::Channels<const T>,
                                  PickKernels::Channels<T>, int);

    public:
        /// Without `add_picks` there are none.
        Stage(const PlanOf<T>& plan, const Kernels<T>& kernels, AddPicks add_picks,
              const RecolourOptions& options, Next& next)
            : plan_(plan.palette.plan()),
              usable_(plan.palette.usable()),
              kernels_(usable_ && plan_.mover_count == 0
                           ? Kernels<T>{&all_inside<T>, &stay<T>, &stay<T>, kernels.move}
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
              scratch_(plan_) {
            if (!usable_) return;
            // Many colours lie exactly on the surface, where a channel is 0 or 1: they use the
            // closest point. The surface itself is rounded by about `step`. Where a step of that
            // length matters, the next stage decides.
            const T step = 16 * std::numeric_limits<T>::epsilon() * plan_.extent;
            if (step * plan_.steepness > tolerance_ / 4) {
                shell_ = step;
                at_surface_ = 0;
            }
        }

        /// Up to Block::kSize adjacent pixels.
        template <int Channels>
        void run(const float* in, float* out, int count) {
            Batch& batch = incoming_;
            bool good[kSize];
            bool all_good = true;
            for (int i = 0; i < count; ++i) {
                const float* pixel = in + i * Channels;
                for (int c = 0; c < 3; ++c) batch.block.high[c][i] = pixel[c];
                good[i] = recolourable(pixel, Channels == 4 && divide_);
                all_good &= good[i];
            }
            if (Channels == 4 && divide_) {
                for (int i = 0; i < count; ++i) {
                    if (good[i]) batch.divide(i, in[i * 4 + 3]);
                }
            }
            if (usable_) {
                kernels_.classify(plan_, batch.block, count, shell_, at_surface_, scratch_.data());
            } else {
                for (int i = 0; i < count; ++i) batch.block.verdict[i] = 0;
            }
            const Kernel kernel = all_good ? same_kernel(batch.block, count) : nullptr;
            if (kernel) {
                displace(kernel, batch.block, count);
            }
            for (int i = 0; i < count; ++i) {
                const float* from = in + i * Channels;
                float* to = out + i * Channels;
                if (Channels == 4) to[3] = from[3];
                if (!good[i]) {
                    for (int c = 0; c < 3; ++c) to[c] = from[c];
                } else if (!kernel) {
                    add(batch, i, from, to);
                } else if (batch.block.verdict[i] > 0) {
                    for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(batch.block.moved[c][i]);
                    ++count_;
                } else {
                    next_.recolour(from, to);
                }
            }
        }

        /// Recolours one pixel that is recolourable(); `to` may be `from`.
        void recolour(const float* from, float* to) {
            if (!usable_) {
                next_.recolour(from, to);
                return;
            }
            Batch& batch = incoming_;
            const int at = batch.count++;
            batch.from[at] = from;
            batch.to[at] = to;
            for (int c = 0; c < 3; ++c) batch.block.high[c][at] = from[c];
            if (divide_) batch.divide(at, from[3]);
            if (batch.count == kSize) sort();
        }

        void finish() {
            sort();
            flush(sorted_[0], kernels_.mean_value);
            flush(sorted_[1], kernels_.closest);
        }

        long long count() const { return count_; }

    private:
        static constexpr int kSize = Block<T>::kSize;
        /// Above this, differences of channels have too few digits for the amounts of picks.
        static constexpr T kLargestPicked = 8;
        using Kernel = void (*)(const Plan<T>&, Block<T>&, int, T, T*);

        struct Batch {
            Block<T> block{};
            const float* from[kSize];
            float* to[kSize];
            int count = 0;

            void divide(int at, float by) {
                block.alpha[at] = by;
                for (int c = 0; c < 3; ++c) {
                    block.seen[c][at] = block.high[c][at];
                    const double colour = straight<double>(block.seen[c][at], by);
                    split(colour, block.high[c][at], block.low[c][at]);
                }
            }
        };

        void displace(Kernel kernel, Block<T>& block, int count) {
            kernel(plan_, block, count, tolerance_, scratch_.data());
            if (add_picks_) {
                add_picks_(picks_, block.high, block.moved, count);
                for (int i = 0; sizeof(T) == sizeof(float) && i < count; ++i) {
                    const T size =
                        std::max(std::abs(block.high[0][i]),
                                 std::max(std::abs(block.high[1][i]), std::abs(block.high[2][i])));
                    if (!(size <= kLargestPicked)) block.verdict[i] = 0;
                }
            }
            kernels_.move(block, count, strength_, divide_);
        }

        /// The kernel for the whole block when its verdicts agree, else null.
        Kernel same_kernel(const Block<T>& block, int count) const {
            int inside = 0, outside = 0;
            for (int i = 0; i < count; ++i) {
                inside += block.verdict[i] > 0;
                outside += block.verdict[i] < 0;
            }
            return inside == count    ? kernels_.mean_value
                   : outside == count ? kernels_.closest
                                      : nullptr;
        }

        void sort() {
            Batch& batch = incoming_;
            if (batch.count == 0) return;
            kernels_.classify(plan_, batch.block, batch.count, shell_, at_surface_,
                              scratch_.data());
            if (const Kernel kernel = same_kernel(batch.block, batch.count)) {
                flush(batch, kernel);
                return;
            }
            for (int i = 0; i < batch.count; ++i) add(batch, i, batch.from[i], batch.to[i]);
            batch.count = 0;
        }

        /// Adds the pixel to the batch that its verdict selects.
        void add(const Batch& batch, int i, const float* from, float* to) {
            const T verdict = batch.block.verdict[i];
            if (verdict == 0) {
                next_.recolour(from, to);
                return;
            }
            Batch& other = sorted_[verdict < 0];  // no branch: it would be mispredicted
            const int at = other.count++;
            other.from[at] = from;
            other.to[at] = to;
            for (int c = 0; c < 3; ++c) other.block.high[c][at] = batch.block.high[c][i];
            if (divide_) {
                other.block.alpha[at] = batch.block.alpha[i];
                for (int c = 0; c < 3; ++c) {
                    other.block.low[c][at] = batch.block.low[c][i];
                    other.block.seen[c][at] = batch.block.seen[c][i];
                }
            }
            if (other.count == kSize) {
                flush(other, verdict < 0 ? kernels_.closest : kernels_.mean_value);
            }
        }

        void flush(Batch& batch, Kernel kernel) {
            if (batch.count == 0) return;
            displace(kernel, batch.block, batch.count);
            for (int i = 0; i < batch.count; ++i) {
                float* to = batch.to[i];
                if (batch.block.verdict[i] > 0) {
                    for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(batch.block.moved[c][i]);
                    ++count_;
                } else {
                    next_.recolour(batch.from[i], to);
                }
            }
            batch.count = 0;
        }

        const Plan<T>& plan_;
        const bool usable_;
        const Kernels<T> kernels_;
        const PickPlan<T> picks_;
        const AddPicks add_picks_;
        const T strength_;
        const bool divide_;
        const T tolerance_;
        T shell_ = 0;
        T at_surface_ = -1;
        Next& next_;
        Scratch<T> scratch_;
        Batch incoming_, sorted_[2];  ///< inside, outside
        long long count_ = 0;
    };

    const bool divide_;
    const int channels_;
    DoubleWorker one_by_one_;
    Stage<double, DoubleWorker> twofold_;
    Stage<float, Stage<double, DoubleWorker>> single_;
};

}  // namespace

std::unique_ptr<FloatWorker> float_worker(const Recolourer& recolourer,
                                          const RecolourOptions& options, int channels,
                                          bool picks) {
    return std::make_unique<Pipeline>(recolourer, options, channels, picks);
}

}  // namespace palette4d
