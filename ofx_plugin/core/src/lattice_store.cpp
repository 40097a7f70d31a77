#include "lattice_store.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

namespace palette4d {
namespace {

/// All that there can be: every cell, and every part but the smallest.
constexpr std::size_t kMostBricks =
    kLatticeCells * ((std::size_t{1} << 3 * kLatticeCuts) - 1) / (kBrickParts - 1);
constexpr std::size_t kMostNodes = kLatticeFirstBrick + kMostBricks * kBrickNodes;
constexpr std::size_t kMostStates = kLatticeFirstPart + kMostBricks * kBrickParts;
static_assert(kMostNodes < 1 << 24, "floats count nodes");
static_assert(kMostBricks < kLatticeBrick, "states count bricks");

/// Where a cell's interpolation is looked at: the other nodes of the brick that it would be cut
/// into. Each corner has a part in one, so that a crease that cuts a corner off is seen as well.
struct Probe {
    int place[3];            ///< in halves
    std::size_t corners[2];  ///< it is half way between them; number 4 x + 2 y + z

    std::size_t node() const {
        return static_cast<std::size_t>((place[0] * 3 + place[1]) * 3 + place[2]);
    }
};

Probe probe_at(int x, int y, int z) {
    const auto corner = [](int i, int j, int k) {
        return static_cast<std::size_t>(4 * i + 2 * j + k);
    };
    return {{x, y, z},
            {corner(x / 2, y / 2, z / 2), corner((x + 1) / 2, (y + 1) / 2, (z + 1) / 2)}};
}

/// The middles of the cell and of its faces, then those of its edges.
const std::vector<Probe>& probes() {
    static const std::vector<Probe> all = [] {
        std::vector<Probe> middles, edges;
        for (int node = 0; node < kBrickNodes; ++node) {
            const int x = node / 9, y = node / 3 % 3, z = node % 3;
            const int halves = (x == 1) + (y == 1) + (z == 1);
            if (halves > 0) (halves > 1 ? middles : edges).push_back(probe_at(x, y, z));
        }
        middles.insert(middles.end(), edges.begin(), edges.end());
        return middles;
    }();
    return all;
}
constexpr std::size_t kAllProbes = 19, kMiddles = 7;

/// How far the corners' displacements are from affine, face by face: seen where no probe is.
double twist(const float (&corners)[8][3], std::size_t c) {
    constexpr int kFaces[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 4, 5},
                                  {2, 3, 6, 7}, {0, 2, 4, 6}, {1, 3, 5, 7}};
    float most = 0;
    for (const auto& f : kFaces) {
        most = std::max(most, std::abs(corners[f[0]][c] - corners[f[1]][c] - corners[f[2]][c] +
                                       corners[f[3]][c]));
    }
    return static_cast<double>(most);
}

}  // namespace

Lattice::Store::Store(const Recolourer& recolourer)
    : recolourer_(recolourer),
      memory_(kMostNodes * 4 * sizeof(float) + kMostBricks * sizeof(Cut) +
              kMostStates * sizeof(State) + kLatticeNodes),
      nodes_(memory_.take<float>(4 * kMostNodes)),
      cuts_(memory_.take<Cut>(kMostBricks)),
      states_(memory_.take<State>(kMostStates)),
      node_states_(memory_.take<std::atomic<std::uint8_t>>(kLatticeNodes)) {
    state(kLatticeOutside) = kExact;
    for (std::size_t c = 0; c < 3; ++c) {
        double low = 0, high = 1;
        for (const Vec3& colour : recolourer.original()) {
            low = std::min(low, colour[c]);
            high = std::max(high, colour[c]);
        }
        // A margin for what filters and codecs add.
        const double margin = (high - low) / 16;
        domain_.low[c] = static_cast<float>(low - margin);
        domain_.high[c] = static_cast<float>(high + margin);
        const double width = high - low + 2 * margin;
        domain_.scale[c] = static_cast<float>(kLatticeSide / width);
        step_[c] = static_cast<float>(width / (kLatticeSide << kLatticeCuts));
    }
}

void Lattice::Store::saw_error(double error) {
    double before = largest_error_.load(std::memory_order_relaxed);
    while (error > before && !largest_error_.compare_exchange_weak(before, error)) {
    }
}

Lattice::Size Lattice::Store::size() const { return {cells_, bricks_, parts_, exact_, colours_}; }

