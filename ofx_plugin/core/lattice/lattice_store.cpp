#include "lattice/lattice_store.hpp"

#include <algorithm>
#include <cstdint>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace palette4d {
namespace {

[[maybe_unused]] constexpr std::size_t kHugePage = 2 << 20;
constexpr std::size_t kMostNodes =
    kLatticeFirstBrick + static_cast<std::size_t>(kLatticeBricks) * kBrickNodes;
constexpr std::size_t kMostBricks = kLatticeBricks + kLatticeCells;
constexpr std::size_t kMostStates = kLatticeFirstPart + kMostBricks * kBrickParts;
static_assert(kMostNodes <= 1 << 24 && kMostStates <= 1 << 24, "floats count nodes and parts");
static_assert(PaletteRegions::kMostRegions <= kLatticeMostRegions, "their nodes have room");

/// The margin holds overshoot from filters and codecs. Its width keeps all nodes off 0 and 1:
/// palettes often have faces there, where coordinates need double precision.
constexpr double kMarginCells = 4.1, kMargin = kMarginCells / (kLatticeSide - 2 * kMarginCells);

}  // namespace

#if defined(__linux__)

// Uses pages of 2 MiB where possible: a fault on a new page costs as much time as 40 colours.
Zeros::Zeros(std::size_t bytes) : size_(bytes + kHugePage), data_(nullptr) {
    void* const all = mmap(nullptr, size_, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (all == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<char*>(all);
    taken_ = (kHugePage - reinterpret_cast<std::uintptr_t>(all) % kHugePage) % kHugePage;
    madvise(data_ + taken_, bytes, MADV_HUGEPAGE);
}
Zeros::~Zeros() { munmap(data_, size_); }

#else

Zeros::Zeros(std::size_t bytes) : size_(bytes), data_(static_cast<char*>(std::calloc(bytes, 1))) {
    if (!data_) throw std::bad_alloc();
}
Zeros::~Zeros() { std::free(data_); }

#endif

Lattice::Store::Store(const Recolourer& recolourer)
    : recolourer_(recolourer),
      low_{},
      step_{},
      memory_(kMostNodes * 4 * sizeof(float) + kMostBricks * sizeof(LatticeBrick) +
              kMostStates * sizeof(State) + kLatticeNodes),
      nodes_(memory_.take<float>(4 * kMostNodes)),
      bricks_(memory_.take<LatticeBrick>(kMostBricks)),
      states_(memory_.take<State>(kMostStates)),
      node_states_(memory_.take<std::atomic<std::uint8_t>>(kLatticeNodes)),
      finest_half_(kPartWidth / 2) {
    state(kLatticeOutside) = kExact;
    double farthest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        double low = 0, high = 1;
        for (const Vec3& colour : recolourer.original()) {
            low = std::min(low, colour[c]);
            high = std::max(high, colour[c]);
        }
        const double margin = kMargin * (high - low);
        domain_.low[c] = static_cast<float>(low - margin);
        domain_.high[c] = static_cast<float>(high + margin);
        const double width = high - low + 2 * margin;
        domain_.scale[c] = static_cast<float>(kLatticeSide / width);
        low_[c] = domain_.low[c];
        step_[c] = static_cast<float>(width / (static_cast<double>(kCellWidth) * kLatticeSide));
        farthest = std::max({farthest, -low + margin, high + margin});
    }
    regions_ = PaletteRegions::of(recolourer.body(), recolourer.displacement(), step_, farthest);
    if (!regions_) return;
    add_regions();
    // Parts are cut again only if all parts of the inside would fit. That depends on the palette
    // alone, not on the pictures rendered so far.
    const std::size_t most = regions_->most_inside(low_, kCellWidth, kLatticeSide);
    if (most * (1 + kBrickParts) <= kLatticeBricks) finest_half_ = kPartWidth / 4;
}

void Lattice::Store::add_regions() {
    const int count = static_cast<int>(regions_->planes().size());
    for (const bool exact : {false, true}) {
        const auto state = [&](int side) -> std::int32_t {
            if (side < 0) return lattice_plane(PaletteRegions::chosen(side) + exact * count);
            return side == PaletteRegions::kInside && exact ? kExact : lattice_region(side);
        };
        for (const PaletteRegions::Plane& plane : regions_->planes()) {
            LatticePlane rounded{};
            for (std::size_t c = 0; c < 3; ++c) {
                rounded.normal[c] = static_cast<float>(plane.normal[c]);
            }
            rounded.offset = static_cast<float>(plane.offset);
            rounded.sides[0] = state(plane.below);
            rounded.sides[1] = state(plane.above);
            planes_.push_back(rounded);
        }
    }
    for (std::size_t region = 0; region < regions_->count(); ++region) {
        for (std::size_t k = 0; k < 4; ++k) {
            const Vec3& column = regions_->affine(region)[k];
            float* const to = node(kLatticeFirstRegion + static_cast<int>(4 * region + k));
            for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(column[c]);
        }
    }
}

void Lattice::Store::saw_error(double error) {
    double before = largest_error_.load(std::memory_order_relaxed);
    while (error > before && !largest_error_.compare_exchange_weak(before, error)) {
    }
}

Lattice::Size Lattice::Store::size() const {
    const long long cut = cut_ + cut_empty_;
    return {cells_, cut, kBrickParts * cut, exact_, colours_};
}

}  // namespace palette4d
