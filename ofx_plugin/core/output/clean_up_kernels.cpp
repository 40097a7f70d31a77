// The kernels of clean_up_kernels.hpp, compiled for each instruction set. Sums have a fixed order,
// so that all sets, tiles and threads give the same bits.
#include "output/clean_up_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using palette4d::CleanUpKernels;
using palette4d::kCleanUpFaint;
using palette4d::kCleanUpGuideSums;
using palette4d::kCleanUpMost;
using palette4d::kCleanUpMoved;
using palette4d::kCleanUpNoise;
using palette4d::kCleanUpReach;
using palette4d::kCleanUpRows;
using palette4d::kCleanUpSums;
using palette4d::kCleanUpTerms;

constexpr int kSize = CleanUpKernels::kSize;
constexpr int kWide = kSize + 2 * kCleanUpReach;

void check(CleanUpKernels::Channels colour, const float* alpha, float* __restrict counts) {
    for (int channel = 0; alpha && channel < 3; ++channel) {
        float* __restrict const to = colour[channel];
        for (int i = 0; i < kSize; ++i) {
            // NaN where alpha is not finite; by 0, infinity or NaN.
            to[i] = to[i] / alpha[i] + 0 * alpha[i];
        }
    }
    for (int i = 0; i < kSize; ++i) {
        // 0 times what is not finite is NaN.
        const float test = 0 * colour[0][i] + 0 * colour[1][i] + 0 * colour[2][i];
        counts[i] = test == 0 ? 1.0f : 0.0f;
    }
    for (int channel = 0; channel < 3; ++channel) {
        float* __restrict const to = colour[channel];
        for (int i = 0; i < kSize; ++i) to[i] = counts[i] != 0 ? to[i] : 0.0f;
    }
}

void limit(CleanUpKernels::ConstChannels colour, CleanUpKernels::Channels guide) {
    const Lanes<float> zero = all(0.0f), one = all(1.0f);
    for (int channel = 0; channel < 3; ++channel) {
        for (int at = 0; at < kSize; at += Lanes<float>::kCount) {
            // 2 - 1 / x above 1, x / (1 - x) below 0.
            const Lanes<float> x = load(colour[channel] + at);
            const Lanes<float> start = select(x > one, one, zero);
            const Lanes<float> by = select(x > one, x, one - min(x, zero));
            store(guide[channel] + at, start + (x - start) / by);
        }
    }
}

bool keep(const float* __restrict counts, CleanUpKernels::Channels moved) {
    int some = 0;
    for (int channel = 0; channel < kCleanUpMoved; ++channel) {
        float* __restrict const to = moved[channel];
        const int counted = channel < 3 ? 1 : 0;
        for (int i = 0; i < kSize; ++i) {
            const float kept = counts[i] != 0 ? to[i] : 0.0f;
            to[i] = kept;
            some |= kept != 0 ? counted : 0;
        }
    }
    return some != 0;
}

/// Adds `Width` pixels of each cell, from slot `start` on, in order.
template <int Width>
inline __attribute__((always_inline)) void add_some(CleanUpKernels::ConstChannels guide,
                                                    CleanUpKernels::ConstChannels moved,
                                                    const float* counts, int start, int columns,
                                                    int cells, double* sums, std::ptrdiff_t plane) {
    double* __restrict to[kCleanUpGuideSums];
    for (int p = 0; p < kCleanUpGuideSums; ++p) to[p] = sums + p * plane;
    for (int c = 0; c < columns; ++c) {
        double sum[kCleanUpGuideSums];
        for (int p = 0; p < kCleanUpGuideSums; ++p) sum[p] = to[p][c];
        for (int k = 0; k < Width; ++k) {
            const int slot = start + k * cells + c;
            const double red = guide[0][slot], green = guide[1][slot], blue = guide[2][slot];
            sum[0] += counts[slot];
            sum[1] += red;
            sum[2] += green;
            sum[3] += blue;
            sum[4] += red * red;
            sum[5] += red * green;
            sum[6] += red * blue;
            sum[7] += green * green;
            sum[8] += green * blue;
            sum[9] += blue * blue;
        }
        for (int p = 0; p < kCleanUpGuideSums; ++p) to[p][c] = sum[p];
    }
    if (!moved) return;
    for (int d = 0; d < kCleanUpMoved; ++d) {
        double* __restrict const first = sums + (kCleanUpGuideSums + d) * plane;
        double* __restrict const with_red = first + kCleanUpMoved * plane;
        double* __restrict const with_green = with_red + kCleanUpMoved * plane;
        double* __restrict const with_blue = with_green + kCleanUpMoved * plane;
        for (int c = 0; c < columns; ++c) {
            double sum = first[c], red = with_red[c], green = with_green[c], blue = with_blue[c];
            for (int k = 0; k < Width; ++k) {
                const int slot = start + k * cells + c;
                const double step = moved[d][slot];
                sum += step;
                red += guide[0][slot] * step;
                green += guide[1][slot] * step;
                blue += guide[2][slot] * step;
            }
            first[c] = sum;
            with_red[c] = red;
            with_green[c] = green;
            with_blue[c] = blue;
        }
    }
}

