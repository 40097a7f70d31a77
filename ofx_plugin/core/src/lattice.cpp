#include "palette4d/lattice.hpp"

#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "image_rows.hpp"
#include "kernel_choice.hpp"
#include "lattice_store.hpp"

namespace palette4d {

/// Pixels in cells that nobody has made yet wait until there are enough of them for the cells to be
/// made many at a time; pixels in parts that are not good enough go on to the exact worker.
class Lattice::Worker {
public:
    Worker(const Recolourer& recolourer, Store& store, const RecolourOptions& options, int channels)
        : store_(store),
          kernels_(kernels_of(options.instructions).lattice),
          strength_(static_cast<float>(options.strength)),
          premultiplied_(options.premultiplied),
          channels_(channels),
          exact_(recolourer, options),
          builder_(store, options.instructions) {
        waiting_.reserve(kWaiting);
    }

    void row(const float* in, float* out, int width) {
        for (int x = 0; x < width; x += kSize) {
            const int count = std::min(kSize, width - x);
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * channels_;
            const float* from = in + at;
            float* to = out + at;
            if (x + (kAhead + 1) * kSize <= width) {
                fetch<0>(from + kAhead * kSize * channels_);
                fetch<1>(to + kAhead * kSize * channels_);
            }
            block(
                from, to, count,
                [&](int i) { exact_.pixel(from + i * channels_, to + i * channels_, channels_); },
                [&](int i) { waiting_.push_back({from + i * channels_, to + i * channels_}); });
            if (waiting_.size() > kWaiting - kSize) do_waiting();
        }
    }

    /// All of it is written when this returns.
    void finish() {
        do_waiting();
        check_samples();
        exact_.finish();
    }

    LatticeCounts counts() const {
        const RecolourCounts exact = exact_.counts();
        return {interpolated_, exact.single + exact.twofold + exact.one};
    }

private:
    static constexpr int kSize = LatticeBlock::kSize;
    static constexpr std::size_t kWaiting = 4096;
    static constexpr int kSampleEvery = 7;  ///< blocks; a pixel of one is also evaluated exactly

    /// Blocks that are asked of memory early: work on one takes as long as that.
    static constexpr int kAhead = 2;

    struct Pixel {
        const float* from;
        float* to;
    };

    template <int Write>
    void fetch(const float* block) const {
#if defined(__GNUC__)
        constexpr int kLine = 64 / sizeof(float);
        for (int i = 0; i < kSize * channels_; i += kLine) __builtin_prefetch(block + i, Write);
#endif
    }

    /// `exact(i)` and `wait(i)` take those of the pixels that this leaves as they are.
    template <class Exact, class Wait>
    void block(const float* from, float* to, int count, const Exact& exact, const Wait& wait) {
        LatticeBlock& b = block_;
        const bool all_good = find(from, count, kLatticeCuts);
        kernels_.weigh(b, count);
        if (++blocks_ % kSampleEvery == 0) sample(static_cast<int>(blocks_ % count));
        kernels_.blend(store_.nodes(), b, count, from, to, channels_, strength_, premultiplied_);
        interpolated_ += count;
        if (all_good) return;
        for (int i = 0; i < count; ++i) {
            if (b.state[i] == Store::kGood) continue;
            --interpolated_;
            if (b.state[i] == Store::kExact) {
                exact(i);
            } else {
                wait(i);
            }
        }
    }

    /// The pixels' cells or, after at most so many cuts, parts, and what they are, in block_: are
    /// all of them good?
    bool find(const float* from, int count, int most_cuts) {
        LatticeBlock& b = block_;
        kernels_.locate(store_.domain(), b, from, channels_, count, premultiplied_);
        for (int cuts = 0;; ++cuts) {
            std::int32_t others = 0;
            for (int i = 0; i < count; ++i) {
                const std::int32_t state =
                    store_.state(b.number[i]).load(std::memory_order_acquire);
                b.state[i] = state;
                others |= state ^ Store::kGood;
            }
            if (others < Store::kBrick || cuts == most_cuts) return others == 0;
            kernels_.descend(b, count);
        }
    }

    void copy(const float* from, float* to) const {
        for (int c = 0; c < 3; ++c) to[c] = from[c];
        if (channels_ == 4) to[3] = from[3];
    }

    /// Block after block of the waiting pixels, next to each other.
    template <class Do>
    void each_waiting_block(const Do& work) {
        for (std::size_t at = 0; at < waiting_.size(); at += kSize) {
            const int count = static_cast<int>(std::min<std::size_t>(kSize, waiting_.size() - at));
            for (int i = 0; i < count; ++i) {
                copy(waiting_[at + i].from, gathered_ + i * channels_);
            }
            work(&waiting_[at], count);
        }
    }

