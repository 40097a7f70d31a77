// The kernels of lattice_kernels.hpp, compiled for the vector width that lanes.hpp has here.
#include "lattice/lattice_kernels.hpp"

#include "model/alpha.hpp"
#include "simd/four.hpp"
#include "simd/lanes.hpp"

namespace {

using palette4d::LatticeBlock;
using palette4d::LatticeDomain;
using palette4d::LatticePlane;

template <int Channels>
void spread(LatticeBlock& block, const float* from, int count) {
    constexpr int kSize = LatticeBlock::kSize;
    if (count == kSize) {  // constant size: the compiler can unroll this, the usual case
        for (int i = 0; i < kSize; ++i) {
            for (int c = 0; c < 3; ++c) block.colour[c][i] = from[i * Channels + c];
        }
        return;
    }
    for (int i = 0; i < kSize; ++i) {
        for (int c = 0; c < 3; ++c) {
            block.colour[c][i] = i < count ? from[i * Channels + c] : 0.0f;
        }
    }
}

void locate(const LatticeDomain& domain, LatticeBlock& block, const float* from, int channels,
            int count, bool premultiplied) {
    if (channels == 3) {
        spread<3>(block, from, count);
    } else {
        spread<4>(block, from, count);
    }
    if (premultiplied) {
        for (int i = 0; i < count; ++i) {
            const float by = palette4d::divisor(from[i * 4 + 3]);
            for (int c = 0; c < 3; ++c) block.colour[c][i] /= by;
        }
    }
    constexpr float kSide = palette4d::kLatticeSide + 1, kCells = palette4d::kLatticeSide;
    const Lanes<float> zero = all(0.0f), last = all(kCells - 1);
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const Lanes<float> r = load(block.colour[0] + at), g = load(block.colour[1] + at),
                           b = load(block.colour[2] + at);
        const LaneMask<float> inside = (r >= all(domain.low[0])) & (r <= all(domain.high[0])) &
                                       (g >= all(domain.low[1])) & (g <= all(domain.high[1])) &
                                       (b >= all(domain.low[2])) & (b <= all(domain.high[2]));
        const auto place = [&](Lanes<float> x, int c) {
            return select(inside, (x - all(domain.low[c])) * all(domain.scale[c]), zero);
        };
        const Lanes<float> x = place(r, 0), y = place(g, 1), z = place(b, 2);
        const Lanes<float> i = min(truncated(x), last), j = min(truncated(y), last),
                           k = min(truncated(z), last);
        store(block.within[0] + at, x - i);
        store(block.within[1] + at, y - j);
        store(block.within[2] + at, z - k);
        store(block.first + at, (i * all(kSide) + j) * all(kSide) + k);
        store(block.cut + at, zero);
        const Lanes<float> cell = (i * all(kCells) + j) * all(kCells) + k;
        constexpr float kOutside = palette4d::kLatticeOutside;
        store_whole(block.number + at, select(inside, cell, all(kOutside)));
    }
}

void descend(LatticeBlock& block, int count) {
    constexpr float kFirst = palette4d::kLatticeFirstPart, kParts = palette4d::kBrickParts,
                    kFirstNode = palette4d::kLatticeFirstBrick, kNodes = palette4d::kBrickNodes,
                    kLastBrick = palette4d::kLatticeBricks - 1;
    const Lanes<float> zero = all(0.0f), one = all(1.0f), two = all(2.0f), three = all(3.0f);
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const Lanes<float> brick = zero - one - load_whole(block.state + at);
        const LaneMask<float> cut = brick >= zero;
        Lanes<float> half[3];
        for (int c = 0; c < 3; ++c) {
            const Lanes<float> x = load(block.within[c] + at), twice = x + x;
            half[c] = select(twice >= one, one, zero);
            store(block.within[c] + at, select(cut, twice - half[c], x));
        }
        const Lanes<float> part = (half[0] * two + half[1]) * two + half[2],
                           node = (half[0] * three + half[1]) * three + half[2];
        store_whole(block.number + at, select(cut, all(kFirst) + all(kParts) * brick + part,
                                              load_whole(block.number + at)));
        // Bricks without nodes need none; clamping keeps the address inside the array.
        const Lanes<float> nodes = all(kFirstNode) + all(kNodes) * min(brick, all(kLastBrick));
        store(block.first + at, select(cut, nodes + node, load(block.first + at)));
        store(block.cut + at, select(cut, one, load(block.cut + at)));
    }
}