void add(CleanUpKernels::ConstChannels guide, CleanUpKernels::ConstChannels moved,
         const float* counts, int columns, int cells, int width, double* sums,
         std::ptrdiff_t plane) {
    if (width == 4) {
        add_some<4>(guide, moved, counts, 0, columns, cells, sums, plane);
        return;
    }
    for (int k = 0; k < width; ++k) {
        add_some<1>(guide, moved, counts, k * cells, columns, cells, sums, plane);
    }
}

/// Sums over the cells around columns [from, from + count): down, then along.
template <int Planes>
inline __attribute__((always_inline)) void around(const double* const* rows, std::ptrdiff_t plane,
                                                  int from, int count, double (*sums)[kSize]) {
    static_assert(kCleanUpRows == 5, "the sums below have five terms");
    for (int p = 0; p < Planes; ++p) {
        double down[kWide];
        const std::ptrdiff_t at = p * plane + from;
        const double *const a = rows[0] + at, *const b = rows[1] + at, *const c = rows[2] + at,
                            *const d = rows[3] + at, *const e = rows[4] + at;
        for (int i = 0; i < count + 2 * kCleanUpReach; ++i) {
            down[i] = a[i] + b[i] + c[i] + d[i] + e[i];
        }
        for (int i = 0; i < count; ++i) {
            sums[p][i] = down[i] + down[i + 1] + down[i + 2] + down[i + 3] + down[i + 4];
        }
    }
}

void fit_some(const double* const* rows, std::ptrdiff_t plane, int from, int count, double* terms) {
    double sums[kCleanUpSums][kSize];
    around<kCleanUpSums>(rows, plane, from, count, sums);
    double found[kCleanUpTerms][kSize];
    for (int i = 0; i < count; ++i) {
        const double n = sums[0][i];
        const double share = n > 0 ? 1 / n : 0.0;
        const double r = share * sums[1][i], g = share * sums[2][i], b = share * sums[3][i];
        // The lower triangle of covariance + noise = L D L^T. Its pivots are at least the noise,
        // but for rounding.
        const double rr = share * sums[4][i] - r * r + kCleanUpNoise;
        const double rg = share * sums[5][i] - r * g, rb = share * sums[6][i] - r * b;
        const double gg = share * sums[7][i] - g * g + kCleanUpNoise;
        const double gb = share * sums[8][i] - g * b;
        const double bb = share * sums[9][i] - b * b + kCleanUpNoise;
        const double d0 = 1 / (rr > kCleanUpNoise ? rr : kCleanUpNoise);
        const double l10 = rg * d0, l20 = rb * d0;
        const double p1 = gg - l10 * rg;
        const double d1 = 1 / (p1 > kCleanUpNoise ? p1 : kCleanUpNoise);
        const double below = gb - l10 * rb, l21 = below * d1;
        const double p2 = bb - l20 * rb - l21 * below;
        const double d2 = 1 / (p2 > kCleanUpNoise ? p2 : kCleanUpNoise);
        for (int d = 0; d < kCleanUpMoved; ++d) {
            const double mean = share * sums[10 + d][i];
            const double y0 = share * sums[14 + d][i] - r * mean;
            const double y1 = share * sums[18 + d][i] - g * mean - l10 * y0;
            const double y2 = share * sums[22 + d][i] - b * mean - l20 * y0 - l21 * y1;
            const double x2 = y2 * d2;
            const double x1 = y1 * d1 - l21 * x2;
            const double x0 = y0 * d0 - l10 * x1 - l20 * x2;
            found[d][i] = x0;
            found[4 + d][i] = x1;
            found[8 + d][i] = x2;
            found[12 + d][i] = mean - x0 * r - x1 * g - x2 * b;
        }
    }
    for (int p = 0; p < kCleanUpTerms; ++p) {
        double* const to = terms + p * plane + kCleanUpReach + from;
        for (int i = 0; i < count; ++i) to[i] = found[p][i];
    }
}