    void do_waiting() {
        if (waiting_.empty()) return;
        for (int cuts = 0; cuts <= kLatticeCuts; ++cuts) {
            each_waiting_block([&](const Pixel*, int count) { claim(count, cuts); });
            builder_.run();
            each_waiting_block([&](const Pixel*, int count) { settle(count, cuts); });
        }
        each_waiting_block([&](const Pixel* pixels, int count) {
            bool done[kSize];
            std::fill_n(done, count, true);
            block(
                gathered_, results_, count,
                [&](int i) {
                    done[i] = false;
                    exact_.pixel(pixels[i].from, pixels[i].to, channels_);
                },
                [&](int) { throw std::logic_error("lattice: a cell was not made"); });
            for (int i = 0; i < count; ++i) {
                if (done[i]) copy(results_ + i * channels_, pixels[i].to);
            }
        });
        waiting_.clear();
    }

    /// To be made by this thread: what nobody has, after so many cuts.
    void claim(int count, int cuts) {
        find(gathered_, count, cuts);
        for (int i = 0; i < count; ++i) {
            std::int32_t unknown = Store::kUnknown;
            if (block_.state[i] == unknown &&
                store_.state(block_.number[i]).compare_exchange_strong(unknown, Store::kClaimed)) {
                builder_.add(block_.number[i]);
            }
        }
    }

    /// Waits for what other threads make.
    void settle(int count, int cuts) {
        find(gathered_, count, cuts);
        for (int i = 0; i < count; ++i) {
            while (store_.state(block_.number[i]).load(std::memory_order_acquire) ==
                   Store::kClaimed) {
                std::this_thread::yield();
            }
        }
    }

    void sample(int i) {
        if (block_.state[i] != Store::kGood) return;
        for (int c = 0; c < 3; ++c) {
            float moved = 0;
            for (int k = 0; k < 4; ++k) {
                moved += block_.weight[k][i] * store_.nodes()[block_.corner[k][i] / 4 + c];
            }
            sampled_.push_back(block_.colour[c][i]);
            sampled_moves_.push_back(moved);
        }
        if (sampled_.size() >= 3 * 1024) check_samples();
    }

    void check_samples() {
        const std::vector<float>& exact = builder_.displacements(sampled_);
        double largest = 0;
        for (std::size_t i = 0; i < sampled_.size(); ++i) {
            largest = std::max(largest, lattice_error(static_cast<double>(sampled_[i]),
                                                      static_cast<double>(exact[i]),
                                                      static_cast<double>(sampled_moves_[i]) -
                                                          static_cast<double>(exact[i])));
        }
        store_.saw_error(largest);
        sampled_.clear();
        sampled_moves_.clear();
    }

    Store& store_;
    const LatticeKernels kernels_;
    const float strength_;
    const bool premultiplied_;
    const int channels_;
    ExactWorker exact_;
    Store::Builder builder_;
    LatticeBlock block_{};
    alignas(64) float gathered_[4 * kSize] = {}, results_[4 * kSize] = {};
    std::vector<Pixel> waiting_;
    std::vector<float> sampled_, sampled_moves_;
    long long interpolated_ = 0, blocks_ = 0;
};

Lattice::Lattice(std::shared_ptr<const Recolourer> recolourer)
    : recolourer_(std::move(recolourer)) {
    if (!recolourer_) throw std::invalid_argument("lattice: no recolourer");
    if (recolourer_->moves()) store_ = std::make_unique<Store>(*recolourer_);
}

Lattice::~Lattice() = default;

double Lattice::largest_error() const { return store_ ? store_->largest_error() : 0.0; }

Lattice::Size Lattice::size() const { return store_ ? store_->size() : Size{}; }

LatticeCounts Lattice::apply(const ConstImageView& in, const ImageView& out,
                             const RecolourOptions& given) const {
    RecolourOptions options = given;
    options.premultiplied = options.premultiplied && in.channels == 4;
    check_recolouring(in, out, options);
    if (!store_ || options.precision == Precision::kDouble || options.strength <= 0 ||
        options.strength > 1 || in.width == 0 || in.height == 0) {
        const RecolourCounts counts = recolourer_->apply(in, out, options);
        return {0, counts.single + counts.twofold + counts.one};
    }
    LatticeCounts counts;
    std::mutex guard;
    share_rows(in.height, options.threads, [&](const NextRow& next) {
        const auto worker = std::make_unique<Worker>(*recolourer_, *store_, options, in.channels);
        for (int y = next(); y >= 0; y = next()) {
            worker->row(row_of(in, y), row_of(out, y), in.width);
        }
        worker->finish();
        const std::lock_guard<std::mutex> lock(guard);
        counts += worker->counts();
    });
    return counts;
}

}  // namespace palette4d
