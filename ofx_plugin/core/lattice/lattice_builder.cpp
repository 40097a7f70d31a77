// Builds the cells of a Lattice.
#include <algorithm>
#include <thread>

#include "lattice/lattice_geometry.hpp"
#include "lattice/lattice_store.hpp"
#include "recolour/float_worker.hpp"

namespace palette4d {
namespace {

/// Largest errors allowed where the displacement is smooth (PaletteRegions): at the probes; on
/// lines of three nodes, where the error in between is a quarter; near a palette edge, where probes
/// see least of the bend; and for extrapolation beyond the surface.
constexpr float kMostSmooth = 0.0012f, kMostSmoothInLine = 2.0f * kMostSmooth,
                kMostAtEdge = 0.0004f, kMostBeyond = 0.0003f;
/// Up to this share of the limit at the middles of body and faces, a cell is accepted. Above it the
/// middles of the edges are probed too, whose errors may be half as much again.
constexpr float kSurely = 0.75f;
/// Without PaletteRegions, a crease may lie between nodes, or a jump outside a concavity. So every
/// cell is probed at all these middles.
constexpr float kMostCreased = 0.0006f;

/// The unit of relative errors, as in lattice_error(). `moved` is the palette's displacement.
Four size_of(Four colour, Four moved) {
    const Four exact = colour + moved;
    const Four least = all_four(0.1f);
    return where_negative(colour * exact, least, max(abs(exact), least));
}

Four relative(Four error, Four colour, Four moved) { return abs(error) / size_of(colour, moved); }

/// Whether the displacement below the plane, extended above it, agrees with the affine one there.
/// Tests one of the eight parts of a cube of 3 x 3 x 3 nodes; `columns` are the affine function.
template <class ColourOf>
bool goes_on(const LatticePlane& plane, const float* columns, int part, const Four* moved,
             const ColourOf& colour_of) {
    Four off{};
    for (int corner = 0; corner < 8; ++corner) {
        const int node = 9 * (bit(part, 0) + bit(corner, 0)) + 3 * (bit(part, 1) + bit(corner, 1)) +
                         bit(part, 2) + bit(corner, 2);
        const Four colour = colour_of(node);
        float height = -plane.offset;
        for (int c = 0; c < 3; ++c) height += plane.normal[c] * colour[c];
        if (height < 0) continue;
        Four exact = load_four(columns);
        for (int c = 0; c < 3; ++c) exact = exact + colour[c] * load_four(columns + 4 * (c + 1));
        off = max(off, relative(moved[node] - exact, colour, exact));
    }
    return largest_of(off) <= kMostBeyond;
}

}  // namespace

Lattice::Store::Builder::Builder(Store& store, InstructionSet instructions) : store_(store) {
    RecolourOptions options;
    options.instructions = instructions;
    exact_ = float_worker(store.recolourer_, options, 3, false);
    if (store.regions_) {
        mean_value_ = std::make_unique<MvcWorker>(store.recolourer_, instructions);
    }
}

Lattice::Store::Builder::~Builder() { give_up(); }

void Lattice::Store::Builder::claim(int number, std::int32_t state) {
    // Listed before it is claimed: other threads would wait forever for a claimed cell on no list.
    if (state == kUnknown) {  // the group's first cell represents the group
        const int group = group_of(number);
        groups_.push_back({group, {}});
        if (!store_.state(group).compare_exchange_strong(state, kClaimed)) groups_.pop_back();
    } else if (state == kSuspect) {
        jobs_.push_back(job_of(number));
        if (!store_.state(number).compare_exchange_strong(state, kClaimed)) jobs_.pop_back();
    }
}

void Lattice::Store::Builder::run() noexcept {
    try {
        make_groups();
        make_jobs();
    } catch (...) {
        give_up();  // out of memory
    }
}

/// Claimed cells that were not built are recoloured exactly.
void Lattice::Store::Builder::give_up() noexcept {
    for (const int node : taken_) {
        std::uint8_t taken = kTaken;
        store_.node_states_[node].compare_exchange_strong(taken, kFailed);
    }
    for (const Job& job : jobs_) {
        std::int32_t claimed = kClaimed;
        store_.state(job.number).compare_exchange_strong(claimed, kExact);
    }
    for (const Group& group : groups_) {
        for (int part = 0; part < 8; ++part) publish(group_cell(group.number, part), kExact);
    }
    groups_.clear();
    jobs_.clear();
    taken_.clear();
}

PaletteRegions::Within Lattice::Store::Builder::within(const LatticePlace& place, float half,
                                                       int start) const {
    if (!store_.regions_) return {PaletteRegions::kInside, -1, true};
    const Point centre = centre_of(store_.low_, store_.step_, place, half);
    return store_.regions_->within(centre.at, half, start);
}

PaletteRegions::Within Lattice::Store::Builder::within_part(int brick,
                                                            const LatticePlace& place) const {
    const PaletteRegions::Within found =
        within(place, store_.bricks_[brick].half / 2, PaletteRegions::kInside);
    // Rounding may find a part with some of the inside, but a brick without nodes cannot
    // interpolate it.
    if (brick >= kLatticeBricks && found.inside) return {PaletteRegions::kSeveral, -1, false};
    return found;
}

/// False when none of its cells is interpolated or cut.
bool Lattice::Store::Builder::find_regions(Group& group) const {
    const Cell cell = cell_at(group.number);
    const LatticePlace place = place_of(cell);
    PaletteRegions::Around around{PaletteRegions::kInside, 0, 0};
    if (store_.regions_) {
        const Point centre = centre_of(store_.low_, store_.step_, place, kCellWidth);
        around = store_.regions_->around(centre.at, kCellWidth, around.region);
    }
    const int region = std::max(around.region, +PaletteRegions::kInside);
    const bool whole = around.region == region && around.crossings == 0;
    bool nodes = false;
    for (int part = 0; part < 8; ++part) {
        PaletteRegions::Within& one = group.within[static_cast<std::size_t>(part)];
        one = {region, -1, region == PaletteRegions::kInside};
        if (!whole) {
            const Cell at{cell.x + bit(part, 0), cell.y + bit(part, 1), cell.z + bit(part, 2)};
            one = within(place_of(at), kCellWidth / 2, region);
        }
        nodes |= one.inside;
    }
    return nodes;
}

void Lattice::Store::Builder::make_groups() {
    colours_.clear();
    taken_.clear();
    for (Group& group : groups_) {
        if (find_regions(group)) take_nodes(group.number);
    }
    const float* const moved = node_displacements(colours_.data(), taken_.size());
    for (std::size_t i = 0; i < taken_.size(); ++i) {
        std::copy_n(moved + 3 * i, 3, store_.node(taken_[i]));
        store_.node_states_[taken_[i]].store(kReady, std::memory_order_release);
    }
    for (const Group& group : groups_) publish_group(group);
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

void Lattice::Store::Builder::publish_group(const Group& group) {
    const Cell cell = cell_at(group.number);
    bool known = true;
    const auto node_at = [&](int n) {
        const int node = Cell{cell.x + n / 9, cell.y + n / 3 % 3, cell.z + n % 3}.first_node();
        std::uint8_t state;  // other threads may write it
        while ((state = store_.node_states_[node].load(std::memory_order_acquire)) == kTaken) {
            std::this_thread::yield();
        }
        known &= state == kReady;
        return store_.node(node);
    };
    std::int32_t states[8];
    judge(place_of(cell), kCellWidth, node_at, group.within, states);
    for (int part = 0; part < 8; ++part) {
        publish(group_cell(group.number, part), known ? states[part] : kExact);
    }
    store_.cells_ += 8;
}

/// The states of the eight parts of a cube of 3 x 3 x 3 nodes, `half` of its width apart. A smooth
/// function's error in half of a line is a quarter of that at the line's middle.
template <class NodeAt>
void Lattice::Store::Builder::judge(const LatticePlace& place, float half, const NodeAt& node_at,
                                    const Parts& within, std::int32_t* states) const {
    const auto judge_alike = [&](bool good) {
        for (std::size_t part = 0; part < 8; ++part) {
            states[part] = first_state_of(within[part], good);
        }
    };
    if (std::none_of(within.begin(), within.end(), [](const auto& one) { return one.inside; })) {
        return judge_alike(true);
    }
    Four moved[kBrickNodes];
    for (int n = 0; n < kBrickNodes; ++n) moved[n] = load_four(node_at(n));  // may wait
    if (!store_.regions_) return judge_alike(false);
    const auto colour_of = [&](int n) {
        return colour_at(store_.low_, store_.step_,
                         load_four(place.at) + half * load_four(kPlaces.at[n]));
    };
    Four allowed[kBrickNodes];
    for (int n = 0; n < kBrickNodes; ++n)
        allowed[n] = kMostSmoothInLine * size_of(colour_of(n), moved[n]);
    Four beyond[Lines::kCount], farthest = all_four(-1);
    for (std::size_t i = 0; i < Lines::kCount; ++i) {
        const auto [middle, step] = kLines.all[i];
        const Four value = 0.5f * (moved[middle - step] + moved[middle + step]);
        beyond[i] = abs(value - moved[middle]) - allowed[middle];
        farthest = max(farthest, beyond[i]);
    }
    const bool all_good = largest_of(farthest) <= 0;
    // In a cut cell one part can be good and another not; its lines cannot tell which.
    const bool is_brick = half < kCellWidth;
    for (std::size_t part = 0; part < 8; ++part) {
        bool good = all_good;
        if (!all_good && !is_brick) {
            Four worst = all_four(-1);
            for (const int line : kLines.of_part[part]) worst = max(worst, beyond[line]);
            good = largest_of(worst) <= 0;
        }
        states[part] = first_state_of(within[part], good);
        if (!within[part].inside || states[part] < kLatticeFirstPlane) continue;
        const LatticePlane& plane = store_.planes_[static_cast<std::size_t>(within[part].plane)];
        const int face = plane.sides[1] / 8;  // of the face
        if (goes_on(plane, store_.node(kLatticeFirstRegion + 4 * face), static_cast<int>(part),
                    moved, colour_of)) {
            states[part] = kGood;
        }
    }
}

void Lattice::Store::Builder::make_jobs() {
    constexpr std::size_t kMiddles = Probes::kMiddles, kAll = Probes::kAll;
    to_look_at_.clear();
    errors_.clear();
    middles_.clear();
    long long exact = 0;
    const auto is_last = [&](const Job& job) {
        return job.half <= store_.finest_half_ || (!job.is_cell() && !job.within.inside);
    };
    const auto needs_no_nodes = [&](const Job& job) {
        if (job.within.region != PaletteRegions::kSeveral) return false;
        if (is_last(job)) {
            ++exact;
            publish(job.number, kExact);
            return true;
        }
        if (!job.within.inside) cut(job, nullptr, nullptr);
        return !job.within.inside;
    };
    jobs_.erase(std::remove_if(jobs_.begin(), jobs_.end(), needs_no_nodes), jobs_.end());
    const auto most_of = [&](const Job& job) {
        if (job.within.region == PaletteRegions::kSeveral) return -1.0f;
        if (job.within.edge) return job.is_cell() ? -1.0f : kMostAtEdge;
        return store_.regions_ ? kMostSmooth : kMostCreased;
    };
    float largest = 0;
    const auto settle = [&](const Job& job, float error) {
        const bool good = error <= most_of(job);
        if (good) largest = std::max(largest, error);
        exact += !good;
        publish(job.number, state_of(job.within, good));
    };
    const float* moved = probe(jobs_, 0, kMiddles);
    for (const Job& job : jobs_) {
        const float error = error_of(job, moved, 0, kMiddles), most = most_of(job);
        if ((store_.regions_ && error <= kSurely * most) || (error > most && is_last(job))) {
            settle(job, error);
        } else {
            to_look_at_.push_back(job);
            errors_.push_back(error);
            middles_.insert(middles_.end(), moved, moved + 3 * kMiddles);
        }
        moved += 3 * kMiddles;
    }
    const float* edges = probe(to_look_at_, kMiddles, kAll);
    for (std::size_t i = 0; i < to_look_at_.size(); ++i) {
        const Job& job = to_look_at_[i];
        const float error = std::max(errors_[i], error_of(job, edges, kMiddles, kAll));
        if (error <= most_of(job) || is_last(job)) {
            settle(job, error);
        } else {
            cut(job, &middles_[3 * kMiddles * i], edges);
        }
        edges += 3 * (kAll - kMiddles);
    }
    store_.saw_error(static_cast<double>(largest));
    store_.exact_ += exact;
    jobs_.clear();
}

Lattice::Store::Builder::Job Lattice::Store::Builder::job_of(int number) const {
    if (number < kLatticeCells) {
        const Cell cell = cell_at(number);
        // Search from where its group was searched: from elsewhere, rounding may put a box that
        // touches a wall on the other side. A group found to have no inside has no nodes.
        Group group{group_of(number), {}};
        find_regions(group);
        const int part = 4 * (cell.x % 2) + 2 * (cell.y % 2) + cell.z % 2;
        return {place_of(cell),
                kCellWidth / 2,
                number,
                cell.first_node(),
                kNodeSide * kNodeSide,
                kNodeSide,
                group.within[static_cast<std::size_t>(part)]};
    }
    const int number_of_brick = (number - kLatticeFirstPart) / kBrickParts;
    const int part = (number - kLatticeFirstPart) % kBrickParts;
    const LatticeBrick& brick = store_.bricks_[number_of_brick];
    LatticePlace place = brick.place;
    for (int c = 0; c < 3; ++c) place.at[c] += static_cast<float>(bit(part, c)) * brick.half;
    const int first = kLatticeFirstBrick + number_of_brick * kBrickNodes;
    return {place,
            brick.half / 2,
            number,
            first + bit(part, 0) * 9 + bit(part, 1) * 3 + bit(part, 2),
            9,
            3,
            within_part(number_of_brick, place)};
}

const float* Lattice::Store::Builder::probe(const std::vector<Job>& jobs, std::size_t first,
                                            std::size_t last) {
    const std::size_t count = jobs.size() * (last - first);
    colours_.resize(3 * count + 1);  // store_four() writes one number more
    float* to = colours_.data();
    for (const Job& job : jobs) {
        for (std::size_t p = first; p < last; ++p, to += 3) {
            const Four halves = load_four(kPlaces.at[kProbes.all[p].node]);
            store_four(to, colour_at(store_.low_, store_.step_,
                                     load_four(job.place.at) + job.half * halves));
        }
    }
    return node_displacements(colours_.data(), count);
}

/// The error at the probes `first` to `last` - 1, whose exact displacements are in `moved`.
float Lattice::Store::Builder::error_of(const Job& job, const float* moved, std::size_t first,
                                        std::size_t last) const {
    Four corners[8];
    for (int k = 0; k < 8; ++k) corners[k] = load_four(store_.node(job.corner(k)));
    // The twist of each face's corners shows the error between the probes: for a bilinear function
    // it is a quarter of the twist.
    constexpr int kFaces[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 4, 5},
                                  {2, 3, 6, 7}, {0, 2, 4, 6}, {1, 3, 5, 7}};
    Four twist{};
    for (const auto& f : kFaces) {
        twist = max(twist, abs(corners[f[0]] - corners[f[1]] - corners[f[2]] + corners[f[3]]));
    }
    twist = 0.25f * twist;
    Four worst{};
    for (std::size_t p = first; p < last; ++p, moved += 3) {
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
    const bool empty = !middles;
    const std::int32_t brick = empty ? kLatticeBricks + store_.cut_empty_++ : store_.cut_++;
    if (!empty && brick >= kLatticeBricks) {  // ruled out by most_inside()
        publish(job.number, kExact);
        return;
    }
    store_.bricks_[brick] = {job.place, job.half};
    float* const nodes = empty ? nullptr : store_.node(kLatticeFirstBrick + brick * kBrickNodes);
    for (int k = 0; !empty && k < 8; ++k) {
        const int node = 18 * bit(k, 0) + 6 * bit(k, 1) + 2 * bit(k, 2);
        std::copy_n(store_.node(job.corner(k)), 4, nodes + 4 * node);
    }
    for (std::size_t p = 0; !empty && p < Probes::kAll; ++p) {
        const float* const moved =
            p < Probes::kMiddles ? middles + 3 * p : edges + 3 * (p - Probes::kMiddles);
        std::copy_n(moved, 3, nodes + 4 * kProbes.all[p].node);
    }
    Parts parts;
    for (int part = 0; part < kBrickParts; ++part) {
        LatticePlace place = job.place;
        for (int c = 0; c < 3; ++c) place.at[c] += static_cast<float>(bit(part, c)) * job.half;
        parts[static_cast<std::size_t>(part)] = within_part(brick, place);
    }
    std::int32_t states[kBrickParts];
    judge(job.place, job.half, [&](int n) { return nodes + 4 * n; }, parts, states);
    const int first = kLatticeFirstPart + brick * kBrickParts;
    for (int part = 0; part < kBrickParts; ++part) publish(first + part, states[part]);
    publish(job.number, -1 - brick);
}

/// The state of a cell or part whose inside is interpolated within the tolerance (`good`) or not.
std::int32_t Lattice::Store::Builder::state_of(const PaletteRegions::Within& within,
                                               bool good) const {
    if (within.region == PaletteRegions::kSeveral) return kExact;
    const bool exact = within.inside && !good;
    if (within.plane < 0) return exact ? kExact : lattice_region(within.region);
    const int count = static_cast<int>(store_.planes_.size() / 2);
    return lattice_plane(within.plane + (exact ? count : 0));
}

/// The same before the cell or part is probed.
std::int32_t Lattice::Store::Builder::first_state_of(const PaletteRegions::Within& within,
                                                     bool good) const {
    if (within.region == PaletteRegions::kSeveral || (within.inside && (!good || within.edge)))
        return kSuspect;
    return state_of(within, good);
}

const float* Lattice::Store::Builder::node_displacements(const float* colours, std::size_t count) {
    if (!mean_value_) return displacements(colours, count);
    moved_.resize(3 * count + 1);
    mean_value_->displacements(colours, count, moved_.data());
    store_.colours_ += static_cast<long long>(count);
    return moved_.data();
}

const float* Lattice::Store::Builder::displacements(const float* colours, std::size_t count) {
    moved_.resize(3 * count + 1);
    constexpr std::size_t kMostInRow = 1 << 20;
    for (std::size_t at = 0; at < count; at += kMostInRow) {
        const std::size_t row = std::min(kMostInRow, count - at);
        exact_->row(colours + 3 * at, &moved_[3 * at], static_cast<int>(row));
    }
    exact_->finish();
    for (std::size_t i = 0; i < 3 * count; ++i) moved_[i] -= colours[i];
    store_.colours_ += static_cast<long long>(count);
    return moved_.data();
}

}  // namespace palette4d
