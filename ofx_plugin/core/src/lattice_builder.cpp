// How the cells of a Lattice are made.
#include <algorithm>
#include <thread>

#include "four.hpp"
#include "lattice_store.hpp"

namespace palette4d {
namespace {

constexpr int kSide = kLatticeSide, kNodeSide = kSide + 1;
constexpr float kCellWidth = 4;  ///< in half widths of a part

/// Of one of the eight corners or parts of something, along an axis: number 4 x + 2 y + z.
constexpr int bit(int corner, int axis) { return corner >> (2 - axis) & 1; }

/// Of a brick: along each axis, in halves of what it cuts.
struct BrickPlaces {
    float at[kBrickNodes][4]{};
    constexpr BrickPlaces() {
        for (int node = 0; node < kBrickNodes; ++node) {
            at[node][0] = static_cast<float>(node / 9);
            at[node][1] = static_cast<float>(node / 3 % 3);
            at[node][2] = static_cast<float>(node % 3);
        }
    }
};
constexpr BrickPlaces kPlaces;

/// Where the interpolation of a cell or part is looked at: the other nodes of the brick that it
/// would be cut into, the middles of it and of its faces, then those of its edges. Each corner has
/// a part in one, so that a crease that cuts a corner off is seen as well.
struct Probes {
    static constexpr std::size_t kMiddles = 7, kAll = 19;
    struct Probe {
        int node;     ///< of the brick
        int ends[2];  ///< it is half way between these two corners
    };
    Probe all[kAll]{};

    constexpr Probes() {
        std::size_t middles = 0, edges = kMiddles;
        for (int node = 0; node < kBrickNodes; ++node) {
            const int x = node / 9, y = node / 3 % 3, z = node % 3;
            const int halves = (x == 1) + (y == 1) + (z == 1);
            if (halves == 0) continue;
            all[halves > 1 ? middles++ : edges++] = {
                node,
                {4 * (x / 2) + 2 * (y / 2) + z / 2,
                 4 * ((x + 1) / 2) + 2 * ((y + 1) / 2) + (z + 1) / 2}};
        }
    }
};
constexpr Probes kProbes;

/// The lines through 3 x 3 x 3 nodes that edges of the tetrahedra lie on, three nodes each.
struct Lines {
    static constexpr std::size_t kCount = 37, kTouching = 19;
    struct Line {
        int middle, step;
    };
    Line all[kCount]{};
    int of_part[8][kTouching]{};  ///< those that touch one of the eight parts

