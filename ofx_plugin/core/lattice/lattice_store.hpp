// The nodes and cells of a Lattice, built by many threads on demand.
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
#include "lattice/mvc_worker.hpp"
#include "lattice/palette_regions.hpp"

namespace palette4d {

/// Zeroed memory in one block: the system allocates a page when it is first touched. One large
/// block allows large pages.
class Zeros {
public:
    explicit Zeros(std::size_t bytes);
    ~Zeros();
    Zeros(const Zeros&) = delete;
    Zeros& operator=(const Zeros&) = delete;
    /// The next array in the block; the sizes must add up.
    template <class T>
    T* take(std::size_t count) {
        T* const taken = reinterpret_cast<T*>(data_ + taken_);
        taken_ += count * sizeof(T);
        return taken;
    }

private:
    [[maybe_unused]] std::size_t size_;  ///< of the mapping, on Linux
    char* data_;
    std::size_t taken_ = 0;
};

/// The error that Lattice::kTolerance limits, at strength 1; at lower strengths it is no larger.
inline double lattice_error(double colour, double displacement, double error) {
    const double exact = colour + displacement;
    // Somewhere between strength 0 and 1, a channel that changes its sign is 0.
    const double size = colour * exact < 0 ? 0.1 : std::max(std::abs(exact), 0.1);
    return std::abs(error) / size;
}

/// In quarters of a cell: nodes lie at whole numbers, probes at multiples of a half. The last is 0.
struct LatticePlace {
    float at[4];
};
constexpr float kCellWidth = 4, kPartWidth = kCellWidth / 2;

/// A cut cell or part: its place and half its width, which is the width of its parts.
struct LatticeBrick {
    LatticePlace place;
    float half;
};

class Lattice::Store {
public:
    /// Cells are built eight at a time (a group) with all nodes between them. A cell whose nodes
    /// show a smooth displacement becomes good; others stay suspect until they are probed.
    enum : std::int32_t { kUnknown = 0, kClaimed, kSuspect, kGood = kLatticeGood, kExact };
    using State = std::atomic<std::int32_t>;

    explicit Store(const Recolourer& recolourer);

    const LatticeDomain& domain() const { return domain_; }
    const float* nodes() const { return nodes_; }
    const LatticePlane* planes() const { return planes_.data(); }
    PickPlan<float> picks() const { return recolourer_.plan().single.picks.plan(); }
    /// The state of a cell or part by its number.
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
    std::vector<LatticePlane> planes_;  ///< between regions; then all again, with an exact inside
    LatticeDomain domain_;
    float low_[4], step_[4];  ///< the domain's lowest corner; a quarter of a cell
    Zeros memory_;
    float* const nodes_;  ///< four floats each
    LatticeBrick* const bricks_;
    State* const states_;
    std::atomic<std::uint8_t>* const node_states_;  ///< of the cells; a brick is built at once
    float finest_half_;  ///< half the width of the smallest cells or parts
    std::atomic<std::int32_t> cut_{0}, cut_empty_{0};  ///< bricks with nodes, and without
    std::atomic<long long> cells_{0}, exact_{0}, colours_{0};
    std::atomic<double> largest_error_{0};
};

/// Builds what one thread has claimed.
class Lattice::Store::Builder {
public:
    Builder(Store& store, InstructionSet instructions);
    /// Cells that were claimed and not built are recoloured exactly.
    ~Builder();
    Builder(const Builder&) = delete;
    Builder& operator=(const Builder&) = delete;

    /// Adds an unknown or suspect cell or part to the list for run(), unless another thread has it.
    void claim(int number, std::int32_t state);
    bool claimed() const { return !groups_.empty() || !jobs_.empty(); }
    /// On return nothing of this list is kClaimed any more.
    void run() noexcept;

    /// Evaluates `count` colours at strength 1, without picks. Returns (count, 3) floats; one more
    /// is readable.
    const float* displacements(const float* colours, std::size_t count);

private:
    /// A suspect cell or part.
    struct Job {
        LatticePlace place;
        float half;  ///< half of its width
        int number, node, step_x, step_y;
        PaletteRegions::Within within;
        bool is_cell() const { return number < kLatticeCells; }
        int corner(int k) const {
            return node + (k >> 2) * step_x + (k >> 1 & 1) * step_y + (k & 1);
        }
    };

    using Parts = std::array<PaletteRegions::Within, 8>;
    struct Group {
        int number;    ///< the group's first cell
        Parts within;  ///< regions of its cells
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
    /// The exact displacements at the probes `first` to `last` - 1 of all jobs.
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

    /// With PaletteRegions, mean value coordinates even outside; without, the exact displacements.
    /// Picks are never interpolated.
    const float* node_displacements(const float* colours, std::size_t count);

    Store& store_;
    std::unique_ptr<RowWorker> exact_;
    std::unique_ptr<MvcWorker> mean_value_;  ///< only with PaletteRegions
    std::vector<Group> groups_;
    std::vector<int> taken_;
    std::vector<Job> jobs_, to_look_at_;
    std::vector<float> colours_, moved_, errors_, middles_;
};

}  // namespace palette4d
