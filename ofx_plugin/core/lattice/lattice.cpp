#include "lattice/lattice.hpp"

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "lattice/lattice_store.hpp"
#include "recolour/float_worker.hpp"
#include "simd/kernel_choice.hpp"

namespace palette4d {

/// Blocks with pixels in unknown cells wait, so that many cells are built at a time. Only few
/// blocks wait, or other threads would wait for the same cells. Pixels in parts that miss the
/// tolerance go to the exact worker.
class Lattice::Worker final : public RowWorker {
public:
    Worker(const Recolourer& recolourer, Store& store, const RecolourOptions& options, int channels)
        : store_(store),
          kernels_(kernels_of<LatticeKernels>(options.instructions)),
          strength_(static_cast<float>(options.strength)),
          premultiplied_(options.premultiplied),
          channels_(channels),
          picks_(store.picks()),
          set_picks_(kernels_of<PickKernels>(options.instructions).set),
          exact_(float_worker(recolourer, options, channels, true)),
          builder_(store, options.instructions) {
        waiting_.reserve(kMostLeft + kWaiting);
        std::fill(std::begin(picked_[3]), std::end(picked_[3]), 1.0f);
    }

    void row(const float* in, float* out, int width) override {
        for (int x = 0; x < width; x += kSize) {
            const int count = std::min(kSize, width - x);
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * channels_;
            const float* from = in + at;
            float* to = out + at;
            if (x + (kAhead + 1) * kSize <= width) {
                fetch<0>(from + kAhead * kSize * channels_);
                fetch<1>(to + kAhead * kSize * channels_);
            }
            if (!block(from, to, count)) waiting_.push_back({from, to, count});
            if (waiting_.size() >= left_ + kWaiting) {
                do_waiting(kMostLeft);
                left_ = waiting_.size();
            }
        }
    }

    void finish() override {
        do_waiting(0);
        left_ = 0;
        check_samples();
        exact_->finish();
    }

    RecolourCounts counts() const override {
        RecolourCounts all = exact_->counts();
        all.interpolated = interpolated_;
        return all;
    }

private:
    static constexpr int kSize = LatticeBlock::kSize;
    static constexpr std::size_t kWaiting = 16, kMostLeft = 256;
    static constexpr int kSampleEvery =
        16;  ///< blocks; one of its pixels is also evaluated exactly

    /// How many blocks ahead memory is prefetched: a fetch takes about as long as work on a block.
    static constexpr int kAhead = 2;

    struct Waiting {
        const float* from;
        float* to;
        int count;
    };

    template <int Write>
    void fetch(const float* block) const {
        constexpr int kLine = 64 / sizeof(float);
        for (int i = 0; i < kSize * channels_; i += kLine) __builtin_prefetch(block + i, Write);
    }

    /// False when some of its pixels' cells or parts must be built first.
    bool block(const float* from, float* to, int count) {
        LatticeBlock& b = block_;
        kernels_.locate(store_.domain(), b, from, channels_, count, premultiplied_);
        std::int32_t others = look_up(count);
        while (others < 0) {
            kernels_.descend(b, count);
            others = look_up(count);
        }
        if ((others & kLatticeKind) != 0 && !claim(count)) return false;
        if (others >= kLatticeFirstPlane) {
            others |= kernels_.choose_sides(store_.planes(), b, count);
        }
        kernels_.weigh(b, count);
        const bool picks = !picks_.empty() && set_picks_(picks_, b.colour, picked_, count);
        if (picks) hold(count);
        if (blocks_++ % kSampleEvery == 0) sample(static_cast<int>(blocks_ % count));
        kernels_.blend(store_.nodes(), b, count, from, to, channels_, strength_, premultiplied_);
        if (picks) add_picks(to, count);
        interpolated_ += count;
        if ((others & kLatticeKind) == 0) return true;
        for (int i = 0; i < count; ++i) {
            if (b.state[i] == Store::kExact) {
                exact_->pixel(from + i * channels_, to + i * channels_);
                --interpolated_;
            }
        }
        return true;
    }

    /// Holds scale what the palette does.
    void hold(int count) {
        for (int k = 0; k < 4; ++k) {
            for (int i = 0; i < count; ++i) block_.weight[k][i] *= picked_[3][i];
        }
    }

    /// Moves the block's interpolated pixels by picked_.
    void add_picks(float* to, int count) const {
        int chosen[kSize], chosen_count = 0;  // no branch: it would be mispredicted
        for (int i = 0; i < count; ++i) {
            const bool moves = (picked_[0][i] != 0) | (picked_[1][i] != 0) | (picked_[2][i] != 0);
            chosen[chosen_count] = i;
            chosen_count += moves & ((block_.state[i] & kLatticeKind) == kLatticeGood);
        }
        for (int k = 0; k < chosen_count; ++k) {
            float* const pixel = to + chosen[k] * channels_;
            const float by = premultiplied_ ? pixel[3] * strength_ : strength_;
            for (int c = 0; c < 3; ++c) {
                const float moved = picked_[c][chosen[k]];
                if (moved != 0) pixel[c] += by * moved;
            }
        }
    }