    constexpr Lines() {
        int count = 0, touching[8] = {};
        for (int direction = 1; direction < 8; ++direction) {
            for (int node = 0; node < kBrickNodes; ++node) {
                const int at[3] = {node / 9, node / 3 % 3, node % 3};
                bool middle = true;
                for (int c = 0; c < 3; ++c) middle &= !bit(direction, c) || at[c] == 1;
                if (!middle) continue;
                for (int part = 0; part < 8; ++part) {
                    bool touches = true;
                    for (int c = 0; c < 3; ++c) {
                        touches &= bit(direction, c) || at[c] == 1 || at[c] / 2 == bit(part, c);
                    }
                    if (touches) of_part[part][touching[part]++] = count;
                }
                all[count++] = {node,
                                9 * bit(direction, 0) + 3 * bit(direction, 1) + bit(direction, 2)};
            }
        }
    }
};
constexpr Lines kLines;

struct Cell {
    int x, y, z;
    int first_node() const { return (x * kNodeSide + y) * kNodeSide + z; }
};

Cell cell_at(int number) {
    return {number / (kSide * kSide), number / kSide % kSide, number % kSide};
}

/// Of a group that is known by its first cell.
int group_cell(int group, int part) {
    return group + (bit(part, 0) * kSide + bit(part, 1)) * kSide + bit(part, 2);
}

LatticePlace place_of(const Cell& cell) {
    return {{kCellWidth * static_cast<float>(cell.x), kCellWidth * static_cast<float>(cell.y),
             kCellWidth * static_cast<float>(cell.z), 0}};
}

/// Places are whole numbers, so that a place has one colour, whatever it is counted from.
Four colour_at(const float* low, const float* step, Four place) {
    return load_four(low) + place * load_four(step);
}

/// As lattice_error().
Four relative(Four error, Four colour, Four moved) {
    const Four exact = colour + moved, least = all_four(0.1f);
    return abs(error) / where_negative(colour * exact, least, max(abs(exact), least));
}

float largest_of(Four error) { return std::max(std::max(error[0], error[1]), error[2]); }

constexpr float kMost = static_cast<float>(Lattice::kProbeTolerance);
/// Between three nodes in a line an interpolation is better than across all three: an error that is
/// smooth by four times.
constexpr float kMostInLine = 1.25f * kMost;

}  // namespace

Lattice::Store::Builder::Builder(Store& store, InstructionSet instructions)
    : store_(store), exact_(store.recolourer_, [&] {
          RecolourOptions options;
          options.instructions = instructions;
          return options;
      }()) {}

void Lattice::Store::Builder::claim(int number, std::int32_t state) {
    if (state == kUnknown) {  // its group's first cell stands for all
        const Cell cell = cell_at(number);
        const int group = number - (cell.x % 2 * kSide + cell.y % 2) * kSide - cell.z % 2;
        if (store_.state(group).compare_exchange_strong(state, kClaimed)) groups_.push_back(group);
    } else if (state == kSuspect) {
        if (store_.state(number).compare_exchange_strong(state, kClaimed)) {
            jobs_.push_back(job_of(number));
        }
    }
}

void Lattice::Store::Builder::run() noexcept {
    try {
        make_groups();
        make_jobs();
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
        for (const int group : groups_) {
            for (int part = 0; part < 8; ++part) {
                publish(group_cell(group, part), kExact);
            }
        }
    }
    groups_.clear();
    jobs_.clear();
}

void Lattice::Store::Builder::make_groups() {
    colours_.clear();
    taken_.clear();
    for (const int group : groups_) take_nodes(group);
    const float* const moved = displacements(colours_.data(), taken_.size());
    for (std::size_t i = 0; i < taken_.size(); ++i) {
        std::copy_n(moved + 3 * i, 3, store_.node(taken_[i]));
        store_.node_states_[taken_[i]].store(kReady, std::memory_order_release);
    }
    for (const int group : groups_) publish_group(group);
    groups_.clear();
}

void Lattice::Store::Builder::take_nodes(int group) {
    const Cell cell = cell_at(group);
    for (int n = 0; n < kBrickNodes; ++n) {
        const Cell at{cell.x + n / 9, cell.y + n / 3 % 3, cell.z + n % 3};
        const int node = at.first_node();
        auto& state = store_.node_states_[node];
        std::uint8_t empty = kEmpty;
        if (state.load(std::memory_order_relaxed) != kEmpty) continue;
        taken_.push_back(node);
        if (!state.compare_exchange_strong(empty, kTaken)) {
            taken_.pop_back();
            continue;
        }
        const Four colour = colour_at(store_.low_, store_.step_, load_four(place_of(at).at));
        for (int c = 0; c < 3; ++c) colours_.push_back(colour[c]);
    }
}

void Lattice::Store::Builder::publish_group(int group) {
    const Cell cell = cell_at(group);
    std::int32_t states[8];
    bool known = true;
    const auto node_at = [&](int n) {
        const int node = Cell{cell.x + n / 9, cell.y + n / 3 % 3, cell.z + n % 3}.first_node();
        std::uint8_t state;  // other threads may be at it
        while ((state = store_.node_states_[node].load(std::memory_order_acquire)) == kTaken) {
            std::this_thread::yield();
        }
        known &= state == kReady;
        return store_.node(node);
    };
    judge(place_of(cell), kCellWidth, node_at, states);
    for (int part = 0; part < 8; ++part) {
        publish(group_cell(group, part), known ? states[part] : kExact);
    }
    store_.cells_ += 8;
}

/// Of the eight parts of a cube of 3 x 3 x 3 nodes, `half` of its width apart: good or suspect. A
/// part is not worse than the whole: along a line, what a crease is off in a half of it is no more
/// than at its middle, and what is smooth is off by a quarter of that.
template <class NodeAt>
void Lattice::Store::Builder::judge(const LatticePlace& place, float half, const NodeAt& node_at,
                                    std::int32_t* states) const {
    Four moved[kBrickNodes];
    for (int n = 0; n < kBrickNodes; ++n) moved[n] = load_four(node_at(n));
    Four errors[Lines::kCount];
    for (std::size_t i = 0; i < Lines::kCount; ++i) {
        const auto [middle, step] = kLines.all[i];
        const Four colour = colour_at(store_.low_, store_.step_,
                                      load_four(place.at) + half * load_four(kPlaces.at[middle]));
        const Four value = 0.5f * (moved[middle - step] + moved[middle + step]);
        errors[i] = relative(value - moved[middle], colour, moved[middle]);
    }
    for (int part = 0; part < 8; ++part) {
        Four worst{};
        for (const int line : kLines.of_part[part]) worst = max(worst, errors[line]);
        states[part] = largest_of(worst) <= kMostInLine ? kGood : kSuspect;
    }
}

void Lattice::Store::Builder::make_jobs() {
    constexpr std::size_t kMiddles = Probes::kMiddles, kAll = Probes::kAll;
    to_cut_.clear();
    middles_.clear();
    const float* moved = probe(jobs_, 0, kMiddles);
    float largest = 0;
    long long exact = 0;
    for (const Job& job : jobs_) {
        const float error = error_of(job, moved);
        if (error <= kMost) {
            largest = std::max(largest, error);
            publish(job.number, kGood);
        } else if (job.number >= kLatticeCells) {
            ++exact;
            publish(job.number, kExact);
        } else {
            to_cut_.push_back(job);
            middles_.insert(middles_.end(), moved, moved + 3 * kMiddles);
        }
        moved += 3 * kMiddles;
    }
    store_.saw_error(static_cast<double>(largest));
    store_.exact_ += exact;
    const float* edges = probe(to_cut_, kMiddles, kAll);
    for (std::size_t i = 0; i < to_cut_.size(); ++i) {
        cut(to_cut_[i], &middles_[3 * kMiddles * i], edges + 3 * (kAll - kMiddles) * i);
    }
    jobs_.clear();
}

Lattice::Store::Builder::Job Lattice::Store::Builder::job_of(int number) const {
    if (number < kLatticeCells) {
        const Cell cell = cell_at(number);
        return {place_of(cell),    kCellWidth / 2,        number,
                cell.first_node(), kNodeSide * kNodeSide, kNodeSide};
    }
    const int brick = (number - kLatticeFirstPart) / kBrickParts;
    const int part = (number - kLatticeFirstPart) % kBrickParts;
    LatticePlace place = store_.bricks_[brick];
    for (int c = 0; c < 3; ++c) place.at[c] += static_cast<float>(bit(part, c)) * kCellWidth / 2;
    const int first = kLatticeFirstBrick + brick * kBrickNodes;
    return {place,  kCellWidth / 4,
            number, first + bit(part, 0) * 9 + bit(part, 1) * 3 + bit(part, 2),
            9,      3};
}

const float* Lattice::Store::Builder::probe(const std::vector<Job>& jobs, std::size_t first,
                                            std::size_t last) {
    const std::size_t count = jobs.size() * (last - first);
    colours_.resize(3 * count + 1);  // written by fours
    float* to = colours_.data();
    for (const Job& job : jobs) {
        for (std::size_t p = first; p < last; ++p, to += 3) {
            const Four halves = load_four(kPlaces.at[kProbes.all[p].node]);
            store_four(to, colour_at(store_.low_, store_.step_,
                                     load_four(job.place.at) + job.half * halves));
        }
    }
    return displacements(colours_.data(), count);
}

/// At the middles, which have moved so far.
float Lattice::Store::Builder::error_of(const Job& job, const float* moved) const {
    Four corners[8];
    for (int k = 0; k < 8; ++k) corners[k] = load_four(store_.node(job.corner(k)));
    // How far the corners are from affine, face by face, is seen where no probe is: a quarter of it
    // is the error of what is bilinear.
    constexpr int kFaces[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 4, 5},
                                  {2, 3, 6, 7}, {0, 2, 4, 6}, {1, 3, 5, 7}};
    Four twist{};
    for (const auto& f : kFaces) {
        twist = max(twist, abs(corners[f[0]] - corners[f[1]] - corners[f[2]] + corners[f[3]]));
    }
    twist = 0.25f * twist;
    Four worst{};
    for (std::size_t p = 0; p < Probes::kMiddles; ++p, moved += 3) {
        const Probes::Probe& probe = kProbes.all[p];
        const Four halves = load_four(kPlaces.at[probe.node]), exact = load_four(moved);
        const Four colour =
            colour_at(store_.low_, store_.step_, load_four(job.place.at) + job.half * halves);
        const Four value = 0.5f * (corners[probe.ends[0]] + corners[probe.ends[1]]);
        worst = max(worst, relative(max(abs(value - exact), twist), colour, exact));
    }
    return largest_of(worst);
}