void fit(const double* const* rows, std::ptrdiff_t plane, int from, int to, double* terms) {
    for (int at = from; at < to; at += kSize) {
        fit_some(rows, plane, at, to - at < kSize ? to - at : kSize, terms);
    }
}

void smooth(const double* const* rows, std::ptrdiff_t plane, int from, int to, float* terms,
            std::ptrdiff_t terms_plane) {
    for (int at = from; at < to; at += kSize) {
        const int count = to - at < kSize ? to - at : kSize;
        double sums[kCleanUpTerms + 1][kSize];
        around<kCleanUpTerms + 1>(rows, plane, at, count, sums);
        double share[kSize];
        for (int i = 0; i < count; ++i) {
            const double weight = sums[kCleanUpTerms][i];
            share[i] = weight > 0 ? 1 / weight : 0.0;
        }
        for (int p = 0; p < kCleanUpTerms; ++p) {
            float* const result = terms + p * terms_plane + at;
            for (int i = 0; i < count; ++i) {
                result[i] = static_cast<float>(share[i] * sums[p][i]);
            }
        }
    }
}

void apply(const CleanUpKernels::Nodes& nodes, CleanUpKernels::ConstChannels guide,
           CleanUpKernels::ConstChannels moved, const float* counts, float filtered, float own,
           CleanUpKernels::Channels change) {
    const int cells = nodes.cells;
    float terms[kCleanUpTerms][kSize + 1], steps[kCleanUpTerms][kSize];
    for (int p = 0; p < kCleanUpTerms; ++p) {
        const float *const low = nodes.low + p * nodes.plane, *const high =
                                                                  nodes.high + p * nodes.plane;
        for (int c = 0; c <= cells; ++c) terms[p][c] = low[c] + nodes.part * (high[c] - low[c]);
        for (int c = 0; c < cells; ++c) steps[p][c] = terms[p][c + 1] - terms[p][c];
    }
    for (int k = 0; k < nodes.width; ++k) {
        const float part = nodes.parts[k];
        const int slot = k * cells;
        const float *const r = guide[0] + slot, *const g = guide[1] + slot,
                           *const b = guide[2] + slot, *const n = counts + slot;
        float scale[kSize];
        for (int d = kCleanUpMoved - 1; d >= 0; --d) {
            float found[kSize];
            for (int c = 0; c < cells; ++c) {
                const float x0 = terms[d][c] + part * steps[d][c];
                const float x1 = terms[4 + d][c] + part * steps[4 + d][c];
                const float x2 = terms[8 + d][c] + part * steps[8 + d][c];
                const float rest = terms[12 + d][c] + part * steps[12 + d][c];
                found[c] = x0 * r[c] + x1 * g[c] + x2 * b[c] + rest;
            }
            if (d == 3) {
                for (int c = 0; c < cells; ++c) {
                    const float share = found[c] > 0 ? found[c] : 0.0f;
                    const float within = share < kCleanUpMost ? share : kCleanUpMost;
                    scale[c] = filtered * within / (share > kCleanUpFaint ? share : kCleanUpFaint);
                }
                continue;
            }
            const float* const by = moved[d] + slot;
            float* __restrict const to = change[d] + slot;
            for (int c = 0; c < cells; ++c) {
                const float cleaned = scale[c] * found[c] + own * by[c];
                to[c] = n[c] * cleaned;
            }
        }
    }
}

constexpr CleanUpKernels kKernels = {&check, &limit, &keep, &add, &fit, &smooth, &apply};

}  // namespace

namespace palette4d {
const CleanUpKernels& CleanUpKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
