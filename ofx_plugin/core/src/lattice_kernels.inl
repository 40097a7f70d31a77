// The kernels of lattice_kernels.hpp for the width that lanes.hpp was included with.

namespace {

using palette4d::LatticeBlock;
using palette4d::LatticeDomain;

template <int Channels>
void spread(LatticeBlock& block, const float* from, int count) {
    constexpr int kSize = LatticeBlock::kSize;
    if (count == kSize) {  // a length the compiler knows, for the many
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
            const float alpha = from[i * 4 + 3];
            const float bad = 0 * alpha;  // NaN where it is not finite
            for (int c = 0; c < 3; ++c) block.colour[c][i] = block.colour[c][i] / alpha + bad;
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
                    kCellNodes = palette4d::kLatticeNodes, kNodes = palette4d::kBrickNodes;
    const Lanes<float> zero = all(0.0f), one = all(1.0f), two = all(2.0f), three = all(3.0f);
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const Lanes<float> brick =
            load_whole(block.state + at) - all(float(palette4d::kLatticeBrick));
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
        store(block.first + at,
              select(cut, all(kCellNodes) + all(kNodes) * brick + node, load(block.first + at)));
        store(block.cut + at, select(cut, one, load(block.cut + at)));
    }
}

void weigh(LatticeBlock& block, int count) {
    constexpr float kSide = palette4d::kLatticeSide + 1, kBrickSide = 3;
    const Lanes<float> zero = all(0.0f), one = all(1.0f);
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const LaneMask<float> cut = load(block.cut + at) > zero;
        const Lanes<float> x = load(block.within[0] + at), y = load(block.within[1] + at),
                           z = load(block.within[2] + at), first = load(block.first + at);
        const Lanes<float> step_x = select(cut, all(kBrickSide * kBrickSide), all(kSide * kSide)),
                           step_y = select(cut, all(kBrickSide), all(kSide)), step_z = one;
        // From the first corner along the axis that the colour is farthest along, then along the
        // second, then the last.
        const LaneMask<float> xy = x >= y, xz = x >= z, yz = y >= z;
        const Lanes<float> longest =
            select(xy, select(xz, step_x, step_z), select(yz, step_y, step_z));
        const Lanes<float> shortest =
            select(xy, select(yz, step_z, step_y), select(xz, step_z, step_x));
        const Lanes<float> end = first + step_x + step_y + step_z;
        store_offsets(block.corner[0] + at, first);
        store_offsets(block.corner[1] + at, first + longest);
        store_offsets(block.corner[2] + at, end - shortest);
        store_offsets(block.corner[3] + at, end);
        const Lanes<float> most = max(max(x, y), z), least = min(min(x, y), z),
                           middle = max(min(x, y), min(max(x, y), z));
        store(block.weight[0] + at, one - most);
        store(block.weight[1] + at, most - middle);
        store(block.weight[2] + at, middle - least);
        store(block.weight[3] + at, least);
    }
}

#if defined(__GNUC__)
typedef float Four __attribute__((vector_size(16)));
#else
struct Four {
    float at[4];
    float operator[](int c) const { return at[c]; }
};
inline Four operator+(Four a, Four b) {
    return {{a.at[0] + b.at[0], a.at[1] + b.at[1], a.at[2] + b.at[2], a.at[3] + b.at[3]}};
}
inline Four operator*(float s, Four a) {
    return {{s * a.at[0], s * a.at[1], s * a.at[2], s * a.at[3]}};
}
#endif

PALETTE4D_INLINE Four load_four(const float* from) {
    Four r;
    std::memcpy(&r, from, sizeof r);
    return r;
}

PALETTE4D_INLINE Four step_from(Four before, Four step) {
#if defined(__GNUC__)
    return step != 0.0f ? before + step : before;
#else
    Four r = before;
    for (int c = 0; c < 4; ++c) {
        if (step.at[c] != 0) r.at[c] = before.at[c] + step.at[c];
    }
    return r;
#endif
}

template <int Channels>
PALETTE4D_INLINE void store_pixel(float* to, Four after) {
    if (Channels == 4) {
        std::memcpy(to, &after, sizeof after);
        return;
    }
    // Not through memory, as compilers copy twelve bytes of a register.
#if defined(__GNUC__)
    typedef double Two __attribute__((vector_size(16)));
    const double red_green = ((Two)after)[0];
    const float blue = after[2];
    std::memcpy(to, &red_green, sizeof red_green);
    std::memcpy(to + 2, &blue, sizeof blue);
#else
    std::memcpy(to, &after, 3 * sizeof(float));
#endif
}

/// What pixel i of the block becomes.
template <int Channels, bool Premultiplied>
PALETTE4D_INLINE Four blended(const float* nodes, const LatticeBlock& block, int i, Four before,
                              float strength) {
    const auto part = [&](int k) {
        const auto at = static_cast<std::size_t>(block.corner[k][i]);
        return block.weight[k][i] *
               load_four(reinterpret_cast<const float*>(reinterpret_cast<const char*>(nodes) + at));
    };
    const Four moved = (part(0) + part(1)) + (part(2) + part(3));
    Four step = strength * moved;
    if (Premultiplied) step = before[3] * step;
    return step_from(before, step);
}

template <int Channels, bool Premultiplied>
void blend_run(const float* nodes, const LatticeBlock& block, int begin, int end, const float* from,
               float* to, int count, float strength) {
    const auto pixel = [&](int i) {
        if (Channels == 4 || i + 1 < count) return load_four(from + i * Channels);
        // What lies behind the last of three channels is nobody's.
        const float* rgb = from + i * 3;
        const float padded[4] = {rgb[0], rgb[1], rgb[2], 0};
        return load_four(padded);
    };
    const int last = end - 1;
    Four before = pixel(begin);
    for (int i = begin; i < last; ++i) {
        // Loaded before the store, which reaches into the next pixel where there are three
        // channels, and `to` may be `from`.
        const Four next = pixel(i + 1);
        const Four after = blended<Channels, Premultiplied>(nodes, block, i, before, strength);
        std::memcpy(to + i * Channels, &after, sizeof after);
        before = next;
    }
    store_pixel<Channels>(to + last * Channels,
                          blended<Channels, Premultiplied>(nodes, block, last, before, strength));
}

void blend(const float* nodes, const LatticeBlock& block, int begin, int end, const float* from,
           float* to, int channels, int count, float strength, bool premultiplied) {
    if (channels == 3) {
        blend_run<3, false>(nodes, block, begin, end, from, to, count, strength);
    } else if (premultiplied) {
        blend_run<4, true>(nodes, block, begin, end, from, to, count, strength);
    } else {
        blend_run<4, false>(nodes, block, begin, end, from, to, count, strength);
    }
}

}  // namespace

#define PALETTE4D_KERNEL_SET                                                       \
    namespace {                                                                    \
    constexpr palette4d::KernelSet kKernels = {                                    \
        {&classify<float>, &mean_value<float>, &closest<float>, &move<float>},     \
        {&classify<double>, &mean_value<double>, &closest<double>, &move<double>}, \
        {&locate, &descend, &weigh, &blend},                                       \
        {&fall},                                                                   \
    };                                                                             \
    }
