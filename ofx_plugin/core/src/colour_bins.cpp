#include "palette4d/colour_bins.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "vec3.hpp"

namespace palette4d {
namespace {

constexpr std::int64_t kOffset = 1 << 20;  // bin numbers are kept in 21 bits each

constexpr std::size_t kRoom = 16;  // bins held while reading, in multiples of those kept

struct Bin {
    std::uint64_t key;
    double sum[3];
    double count;
};

/// Open-addressing hash table of bins in order of first appearance.
class Table {
public:
    explicit Table(std::size_t capacity) : slots_(capacity, -1) {}

    void add(std::uint64_t key, double r, double g, double b, double n) {
        std::size_t mask = slots_.size() - 1;
        std::size_t at = slot_of(key) & mask;
        while (slots_[at] >= 0 && bins_[slots_[at]].key != key) at = (at + 1) & mask;
        if (slots_[at] < 0) {
            slots_[at] = static_cast<std::int64_t>(bins_.size());
            bins_.push_back({key, {0, 0, 0}, 0});
            if (bins_.size() * 2 > slots_.size()) {
                grow();
                Bin& fresh = bins_.back();
                fill(fresh, r, g, b, n);
                return;
            }
        }
        fill(bins_[slots_[at]], r, g, b, n);
    }

    const std::vector<Bin>& bins() const { return bins_; }

private:
    /// The product's upper bits depend on every bit of the key (Fibonacci hashing).
    static std::size_t slot_of(std::uint64_t key) { return key * 0x9E3779B97F4A7C15ull >> 36; }

    static void fill(Bin& bin, double r, double g, double b, double n) {
        bin.sum[0] += r;
        bin.sum[1] += g;
        bin.sum[2] += b;
        bin.count += n;
    }

    void grow() {
        std::vector<std::int64_t> wider(slots_.size() * 2, -1);
        const std::size_t mask = wider.size() - 1;
        for (std::size_t i = 0; i < bins_.size(); ++i) {
            std::size_t at = slot_of(bins_[i].key) & mask;
            while (wider[at] >= 0) at = (at + 1) & mask;
            wider[at] = static_cast<std::int64_t>(i);
        }
        slots_.swap(wider);
    }

    std::vector<std::int64_t> slots_;
    std::vector<Bin> bins_;
};

std::uint64_t bin_number(double x, double inverse) {
    // Shifted to be positive, so that the conversion, which truncates, rounds down. The order of
    // max's arguments turns what is not a number (0 over a vanishing width) into 0.
    constexpr double kShift = static_cast<double>(kOffset) + 0.5;
    const double n = x * inverse + kShift;
    return static_cast<std::uint64_t>(std::min(std::max(0.0, n), 2.0 * kOffset - 1.0));
}

std::uint64_t key_of(double r, double g, double b, double inverse) {
    return bin_number(r, inverse) << 42 | bin_number(g, inverse) << 21 | bin_number(b, inverse);
}

/// Doubles the bins' width until at most `most` are left.
void widen(Table& table, double& step, std::size_t most) {
    while (table.bins().size() > most) {
        step *= 2;
        Table wider(1 << 16);
        for (const Bin& bin : table.bins())
            wider.add(key_of(bin.sum[0] / bin.count, bin.sum[1] / bin.count, bin.sum[2] / bin.count,
                             1 / step),
                      bin.sum[0], bin.sum[1], bin.sum[2], bin.count);
        table = std::move(wider);
    }
}

ColourBins finish(Table table, double step, std::size_t most, std::size_t ignored) {
    widen(table, step, most);
    ColourBins out;
    out.step = step;
    out.ignored = ignored;
    for (const Bin& bin : table.bins()) {
        out.rgb.push_back({bin.sum[0] / bin.count, bin.sum[1] / bin.count, bin.sum[2] / bin.count});
        out.counts.push_back(bin.count);
    }
    return out;
}

}  // namespace

ColourBins bin_colours(const float* data, int width, int height, int channels,
                       std::ptrdiff_t row_bytes, double step, std::size_t most) {
    if (channels != 3 && channels != 4)
        throw std::invalid_argument("found " + std::to_string(channels) +
                                    " channels, expected 3 (RGB) or 4 (RGBA)");
    if (!(step > 0) || !std::isfinite(step) || most < 1)
        throw std::invalid_argument("bins need a positive width and room for at least one");
    std::size_t ignored = 0;
    Table table(1 << 16);
    double inverse = 1 / step;
    for (int y = 0; y < height; ++y) {
        const float* row = reinterpret_cast<const float*>(
            reinterpret_cast<const char*>(data) + static_cast<std::ptrdiff_t>(y) * row_bytes);
        for (int x = 0; x < width; ++x, row += channels) {
            const double r = row[0], g = row[1], b = row[2];
            if (!std::isfinite(r) || !std::isfinite(g) || !std::isfinite(b) ||
                (channels == 4 && row[3] == 0)) {
                ++ignored;
                continue;
            }
            table.add(key_of(r, g, b, inverse), r, g, b, 1);
        }
        // Grain gives nearly every pixel a colour of its own: memory stays bounded on the way, too.
        if (table.bins().size() > kRoom * most) {
            widen(table, step, kRoom * most / 2);
            inverse = 1 / step;
        }
    }
    return finish(std::move(table), step, most, ignored);
}

ColourBins coarsen_colours(const std::vector<Vec3>& rgb, const std::vector<double>& counts,
                           double step, std::size_t most) {
    if (rgb.size() != counts.size() || !(step > 0) || !std::isfinite(step) || most < 1)
        throw std::invalid_argument("coarsening needs a count a colour and bins of positive width");
    Table table(1 << 16);
    const double inverse = 1 / step;
    double size = 0;  // bounds every sum
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const double n = counts[i];
        const bool valid = finite(rgb[i]) && n > 0 && std::isfinite(n);
        for (int c = 0; valid && c < 3; ++c) size += n * std::abs(rgb[i][c]);
        if (!valid || !std::isfinite(size))
            throw std::invalid_argument(
                "coarsening needs finite colours and positive, finite counts; colour " +
                std::to_string(i) + " is not, or too large");
        table.add(key_of(rgb[i][0], rgb[i][1], rgb[i][2], inverse), n * rgb[i][0], n * rgb[i][1],
                  n * rgb[i][2], n);
    }
    return finish(std::move(table), step, most, 0);
}

}  // namespace palette4d
