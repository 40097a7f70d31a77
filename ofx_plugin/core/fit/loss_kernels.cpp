// The kernels of loss_kernels.hpp, compiled for the vector width that lanes.hpp has here. Results
// depend on the single box or colour only.
#include "fit/loss_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

void reach(const palette4d::LossFacet* facets, const int* which, int count,
           const double (*sides)[3][palette4d::LossKernels::kBoxes], double flat,
           unsigned* reached) {
    using Numbers = Lanes<double>;
    for (int i = 0; i < count; ++i) {
        const palette4d::LossFacet& f = facets[which[i]];
        // The corner of each box that is farthest along the normal.
        const double *const x = sides[f.high[0]][0], *const y = sides[f.high[1]][1],
                            *const z = sides[f.high[2]][2];
        unsigned found = 0;
        for (int at = 0; at < palette4d::LossKernels::kBoxes; at += Numbers::kCount) {
            const Numbers high = ((all(f.offset) + all(f.normal[0]) * load(x + at)) +
                                  all(f.normal[1]) * load(y + at)) +
                                 all(f.normal[2]) * load(z + at);
            found |= bits(high > all(flat)) << at;
        }
        reached[i] = found;
    }
}

PALETTE4D_INLINE Lanes<double> height_above(const palette4d::LossFacet& f, const Lanes<double>& x,
                                            const Lanes<double>& y, const Lanes<double>& z) {
    return ((all(f.normal[0]) * x + all(f.normal[1]) * y) + all(f.normal[2]) * z) + all(f.offset);
}

/// The closest edge of the facets that a colour sees; the first one of equally close edges.
PALETTE4D_INLINE void closest_edge(const palette4d::LossFacet* facets, const int* which, int count,
                                   const Lanes<double>& x, const Lanes<double>& y,
                                   const Lanes<double>& z, const LaneMask<double>& wanted,
                                   double flat, Lanes<double>& distance, Lanes<double>& edge,
                                   Lanes<double>& along) {
    using Numbers = Lanes<double>;
    const Numbers zero = all(0.0), one = all(1.0);
    Numbers nearest = all(HUGE_VAL);
    edge = along = zero;
    for (int i = 0; i < count; ++i) {
        const palette4d::LossFacet& f = facets[which[i]];
        const LaneMask<double> seen = wanted & (height_above(f, x, y, z) > all(flat));
        if (!any(seen)) continue;
        for (int e = 0; e < 3; ++e) {
            const palette4d::LossEdge& side = f.edges[e];
            const Numbers ax = all(side.along[0]), ay = all(side.along[1]), az = all(side.along[2]);
            const Numbers px = x - all(side.from[0]), py = y - all(side.from[1]),
                          pz = z - all(side.from[2]);
            Numbers s = ((px * ax + py * ay) + pz * az) * all(side.inverse_length2);
            s = select(s < zero, zero, select(one < s, one, s));
            const Numbers dx = px - s * ax, dy = py - s * ay, dz = pz - s * az;
            const Numbers d2 = (dx * dx + dy * dy) + dz * dz;
            const LaneMask<double> nearer = seen & (d2 < nearest);
            nearest = select(nearer, d2, nearest);
            edge = select(nearer, all(static_cast<double>(3 * which[i] + e)), edge);
            along = select(nearer, s, along);
        }
    }
    distance = select(wanted, sqrt(nearest), distance);
}

bool fall(const palette4d::LossFacet* facets, const int* which, int count,
          const double* const* channels, int size, double flat, palette4d::LossLeaf& leaf) {
    using Numbers = Lanes<double>;
    const Numbers zero = all(0.0), one = all(1.0), none = all(-1.0);
    bool some = false;
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at), y = load(channels[1] + at),
                      z = load(channels[2] + at);
        Numbers highest = zero, on = none, distance = zero, first = zero, second = zero;
        for (int i = 0; i < count; ++i) {
            const palette4d::LossFacet& f = facets[which[i]];
            const auto linear = [&](const double* slope, double start) {
                return ((all(slope[0]) * x + all(slope[1]) * y) + all(slope[2]) * z) + all(start);
            };
            const Numbers h = height_above(f, x, y, z);
            highest = max(highest, h);
            const LaneMask<double> above = h > all(flat);  // a branch would often be mispredicted
            const Numbers b = linear(f.slope[0], f.start[0]), c = linear(f.slope[1], f.start[1]);
            const LaneMask<double> here =
                above & (b >= zero) & (c >= zero) & (b + c <= one) & (on < zero);
            on = select(here, all(static_cast<double>(which[i])), on);
            distance = select(here, h, distance);
            first = select(here, b, first);
            second = select(here, c, second);
        }
        const LaneMask<double> outside = highest > all(flat), beside = outside & (on < zero);
        some |= any(outside);
        if (any(beside)) {
            Numbers edge, along;
            closest_edge(facets, which, count, x, y, z, beside, flat, distance, edge, along);
            store(leaf.edge + at, edge);
            store(leaf.along + at, along);
        }
        store(leaf.distance + at, distance);
        store(leaf.facet + at, on);
        store(leaf.share[0] + at, first);
        store(leaf.share[1] + at, second);
    }
    return some;
}

void pull(const double* counts, int size, const palette4d::LossReach& reach,
          palette4d::LossLeaf& leaf) {
    using Numbers = Lanes<double>;
    const Numbers zero = all(0.0), one = all(1.0);
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers n = load(counts + at), d = load(leaf.distance + at);
        const Numbers cubed = all(reach.far) * d * d * d,
                      bound = one / (one + cubed / all(reach.most));
        const Numbers weight = cubed * bound;
        store(leaf.weighted + at, n * d);
        store(leaf.far_weighted + at, n * weight * d);
        store(leaf.counted + at, select(d > all(reach.slight), n, zero));
        store(leaf.pull + at, n * (one + weight * (one + all(3.0) * bound)));
    }
}

void from_boxes(const double (*sides)[3][palette4d::LossKernels::kBoxes], const double* colour,
                double* squared) {
    using Numbers = Lanes<double>;
    const Numbers zero = all(0.0);
    for (int at = 0; at < palette4d::LossKernels::kBoxes; at += Numbers::kCount) {
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

void from_colours(const double* const* channels, int size, const double* colour, double* squared) {
    using Numbers = Lanes<double>;
    for (int at = 0; at < size; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at) - all(colour[0]),
                      y = load(channels[1] + at) - all(colour[1]),
                      z = load(channels[2] + at) - all(colour[2]);
        store(squared + at, (x * x + y * y) + z * z);
    }
}

constexpr palette4d::LossKernels kKernels = {&reach, &fall, &from_boxes, &from_colours, &pull};

}  // namespace

namespace palette4d {
const LossKernels& LossKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