Lattice::Store::Builder::Builder(Store& store, InstructionSet instructions)
    : store_(store), exact_(store.recolourer_, [&] {
          RecolourOptions options;
          options.instructions = instructions;
          return options;
      }()) {}

void Lattice::Store::Builder::add(int number) {
    if (number < kLatticeCells) {
        constexpr int n = kLatticeSide, side = n + 1;
        const int x = number / (n * n), y = number / n % n, z = number % n;
        jobs_.push_back({{{x, y, z}, 0}, number, (x * side + y) * side + z, side * side, side});
        return;
    }
    const int brick = (number - kLatticeFirstPart) / kBrickParts;
    const int part = (number - kLatticeFirstPart) % kBrickParts;
    const int x = part >> 2, y = part >> 1 & 1, z = part & 1;
    const Cut& whole = store_.cuts_[static_cast<std::size_t>(brick)];
    jobs_.push_back(
        {{{2 * whole.place[0] + x, 2 * whole.place[1] + y, 2 * whole.place[2] + z}, whole.cuts + 1},
         number,
         kLatticeFirstBrick + brick * kBrickNodes + (x * 3 + y) * 3 + z,
         9,
         3});
}

void Lattice::Store::Builder::run() noexcept {
    if (jobs_.empty()) return;
    taken_.clear();
    try {
        make_corners();
        judge();
    } catch (...) {
        // Out of memory: what stays undone is recoloured exactly.
        for (const int node : taken_) {
            std::uint8_t taken = kTaken;
            store_.node_states_[node].compare_exchange_strong(taken, kFailed);
        }
        for (const Job& job : jobs_) {
            std::int32_t claimed = kClaimed;
            store_.state(job.number).compare_exchange_strong(claimed, kExact);
        }
    }
    jobs_.clear();
}

void Lattice::Store::Builder::make_corners() {
    colours_.clear();
    for (const Job& job : jobs_) {
        if (job.itself.cuts > 0) continue;
        for (int corner = 0; corner < 8; ++corner) {
            const int offset[3] = {corner >> 2 & 1, corner >> 1 & 1, corner & 1};
            const int node = job.node + offset[0] * job.step_x + offset[1] * job.step_y + offset[2];
            std::uint8_t empty = kEmpty;
            auto& state = store_.node_states_[node];
            if (state.load(std::memory_order_relaxed) != kEmpty) continue;
            taken_.push_back(node);
            if (!state.compare_exchange_strong(empty, kTaken)) {
                taken_.pop_back();
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                const int place = (job.itself.place[c] + offset[c]) * job.width();
                colours_.push_back(store_.domain_.low[c] +
                                   static_cast<float>(place) * store_.step_[c]);
            }
        }
    }
    if (taken_.empty()) return;
    const std::vector<float>& moved = displacements(colours_);
    for (std::size_t i = 0; i < taken_.size(); ++i) {
        std::copy_n(&moved[3 * i], 3, store_.nodes_ + 4 * static_cast<std::size_t>(taken_[i]));
        store_.node_states_[taken_[i]].store(kReady, std::memory_order_release);
    }
}

bool Lattice::Store::Builder::corners(const Job& job, float (&values)[8][3]) {
    for (int corner = 0; corner < 8; ++corner) {
        const int node = job.node + (corner >> 2 & 1) * job.step_x +
                         (corner >> 1 & 1) * job.step_y + (corner & 1);
        if (job.itself.cuts == 0) {
            std::uint8_t state;
            while ((state = store_.node_states_[node].load(std::memory_order_acquire)) == kTaken) {
                std::this_thread::yield();
            }
            if (state != kReady) return false;
        }
        std::copy_n(store_.nodes_ + 4 * static_cast<std::size_t>(node), 3, values[corner]);
    }
    return true;
}

void Lattice::Store::Builder::add_probes(const Job& job, std::size_t first, std::size_t last) {
    const std::vector<Probe>& all = probes();
    std::size_t at = colours_.size();
    colours_.resize(at + 3 * (last - first));
    const int width = job.width();
    for (std::size_t p = first; p < last; ++p) {
        for (std::size_t c = 0; c < 3; ++c) {
            const int halves = (2 * job.itself.place[c] + all[p].place[c]) * width;
            colours_[at++] =
                store_.domain_.low[c] + 0.5f * static_cast<float>(halves) * store_.step_[c];
        }
    }
}

