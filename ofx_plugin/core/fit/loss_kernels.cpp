// The kernels of loss_kernels.hpp, compiled for the vector width that lanes.hpp has here. Results
// depend on the single box or colour only.
#include "fit/loss_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using Numbers = Lanes<double>;
using Mask = LaneMask<double>;
using palette4d::LossEdge, palette4d::LossFacet, palette4d::LossKernels, palette4d::LossLeaf,
    palette4d::LossLoad, palette4d::LossReach, palette4d::LossSums;

void reach(const LossFacet* facets, const int* which, int count,
           const double (*sides)[3][LossKernels::kBoxes], double flat, unsigned* reached) {
    for (int i = 0; i < count; ++i) {
        const LossFacet& f = facets[which[i]];
        // The corner of each box that is farthest along the normal.
        const double *const x = sides[f.high[0]][0], *const y = sides[f.high[1]][1],
                            *const z = sides[f.high[2]][2];
        unsigned found = 0;
        for (int at = 0; at < LossKernels::kBoxes; at += Numbers::kCount) {
            const Numbers high = ((all(f.offset) + all(f.normal[0]) * load(x + at)) +
                                  all(f.normal[1]) * load(y + at)) +
                                 all(f.normal[2]) * load(z + at);
            found |= bits(high > all(flat)) << at;
        }
        reached[i] = found;
    }
}

void fall(const LossFacet* facets, const int* which, int count, const double* const* channels,
          int size, double flat, LossLeaf& leaf) {
    const Numbers zero = all(0.0), one = all(1.0), none = all(-1.0);
    unsigned outside = 0, beside = 0;
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at), y = load(channels[1] + at),
                      z = load(channels[2] + at);
        Numbers highest = zero, on = none, distance = zero, first = zero, second = zero;
        for (int i = 0; i < count; ++i) {
            const LossFacet& f = facets[which[i]];
            const auto linear = [&](const double* slope, double start) {
                return ((all(slope[0]) * x + all(slope[1]) * y) + all(slope[2]) * z) + all(start);
            };
            const Numbers h = linear(f.normal, f.offset);
            highest = max(highest, h);
            const Mask above = h > all(flat);  // a branch would often be mispredicted
            const Numbers b = linear(f.slope[0], f.start[0]), c = linear(f.slope[1], f.start[1]);
            const Mask here = above & (b >= zero) & (c >= zero) & (b + c <= one) & (on < zero);
            on = select(here, all(static_cast<double>(which[i])), on);
            distance = select(here, h, distance);
            first = select(here, b, first);
            second = select(here, c, second);
        }
        const Mask out = highest > all(flat);
        outside |= bits(out) << at;
        beside |= bits(out & (on < zero)) << at;
        store(leaf.distance + at, distance);
        store(leaf.facet + at, on);
        store(leaf.share[0] + at, first);
        store(leaf.share[1] + at, second);
    }
    const unsigned own = (1u << size) - 1;  // without the padding
    leaf.outside = outside & own;
    leaf.beside = beside & own;
}

void to_edges(const LossEdge* edges, int count, const double* const* channels, int size,
              LossLeaf& leaf) {
    const Numbers zero = all(0.0), one = all(1.0);
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at), y = load(channels[1] + at),
                      z = load(channels[2] + at);
        Numbers nearest = all(HUGE_VAL), edge = zero, along = zero;
        for (int i = 0; i < count; ++i) {
            const LossEdge& e = edges[i];
            const Numbers ax = all(e.along[0]), ay = all(e.along[1]), az = all(e.along[2]);
            const Numbers px = x - all(e.from[0]), py = y - all(e.from[1]), pz = z - all(e.from[2]);
            Numbers s = ((px * ax + py * ay) + pz * az) * all(e.inverse_length2);
            s = max(zero, min(one, s));
            const Numbers dx = px - s * ax, dy = py - s * ay, dz = pz - s * az;
            const Numbers d2 = (dx * dx + dy * dy) + dz * dz;
            const Mask nearer = d2 < nearest;
            nearest = min(nearest, d2);
            edge = select(nearer, all(static_cast<double>(i)), edge);
            along = select(nearer, s, along);
        }
        store(leaf.distance + at, sqrt(nearest));
        store(leaf.edge + at, edge);
        store(leaf.along + at, along);
    }
}

alignas(64) constexpr double kLane[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
static_assert(sizeof kLane / sizeof *kLane == LossLeaf::kSize, "a number for each lane");

void pull(const double* counts, int size, const LossReach& reach, LossLeaf& leaf, LossSums& sums) {
    const Numbers zero = all(0.0), one = all(1.0), slope = all(1 / reach.most);
    for (int at = 0; at < LossLeaf::kSize; at += Numbers::kCount) {
        const Mask own = load(kLane + at) < all(static_cast<double>(size));
        const Numbers n = select(own, load(counts + at), zero),
                      d = select(own, load(leaf.distance + at), zero);
        const Numbers cubed = all(reach.far) * d * d * d, bound = one / (one + cubed * slope),
                      weight = cubed * bound;
        const auto add = [at](double* sum, const Numbers& part) {
            store(sum + at, load(sum + at) + part);
        };
        add(sums.distance, n * d);
        add(sums.far_distance, n * weight * d);
        add(sums.counted, select(d > all(reach.slight), n, zero));
        store(sums.most + at, max(load(sums.most + at), d));
        store(leaf.pull + at, n * (one + weight * (one + all(3.0) * bound)));
    }
}

void press(const int* which, int count, const LossLeaf& leaf, LossLoad* loads) {
    for (int at = 0; at < LossLeaf::kSize; at += Numbers::kCount) {
        const Numbers on = load(leaf.facet + at), all_of_it = load(leaf.pull + at),
                      first = all_of_it * load(leaf.share[0] + at),
                      second = all_of_it * load(leaf.share[1] + at);
        for (int i = 0; i < count; ++i) {
            const Numbers facet = all(static_cast<double>(which[i]));
            const Mask here = (on >= facet) & (on <= facet);
            LossLoad& to = loads[which[i]];
            const auto add = [&](double* sum, const Numbers& part) {
                store(sum + at, load(sum + at) + select(here, part, all(0.0)));
            };
            add(to.all, all_of_it);
            add(to.corner[0], first);
            add(to.corner[1], second);
        }
    }
}

void from_boxes(const double (*sides)[3][LossKernels::kBoxes], const double* colour,
                double* squared) {
    const Numbers zero = all(0.0);
    for (int at = 0; at < LossKernels::kBoxes; at += Numbers::kCount) {
        Numbers sum = zero;
        for (int c = 0; c < 3; ++c) {
            const Numbers below = load(sides[0][c] + at) - all(colour[c]),
                          above = all(colour[c]) - load(sides[1][c] + at),
                          beside = select(below > above, below, above),
                          outside = select(beside > zero, beside, zero);
            sum = sum + outside * outside;
        }
        store(squared + at, sum);
    }
}

unsigned from_colours(const double* const* channels, int size, const double* colour, double limit,
                      double* squared) {
    unsigned near = 0;
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at) - all(colour[0]),
                      y = load(channels[1] + at) - all(colour[1]),
                      z = load(channels[2] + at) - all(colour[2]);
        const Numbers sum = (x * x + y * y) + z * z;
        near |= bits(sum <= all(limit)) << at;
        store(squared + at, sum);
    }
    return near & ((1u << size) - 1);
}

constexpr LossKernels kKernels = {&reach, &fall,       &to_edges,    &pull,
                                  &press, &from_boxes, &from_colours};

}  // namespace

namespace palette4d {
const LossKernels& LossKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