std::int32_t choose_sides(const LatticePlane* planes, LatticeBlock& block, int count) {
    constexpr int kFirst = palette4d::kLatticeFirstPlane;
    int chosen[LatticeBlock::kSize], chosen_count = 0;  // no branch: it would be mispredicted
    for (int i = 0; i < count; ++i) {
        chosen[chosen_count] = i;
        chosen_count += block.state[i] >= kFirst;
    }
    std::int32_t others = 0;
    for (int k = 0; k < chosen_count; ++k) {
        const int i = chosen[k];
        const float r = block.colour[0][i], g = block.colour[1][i], b = block.colour[2][i];
        std::int32_t state = block.state[i];
        do {
            const LatticePlane& plane = planes[(state - kFirst) / 8];
            const float height = plane.normal[0] * r + plane.normal[1] * g + plane.normal[2] * b;
            state = plane.sides[height >= plane.offset];
        } while (state >= kFirst);
        block.state[i] = state;
        others |= state ^ palette4d::kLatticeGood;
    }
    return others & palette4d::kLatticeKind;
}

void weigh(LatticeBlock& block, int count) {
    constexpr float kSide = palette4d::kLatticeSide + 1, kBrickSide = 3;
    constexpr float kGood = palette4d::kLatticeGood, kKind = palette4d::kLatticeKind;
    const Lanes<float> zero = all(0.0f), one = all(1.0f);
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const LaneMask<float> cut = load(block.cut + at) > zero;
        const Lanes<float> x = load(block.within[0] + at), y = load(block.within[1] + at),
                           z = load(block.within[2] + at), first = load(block.first + at);
        const Lanes<float> state = load_whole(block.state + at);
        const LaneMask<float> good = (state >= all(kGood)) & (state <= all(kGood));
        const LaneMask<float> affine = state > all(kKind);
        const bool any_affine = any(affine);
        const Lanes<float> column =
            all(float(palette4d::kLatticeFirstRegion)) + all(0.5f) * (state - all(kGood));
        const auto put = [&](int k, Lanes<float> node, Lanes<float> weight, Lanes<float> factor) {
            node = select(good, node, all(float(palette4d::kLatticeZero)));
            if (any_affine) {
                node = select(affine, column + all(float(k)), node);
                weight = select(affine, factor, weight);
            }
            store_offsets(block.corner[k] + at, node);
            store(block.weight[k] + at, weight);
        };
        const Lanes<float> step_x = select(cut, all(kBrickSide * kBrickSide), all(kSide * kSide)),
                           step_y = select(cut, all(kBrickSide), all(kSide)), step_z = one;
        // Walks the tetrahedron's nodes from the first corner: along the colour's largest
        // coordinate, then its second, then its smallest.
        const LaneMask<float> xy = x >= y, xz = x >= z, yz = y >= z;
        const Lanes<float> longest =
            select(xy, select(xz, step_x, step_z), select(yz, step_y, step_z));
        const Lanes<float> shortest =
            select(xy, select(yz, step_z, step_y), select(xz, step_z, step_x));
        const Lanes<float> end = first + step_x + step_y + step_z;
        const Lanes<float> most = max(max(x, y), z), least = min(min(x, y), z),
                           middle = max(min(x, y), min(max(x, y), z));
        put(0, first, one - most, one);
        put(1, first + longest, most - middle, load(block.colour[0] + at));
        put(2, end - shortest, middle - least, load(block.colour[1] + at));
        put(3, end, least, load(block.colour[2] + at));
    }
}

template <int Channels>
PALETTE4D_INLINE void store_pixel(float* to, Four after) {
    if (Channels == 4) {
        store_four(to, after);
        return;
    }
    // Two doubles in a register: compilers copy twelve bytes through memory.
    typedef double Two __attribute__((vector_size(16)));
    const double red_green = ((Two)after)[0];
    const float blue = after[2];
    std::memcpy(to, &red_green, sizeof red_green);
    std::memcpy(to + 2, &blue, sizeof blue);
}

PALETTE4D_INLINE const float* node_at(const float* nodes, std::size_t bytes) {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(nodes) + bytes);
}