double Lattice::Store::Builder::error_of(const float (&corners)[8][3], const float* colours,
                                         const float* moved, std::size_t count) {
    double error = 0;
    const std::vector<Probe>& all = probes();
    const double twists[3] = {twist(corners, 0), twist(corners, 1), twist(corners, 2)};
    for (std::size_t p = 0; p < count; ++p) {
        const Probe& probe = all[p];
        for (std::size_t c = 0; c < 3; ++c) {
            const auto colour = static_cast<double>(colours[3 * p + c]);
            const auto exact = static_cast<double>(moved[3 * p + c]);
            const double value = (static_cast<double>(corners[probe.corners[0]][c]) +
                                  static_cast<double>(corners[probe.corners[1]][c])) /
                                 2;
            // A quarter of the twist is the error of what is bilinear.
            const double worse = std::max(std::abs(value - exact), twists[c] / 4);
            const double found = lattice_error(colour, exact, worse);
            error = found <= error ? error : found;  // NaN counts
        }
    }
    return error;
}

void Lattice::Store::Builder::judge() {
    const auto first_probes = [](const Job& job) {
        return job.itself.cuts == 0 ? kAllProbes : kMiddles;
    };
    colours_.clear();
    for (const Job& job : jobs_) add_probes(job, 0, first_probes(job));
    displacements(colours_);
    std::vector<ToCut> cut;
    std::size_t at = 0;
    double largest = 0;
    for (const Job& job : jobs_) {
        ToCut one{&job, {}, {}};
        const std::size_t count = first_probes(job);
        const bool known = corners(job, one.corners);
        const double error = known ? error_of(one.corners, &colours_[at], &moved_[at], count) : 0.0;
        const bool good = known && error <= kProbeTolerance;
        if (good) largest = std::max(largest, error);
        if (good || !known || job.itself.cuts == kLatticeCuts) {
            publish(job, good ? kGood : kExact);
        } else {
            std::copy_n(&moved_[at], 3 * count, one.probed);
            cut.push_back(one);
        }
        at += 3 * count;
    }
    store_.saw_error(largest);

    colours_.clear();
    for (const ToCut& one : cut) add_probes(*one.job, first_probes(*one.job), kAllProbes);
    displacements(colours_);
    at = 0;
    for (ToCut& one : cut) {
        const std::size_t count = first_probes(*one.job), more = 3 * (kAllProbes - count);
        if (more > 0) std::copy_n(&moved_[at], more, one.probed + 3 * count);
        at += more;
        publish(*one.job, kBrick + make_brick(one));
    }
}

std::int32_t Lattice::Store::Builder::make_brick(const ToCut& one) {
    const std::int32_t brick = store_.bricks_++;
    store_.cuts_[brick] = one.job->itself;
    float* const nodes =
        store_.nodes_ + 4 * (kLatticeFirstBrick + static_cast<std::size_t>(brick) * kBrickNodes);
    for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::size_t node = (corner >> 2) * 18 + (corner >> 1 & 1) * 6 + (corner & 1) * 2;
        std::copy_n(one.corners[corner], 3, nodes + 4 * node);
    }
    for (std::size_t p = 0; p < kAllProbes; ++p) {
        std::copy_n(one.probed + 3 * p, 3, nodes + 4 * probes()[p].node());
    }
    return brick;
}

void Lattice::Store::Builder::publish(const Job& job, std::int32_t state) {
    ++(job.itself.cuts == 0 ? store_.cells_ : store_.parts_);
    if (state == kExact) ++store_.exact_;
    store_.state(job.number).store(state, std::memory_order_release);
}

const std::vector<float>& Lattice::Store::Builder::displacements(
    const std::vector<float>& colours) {
    moved_.resize(colours.size());
    constexpr std::size_t kMost = 1 << 20;
    for (std::size_t at = 0; at < colours.size(); at += 3 * kMost) {
        const std::size_t count = std::min(kMost, (colours.size() - at) / 3);
        exact_.row(colours.data() + at, moved_.data() + at, static_cast<int>(count), 3);
    }
    exact_.finish();
    for (std::size_t i = 0; i < colours.size(); ++i) moved_[i] -= colours[i];
    store_.colours_ += static_cast<long long>(colours.size() / 3);
    return moved_;
}

}  // namespace palette4d
