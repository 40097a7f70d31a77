// The nodes and cells of a Lattice, made by many threads at a time as they are asked for.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "lattice/lattice.hpp"
#include "lattice/lattice_kernels.hpp"
#include "lattice/mean_value_worker.hpp"
#include "lattice/palette_regions.hpp"

namespace palette4d {

/// Zeros that cost nothing where nobody touches them: the system gives the pages when they are. All
/// in one piece, so that it is large enough for that.
class Zeros {
public:
    explicit Zeros(std::size_t bytes);
    ~Zeros();
    Zeros(const Zeros&) = delete;
    Zeros& operator=(const Zeros&) = delete;
    /// The next part of it; the sizes must add up.
    template <class T>
    T* take(std::size_t count) {
        T* const taken = reinterpret_cast<T*>(data_ + taken_);
        taken_ += count * sizeof(T);
        return taken;
    }

private:
    std::size_t size_;
    char* data_;
    std::size_t taken_ = 0;
};

/// What Lattice::kTolerance is held against, at strength 1; at a lower one the error is no larger.
inline double lattice_error(double colour, double displacement, double error) {
    const double exact = colour + displacement;
    // At a strength between 0 and 1 a channel that changes its sign goes through 0.
    const double size = colour * exact < 0 ? 0.1 : std::max(std::abs(exact), 0.1);
    return std::abs(error) / size;
}

/// In quarters of a cell, so that nodes lie at whole numbers and probes at half ones at least; the
/// last is 0.
struct LatticePlace {
    float at[4];
};
constexpr float kCellWidth = 4, kPartWidth = kCellWidth / 2;

/// Of what is cut: where it is, and half of its width, which is that of its parts.
struct LatticeBrick {
    LatticePlace place;
    float half;
};

class Lattice::Store {
public:
    /// States. Cells are made eight at a time (a group), with all nodes between them: where these
    /// tell that a cell is fine it is good, else suspect until it was looked at itself.
    enum : std::int32_t { kUnknown = 0, kClaimed, kSuspect, kGood = kLatticeGood, kExact };
    using State = std::atomic<std::int32_t>;

    explicit Store(const Recolourer& recolourer);

    const LatticeDomain& domain() const { return domain_; }
    const float* nodes() const { return nodes_; }
    const LatticePlane* planes() const { return planes_.data(); }
    /// Of a cell or part, by its number.
    State& state(int number) { return states_[static_cast<std::size_t>(number)]; }

    class Builder;

    void saw_error(double error);
    double largest_error() const { return largest_error_.load(std::memory_order_relaxed); }
    Size size() const;

private:
    enum : std::uint8_t { kEmpty = 0, kTaken, kReady, kFailed };

    float* node(int number) { return nodes_ + 4 * static_cast<std::size_t>(number); }

    void add_regions();

    const Recolourer& recolourer_;
    std::unique_ptr<const PaletteRegions> regions_;
    std::vector<LatticePlane> planes_;  ///< between them; then all again, with an exact inside
    LatticeDomain domain_;
    float low_[4], step_[4];  ///< of the domain; a quarter of a cell
    Zeros memory_;
    float* const nodes_;  ///< 4 numbers each
    LatticeBrick* const bricks_;
    State* const states_;
    std::atomic<std::uint8_t>* const node_states_;  ///< of the cells; a brick is made in one piece
    float finest_half_;                             ///< of the width of what is not cut any more
    std::atomic<std::int32_t> cut_{0}, cut_empty_{0};  ///< bricks with nodes, and without
    std::atomic<long long> cells_{0}, exact_{0}, colours_{0};
    std::atomic<double> largest_error_{0};
};

/// Makes what one thread has claimed.
class Lattice::Store::Builder {
public:
    Builder(Store& store, InstructionSet instructions);
    /// What was claimed and not made is recoloured exactly.
    ~Builder();
    Builder(const Builder&) = delete;
    Builder& operator=(const Builder&) = delete;

    /// To be made by run(): what is unknown or suspect, unless another thread was faster.
    void claim(int number, std::int32_t state);
    bool claimed() const { return !groups_.empty() || !jobs_.empty(); }
    /// On return nothing of it is kClaimed any more.
    void run() noexcept;

    /// Evaluates `count` colours at strength 1: displacements (count, 3), and a number more.
    const float* displacements(const float* colours, std::size_t count);

private:
    /// A cell or part that is suspect.
    struct Job {
        LatticePlace place;
        float half;  ///< of its width
        int number, node, step_x, step_y;
        PaletteRegions::Within within;
        bool is_cell() const { return number < kLatticeCells; }
        int corner(int k) const {
            return node + (k >> 2) * step_x + (k >> 1 & 1) * step_y + (k & 1);
        }
    };

    using Parts = std::array<PaletteRegions::Within, 8>;
    struct Group {
        int number;    ///< its first cell's
        Parts within;  ///< its cells
    };

    void give_up() noexcept;
    void make_groups();
    PaletteRegions::Within within(const LatticePlace& place, float half, int start) const;
    PaletteRegions::Within within_part(int brick, const LatticePlace& place) const;
    bool find_regions(Group& group) const;
    void take_nodes(int group);
    void publish_group(const Group& group);
    void make_jobs();
    Job job_of(int number) const;
    /// What the probes `first` to `last` - 1 of jobs have moved.
    const float* probe(const std::vector<Job>& jobs, std::size_t first, std::size_t last);
    float error_of(const Job& job, const float* moved, std::size_t first, std::size_t last) const;
    void cut(const Job& job, const float* middles, const float* edges);
    template <class NodeAt>
    void judge(const LatticePlace& place, float half, const NodeAt& node_at, const Parts& within,
               std::int32_t* states) const;
    std::int32_t state_of(const PaletteRegions::Within& within, bool good) const;
    std::int32_t first_state_of(const PaletteRegions::Within& within, bool good) const;
    void publish(int number, std::int32_t state) {
        store_.state(number).store(state, std::memory_order_release);
    }

    /// By mean value coordinates everywhere where there are regions, else exactly.
    const float* node_displacements(const float* colours, std::size_t count);

    Store& store_;
    std::unique_ptr<RowWorker> exact_;
    std::unique_ptr<MeanValueWorker> mean_value_;  ///< where there are regions
    std::vector<Group> groups_;
    std::vector<int> taken_;
    std::vector<Job> jobs_, to_look_at_;
    std::vector<float> colours_, moved_, errors_, middles_;
};

}  // namespace palette4d