/// The recoloured pixel i of the block.
template <bool Premultiplied>
PALETTE4D_INLINE Four blended(const float* nodes, const LatticeBlock& block, int i, Four before,
                              float strength) {
    const auto part = [&](int k) {
        return block.weight[k][i] * load_four(node_at(nodes, block.corner[k][i]));
    };
    const Four step = strength * ((part(0) + part(1)) + (part(2) + part(3)));
    // The select avoids NaN: alpha may be NaN where the step is 0.
    return where_zero(step, before, before + (Premultiplied ? before[3] : 1.0f) * step);
}

#if defined(PALETTE4D_LANES_X86) && PALETTE4D_LANES_BYTES > 16
/// The same for eight pixels from i on, two in a register, in half the instructions.
template <int Channels, bool Premultiplied>
PALETTE4D_INLINE void blend_eight(const float* nodes, const LatticeBlock& block, int i, bool last,
                                  const float* from, float* to, float strength) {
    const auto join = [](Four a, Four b) {
        return _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1);
    };
    __m256 weights[4];
    for (int k = 0; k < 4; ++k) weights[k] = _mm256_load_ps(block.weight[k] + i);
    const auto blend_two = [&](const int pair) __attribute__((always_inline)) {
        const __m256i both =
            _mm256_set_epi32(pair + 1, pair + 1, pair + 1, pair + 1, pair, pair, pair, pair);
        const auto part = [&](int k) {
            unsigned long long corners;
            std::memcpy(&corners, block.corner[k] + i + pair, sizeof corners);
            return _mm256_mul_ps(_mm256_permutevar8x32_ps(weights[k], both),
                                 join(load_four(node_at(nodes, corners & 0xFFFFFFFF)),
                                      load_four(node_at(nodes, corners >> 32))));
        };
        const float* const one = from + (i + pair) * Channels;
        __m256 before;
        if (Channels == 4) {
            before = _mm256_loadu_ps(one);
        } else if (last && pair == 6) {
            before = join(load_four(one), Four{one[3], one[4], one[5], 0});
        } else {
            before = join(load_four(one), load_four(one + 3));
        }
        const __m256 moved =
            _mm256_add_ps(_mm256_add_ps(part(0), part(1)), _mm256_add_ps(part(2), part(3)));
        __m256 step = _mm256_mul_ps(_mm256_set1_ps(strength), moved);
        const __m256 stays = _mm256_cmp_ps(step, _mm256_setzero_ps(), _CMP_EQ_OQ);
        if (Premultiplied) step = _mm256_mul_ps(_mm256_permute_ps(before, 0xFF), step);
        const __m256 after = _mm256_blendv_ps(_mm256_add_ps(before, step), before, stays);
        float* const there = to + (i + pair) * Channels;
        if (Channels == 4) {
            _mm256_storeu_ps(there, after);
        } else {
            _mm_storeu_ps(there, _mm256_castps256_ps128(after));
            store_pixel<3>(there + 3, _mm256_extractf128_ps(after, 1));
        }
    };
    // Calls spelled out: compilers do not unroll a loop over these constants.
    blend_two(0);
    blend_two(2);
    blend_two(4);
    blend_two(6);
}
#endif

template <int Channels, bool Premultiplied>
void blend_all(const float* nodes, const LatticeBlock& block, int count, const float* from,
               float* to, float strength) {
    int i = 0;
#if defined(PALETTE4D_LANES_X86) && PALETTE4D_LANES_BYTES > 16
    for (; i + 8 <= count; i += 8) {
        blend_eight<Channels, Premultiplied>(nodes, block, i, i + 8 == count, from, to, strength);
    }
#endif
    for (; i < count; ++i) {
        const float* const one = from + i * Channels;
        Four before;
        if (Channels == 4) {
            before = load_four(one);
        } else {  // a fourth float may lie beyond the row
            const float padded[4] = {one[0], one[1], one[2], 0};
            before = load_four(padded);
        }
        store_pixel<Channels>(to + i * Channels,
                              blended<Premultiplied>(nodes, block, i, before, strength));
    }
}

void blend(const float* nodes, const LatticeBlock& block, int count, const float* from, float* to,
           int channels, float strength, bool premultiplied) {
    if (channels == 3) {
        blend_all<3, false>(nodes, block, count, from, to, strength);
    } else if (premultiplied) {
        blend_all<4, true>(nodes, block, count, from, to, strength);
    } else {
        blend_all<4, false>(nodes, block, count, from, to, strength);
    }
}

constexpr palette4d::LatticeKernels kKernels = {&locate, &descend, &choose_sides, &weigh, &blend};

}  // namespace

namespace palette4d {
const LatticeKernels& LatticeKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