void Lattice::Store::Builder::cut(const Job& job, const float* middles, const float* edges) {
    const std::int32_t brick = store_.cut_++;
    store_.bricks_[brick] = job.place;
    float* const nodes = store_.node(kLatticeFirstBrick + brick * kBrickNodes);
    for (int k = 0; k < 8; ++k) {
        const int node = 18 * bit(k, 0) + 6 * bit(k, 1) + 2 * bit(k, 2);
        std::copy_n(store_.node(job.corner(k)), 4, nodes + 4 * node);
    }
    for (std::size_t p = 0; p < Probes::kAll; ++p) {
        const float* const moved =
            p < Probes::kMiddles ? middles + 3 * p : edges + 3 * (p - Probes::kMiddles);
        std::copy_n(moved, 3, nodes + 4 * kProbes.all[p].node);
    }
    std::int32_t states[kBrickParts];
    judge(job.place, job.half, [&](int n) { return nodes + 4 * n; }, states);
    const int first = kLatticeFirstPart + brick * kBrickParts;
    for (int part = 0; part < kBrickParts; ++part) publish(first + part, states[part]);
    publish(job.number, kBrick + brick);
}

const float* Lattice::Store::Builder::displacements(const float* colours, std::size_t count) {
    moved_.resize(3 * count + 1);
    constexpr std::size_t kMostInRow = 1 << 20;
    for (std::size_t at = 0; at < count; at += kMostInRow) {
        const std::size_t row = std::min(kMostInRow, count - at);
        exact_.row(colours + 3 * at, &moved_[3 * at], static_cast<int>(row), 3);
    }
    exact_.finish();
    for (std::size_t i = 0; i < 3 * count; ++i) moved_[i] -= colours[i];
    store_.colours_ += static_cast<long long>(count);
    return moved_.data();
}

}  // namespace palette4d
