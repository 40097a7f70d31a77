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

#include "exact_worker.hpp"
#include "lattice_kernels.hpp"
#include "palette4d/lattice.hpp"

namespace palette4d {

/// Zeros that cost nothing where nobody touches them: the system gives the pages when they are. All
/// in one piece, so that it is large enough for that.
class Zeros {
public:
    explicit Zeros(std::size_t bytes) : data_(static_cast<char*>(std::calloc(bytes, 1))) {
        if (!data_) throw std::bad_alloc();
    }
    ~Zeros() { std::free(data_); }
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

class Lattice::Store {
public:
    enum : std::int32_t {
        kUnknown = 0,
        kClaimed,
        kGood = kLatticeGood,
        kExact,
        kBrick = kLatticeBrick
    };
    using State = std::atomic<std::int32_t>;

    explicit Store(const Recolourer& recolourer);

    const LatticeDomain& domain() const { return domain_; }
    const float* nodes() const { return nodes_; }
    /// Of a cell or part, by its number.
    State& state(int number) { return states_[static_cast<std::size_t>(number)]; }

    /// Makes cells, and parts of bricks, that were claimed by the calling thread (it made their
    /// state kClaimed from kUnknown). On return none of them is kClaimed any more.
    class Builder;

    void saw_error(double error);
    double largest_error() const { return largest_error_.load(std::memory_order_relaxed); }
    Size size() const;

private:
    /// The cell or part that a brick cuts: where it is, in its own width, after so many cuts.
    struct Cut {
        std::int32_t place[3];
        std::int32_t cuts;
    };
    enum : std::uint8_t { kEmpty = 0, kTaken, kReady, kFailed };

    const Recolourer& recolourer_;
    LatticeDomain domain_;
    float step_[3];  ///< width of the smallest parts
    Zeros memory_;
    float* const nodes_;  ///< 4 numbers each
    Cut* const cuts_;     ///< one a brick
    State* const states_;
    std::atomic<std::uint8_t>* const node_states_;  ///< of the cells; a brick is made in one piece
    std::atomic<std::int32_t> bricks_{0};
    std::atomic<long long> cells_{0}, parts_{0}, exact_{0}, colours_{0};
    std::atomic<double> largest_error_{0};
};

class Lattice::Store::Builder {
public:
    Builder(Store& store, InstructionSet instructions);

    /// A cell or part, by its number.
    void add(int number);
    /// Makes what was added.
    void run() noexcept;

    /// Evaluates colours at strength 1: displacements (n, 3).
    const std::vector<float>& displacements(const std::vector<float>& colours);

private:
    struct Job {
        Cut itself;
        int number, node, step_x, step_y;
        int width() const { return 1 << (kLatticeCuts - itself.cuts); }  ///< in smallest parts
    };
    /// One that is to be cut.
    struct ToCut {
        const Job* job;
        float corners[8][3];
        float probed[19 * 3];
    };
    void make_corners();
    void judge();
    void add_probes(const Job& job, std::size_t first, std::size_t last);
    static double error_of(const float (&corners)[8][3], const float* colours, const float* moved,
                           std::size_t count);
    std::int32_t make_brick(const ToCut& one);
    void publish(const Job& job, std::int32_t state);
    /// Waits for nodes that other threads have taken; false when one could not be made.
    bool corners(const Job& job, float (&values)[8][3]);

    Store& store_;
    ExactWorker exact_;
    std::vector<Job> jobs_;
    std::vector<int> taken_;
    std::vector<float> colours_, moved_;
};

}  // namespace palette4d