    /// Fills the states in block_. Returns how they differ from kGood, combined: below 0 when some
    /// pixels are in cut cells.
    std::int32_t look_up(int count) {
        int* const states = block_.state;
        const int* const numbers = block_.number;
        const Store::State* const table = &store_.state(0);
        for (int i = 0; i < count; ++i) {
            states[i] = table[numbers[i]].load(std::memory_order_acquire);
        }
        std::int32_t others = 0;
        for (int i = 0; i < count; ++i) others |= states[i] ^ Store::kGood;
        return others;
    }

    /// Claims missing cells and parts that no other thread builds. True when none is missing.
    bool claim(int count) {
        bool made = true;
        for (int i = 0; i < count; ++i) {
            const std::int32_t state = block_.state[i];
            if ((state & kLatticeKind) != Store::kGood && state != Store::kExact) {
                made = false;
                builder_.claim(block_.number[i], block_.state[i]);
            }
        }
        return made;
    }

    /// Finishes waiting blocks until at most `most_left` are left; those wait for other threads.
    /// Not inlined, so that row(), the hot loop, can inline block() instead.
    [[gnu::noinline]] void do_waiting(std::size_t most_left) {
        const auto done = [&](const Waiting& w) { return block(w.from, w.to, w.count); };
        for (;;) {
            builder_.run();
            waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), done), waiting_.end());
            if (builder_.claimed()) continue;
            if (waiting_.size() <= most_left) return;
            std::this_thread::yield();
        }
    }

    void sample(int i) {
        if (block_.state[i] == Store::kExact) return;
        for (int c = 0; c < 3; ++c) {
            float moved = 0;
            for (int k = 0; k < 4; ++k) {
                moved += block_.weight[k][i] * store_.nodes()[block_.corner[k][i] / 4 + c];
            }
            sampled_.push_back(block_.colour[c][i]);
            sampled_moves_.push_back(moved);
        }
        sampled_scales_.push_back(picked_[3][i]);
        if (sampled_.size() >= 3 * 1024) check_samples();
    }

    void check_samples() {
        const float* const exact = builder_.displacements(sampled_.data(), sampled_.size() / 3);
        double largest = 0;
        for (std::size_t i = 0; i < sampled_.size(); ++i) {
            const double displacement = static_cast<double>(exact[i] * sampled_scales_[i / 3]);
            largest = std::max(
                largest, lattice_error(static_cast<double>(sampled_[i]), displacement,
                                       static_cast<double>(sampled_moves_[i]) - displacement));
        }
        store_.saw_error(largest);
        sampled_.clear();
        sampled_moves_.clear();
        sampled_scales_.clear();
    }

    Store& store_;
    const LatticeKernels kernels_;
    const float strength_;
    const bool premultiplied_;
    const int channels_;
    const PickPlan<float> picks_;
    decltype(PickKernels::set) const set_picks_;
    std::unique_ptr<FloatWorker> exact_;
    Store::Builder builder_;
    LatticeBlock block_{};
    /// What picks do to the block's colours, and what holds leave of what the palette does.
    alignas(64) float picked_[4][kSize]{};
    std::vector<Waiting> waiting_;
    std::size_t left_ = 0;  ///< blocks still waiting after the last do_waiting()
    std::vector<float> sampled_, sampled_moves_, sampled_scales_;
    long long interpolated_ = 0, blocks_ = 0;
};

Lattice::Lattice(std::shared_ptr<const Recolourer> recolourer)
    : recolourer_(std::move(recolourer)) {
    if (!recolourer_) throw std::invalid_argument("lattice: no recolourer");
    if (recolourer_->palette_moves()) store_ = std::make_unique<Store>(*recolourer_);
}

Lattice::~Lattice() = default;

double Lattice::largest_error() const { return store_ ? store_->largest_error() : 0.0; }

Lattice::Size Lattice::size() const { return store_ ? store_->size() : Size{}; }

std::unique_ptr<RowWorker> Lattice::worker(const RecolourOptions& options, int channels) const {
    if (!store_ || options.precision == Precision::kDouble || options.strength <= 0 ||
        options.strength > 1) {
        return recolourer_->worker(options, channels);
    }
    return std::make_unique<Worker>(*recolourer_, *store_, options, channels);
}

}  // namespace palette4d
