#include "output/clean_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

#include "model/alpha.hpp"
#include "output/clean_up_kernels.hpp"
#include "recolour/recolour_plan.hpp"
#include "simd/instruction_set.hpp"

namespace palette4d {
namespace {

constexpr int kInBlock = CleanUpKernels::kSize;
constexpr int kAround = kCleanUpReach;
static_assert(kInBlock == PickKernels::kSize, "a block is one call of each kernel");

/// Side of a cell at full size: half of a codec's block of 8 x 8. Larger: soft edges. Smaller: the
/// blocks of the chroma stay.
constexpr double kCell = 4;
/// Up to so many lines (CIF) cells are half as large: things are small there too.
constexpr double kSmall = 288;
/// Largest side, so that the windows of a block of cells end within the next block.
constexpr int kMostCell = kInBlock / kAround;
/// Least rows of cells in a strip: each strip also reads 4 * kAround rows of its neighbours.
constexpr int kLeastStrip = 8;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::int64_t floored(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0); }

/// The node before pixel `x` and the way to the next one, where nodes are the centres of cells.
struct Between {
    std::int64_t node;
    float part;
};
Between between(std::int64_t x, int cell) {
    const std::int64_t at = 2 * x + 1 - cell, node = floored(at, 2 * cell);
    return {node, static_cast<float>(at - 2 * cell * node) / static_cast<float>(2 * cell)};
}

Area common(const Area& a, const Area& b) {
    return {std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2), std::min(a.y2, b.y2)};
}

bool is_empty(const Area& a) { return a.x1 >= a.x2 || a.y1 >= a.y2; }

/// The cells [first, second) that pixels x1 to x2 are in.
std::pair<int, int> cells_of(std::int64_t x1, std::int64_t x2, int cell) {
    return {static_cast<int>(floored(x1, cell)), static_cast<int>(floored(x2 - 1, cell) + 1)};
}

/// Calls each(slot, pixel) for the pixels of a block, from its first to its last.
template <class Each>
void each_slot(int width, int cells, Each each) {
    if (width == 4 && cells == kInBlock / 4) {  // known sizes: half the time
        for (int c = 0; c < kInBlock / 4; ++c) {
            for (int k = 0; k < 4; ++k) each(k * (kInBlock / 4) + c, 4 * c + k);
        }
        return;
    }
    for (int c = 0; c < cells; ++c) {
        for (int k = 0; k < width; ++k) each(k * cells + c, width * c + k);
    }
}

/// `Planes` may be fewer than the pixels' channels.
template <int Channels, int Planes>
void to_slots(const float* pixels, int width, int cells, float (*planes)[kInBlock]) {
    each_slot(width, cells, [&](int slot, int pixel) {
        for (int c = 0; c < Planes; ++c) planes[c][slot] = pixels[pixel * Channels + c];
    });
}

}  // namespace

ImagePlace image_place(const Area& picture, int x, int y, int step, const FramePicks& picks) {
    const auto size = [](int low, int high) {
        return std::max(static_cast<double>(high) - low, 1.0);
    };
    return {std::int64_t{x} - picture.x1, std::int64_t{picture.y2} - 1 - y, -step,
            picks.width / size(picture.x1, picture.x2),
            picks.height / size(picture.y1, picture.y2)};
}

int clean_up_cell(double scale, double lines) {
    const double full = lines > 1 && lines <= kSmall ? kCell / 2 : kCell;
    const double side = std::isfinite(scale) ? std::round(full * scale) : full;
    return static_cast<int>(std::clamp(side, 1.0, static_cast<double>(kMostCell)));
}

int clean_up_support(int cell) { return (2 * kAround + 2) * cell; }

/// Pixels in slots: pixel k of cell c in slot k * cells + c.
struct CleanUp::Block {
    alignas(64) float colour[4][kInBlock];  ///< and alpha, where it divides
    alignas(64) float guide[3][kInBlock];
    alignas(64) float place[2][kInBlock];              ///< for windows
    alignas(64) float moved[kCleanUpMoved][kInBlock];  ///< what picks do, and their share
    alignas(
        64) float counts[kInBlock];  ///< 1 where there is a pixel that can be recoloured, else 0
    bool some;                       ///< picks move some of them
};

bool CleanUp::load(const float* row, int row_x, int row_end, int x, int y, Block& block) const {
    const int width = place_.cell_width, slots = cells_ * width;
    if (!conversion_ && x >= row_x && row_end - x >= slots) {
        const float* const from = row + static_cast<std::ptrdiff_t>(x - row_x) * format_.channels;
        if (format_.channels == 3) {
            to_slots<3, 3>(from, width, cells_, block.colour);
        } else if (format_.premultiplied) {
            to_slots<4, 4>(from, width, cells_, block.colour);
        } else {
            to_slots<4, 3>(from, width, cells_, block.colour);
        }
        for (int i = slots; i < kInBlock; ++i) {
            for (int c = 0; c < 4; ++c) block.colour[c][i] = kNan;
        }
        kernels_.check(block.colour, format_.premultiplied ? block.colour[3] : nullptr,
                       block.counts);
    } else {
        for (int c = 0; c < 3; ++c) std::fill_n(block.colour[c], kInBlock, 0.0f);
        std::fill_n(block.counts, kInBlock, 0.0f);
        for (int i = std::max(0, row_x - x); i < std::min(slots, row_end - x); ++i) {
            const float* const pixel =
                row + static_cast<std::ptrdiff_t>(x - row_x + i) * format_.channels;
            if (!recolourable(pixel, format_.premultiplied)) continue;
            float colour[3];
            if (conversion_) {
                const Vec3 there =
                    conversion_->to_palette(straight_colour(pixel, format_.premultiplied));
                for (std::size_t c = 0; c < 3; ++c) colour[c] = static_cast<float>(there[c]);
            } else {
                const float alpha = format_.premultiplied ? pixel[3] : 1.0f;
                for (int c = 0; c < 3; ++c) colour[c] = straight(pixel[c], alpha);
            }
            if (!recolourable(colour, false)) continue;
            const int slot = i % width * cells_ + i / width;
            for (int c = 0; c < 3; ++c) block.colour[c][slot] = colour[c];
            block.counts[slot] = 1;
        }
    }
    kernels_.limit(block.colour, block.guide);
    if (windows_) {
        const ImagePlace place = image_place(place_.clip, x, y, 1, map_->picks());
        each_slot(width, cells_, [&](int slot, int pixel) {
            const Spot spot = place.at(pixel, 0);
            block.place[0][slot] = spot.x;
            block.place[1][slot] = spot.y;
        });
        for (int i = slots; i < kInBlock; ++i) block.place[0][i] = block.place[1][i] = 0;
    }
    block.some =
        set_picks_(picks_, block.colour, windows_ ? block.place : nullptr, block.moved, kInBlock);
    if (!block.some) {
        for (int c = 0; c < kCleanUpMoved; ++c) std::fill_n(block.moved[c], kInBlock, 0.0f);
        return false;
    }
    block.some = kernels_.keep(block.counts, block.moved);
    return block.some;
}

/// One thread's rows of cells: sums, fits and means follow each other, so that few rows are kept.
class CleanUp::Strip {
public:
    Strip(const CleanUp& of, std::vector<Row>& to, const Read& read)
        : of_(of),
          to_(to),
          read_(read),
          columns_(of.column2_ - of.column1_),
          blocks_((columns_ + of.cells_ - 1) / of.cells_),
          plane_(columns_ + 2 * kAround) {
        const auto plane = static_cast<std::size_t>(plane_);
        for (Ring& ring : sums_) ring.resize(plane * kCleanUpSums, blocks_);
        for (Ring& ring : fits_) ring.resize(plane * (kCleanUpTerms + 1), blocks_);
        space_.resize(static_cast<std::size_t>(source_end() - source_start()) *
                      static_cast<std::size_t>(of.format_.channels));
    }

    /// Rows [first, last) of the result.
    void run(int first, int last) {
        for (int row = first - 2 * kAround; row < last + 2 * kAround; ++row) {
            sum(row);
            const int fitted = row - kAround, done = fitted - kAround;
            if (fitted >= first - kAround) fit(fitted);
            if (done >= first) smooth(done);
        }
    }

private:
    struct Ring {
        std::vector<double> planes;
        std::vector<char> some;  ///< for each block of columns
        bool any = false;

        void resize(std::size_t size, int blocks) {
            planes.assign(size, 0.0);
            some.assign(static_cast<std::size_t>(blocks), 0);
        }
        void clear() {
            std::fill(planes.begin(), planes.end(), 0.0);
            std::fill(some.begin(), some.end(), char{0});
            any = false;
        }
    };

    static std::size_t slot(int row) {
        return static_cast<std::size_t>((row % kCleanUpRows + kCleanUpRows) % kCleanUpRows);
    }
    bool exists(int row) const { return row >= of_.row1_ && row < of_.row2_; }

    /// The pixels that are read.
    int source_start() const {
        const std::int64_t left = of_.place_.picture.x1;
        return static_cast<int>(std::max<std::int64_t>(
            of_.place_.source.x1,
            left + static_cast<std::int64_t>(of_.column1_) * of_.place_.cell_width));
    }
    int source_end() const {
        const std::int64_t left = of_.place_.picture.x1;
        return static_cast<int>(std::min<std::int64_t>(
            of_.place_.source.x2,
            left + static_cast<std::int64_t>(of_.column2_) * of_.place_.cell_width));
    }

    void sum(int row) {
        Ring& ring = sums_[slot(row)];
        ring.clear();
        if (!exists(row)) return;
        const Place& place = of_.place_;
        const std::int64_t bottom =
            place.picture.y1 + static_cast<std::int64_t>(row) * place.cell_height;
        const int y1 = static_cast<int>(std::max<std::int64_t>(bottom, place.source.y1));
        const int y2 =
            static_cast<int>(std::min<std::int64_t>(bottom + place.cell_height, place.source.y2));
        const int x1 = source_start(), x2 = source_end();
        for (int y = y1; y < y2; ++y) {
            const float* const pixels = read_(y, x1, x2, space_.data());
            for (int b = 0; b < blocks_; ++b) {
                const int column = b * of_.cells_;
                const std::int64_t x =
                    place.picture.x1 +
                    static_cast<std::int64_t>(of_.column1_ + column) * place.cell_width;
                const bool some = of_.load(pixels, x1, x2, static_cast<int>(x), y, block_);
                of_.kernels_.add(block_.guide, some ? block_.moved : nullptr, block_.counts,
                                 std::min(of_.cells_, columns_ - column), of_.cells_,
                                 place.cell_width, ring.planes.data() + kAround + column, plane_);
                ring.some[static_cast<std::size_t>(b)] |= static_cast<char>(some);
                ring.any |= some;
            }
        }
    }

    /// Whether some of the rings have something near a block.
    static bool near(const std::array<Ring, kCleanUpRows>& rings, int block) {
        const auto at = static_cast<std::size_t>(block);
        for (const Ring& ring : rings) {
            if (!ring.any) continue;
            if (ring.some[at] || (at > 0 && ring.some[at - 1]) ||
                (at + 1 < ring.some.size() && ring.some[at + 1])) {
                return true;
            }
        }
        return false;
    }

    /// The rings of the rows around `row`, upwards.
    static std::array<const double*, kCleanUpRows> around(
        const std::array<Ring, kCleanUpRows>& rings, int row) {
        std::array<const double*, kCleanUpRows> rows{};
        for (int i = 0; i < kCleanUpRows; ++i) {
            rows[static_cast<std::size_t>(i)] = rings[slot(row - kAround + i)].planes.data();
        }
        return rows;
    }

    void fit(int row) {
        Ring& ring = fits_[slot(row)];
        ring.clear();
        if (!exists(row)) return;
        const double* const counts = sums_[slot(row)].planes.data() + kAround;
        double* const weights =
            ring.planes.data() + static_cast<std::ptrdiff_t>(kCleanUpTerms) * plane_ + kAround;
        for (int c = 0; c < columns_; ++c) weights[c] = counts[c] > 0 ? 1.0 : 0.0;
        const auto rows = around(sums_, row);
        each_run(sums_, ring.some, [&](int from, int to) {
            of_.kernels_.fit(rows.data(), plane_, from, to, ring.planes.data());
            // A cell without pixels has no say.
            for (int p = 0; p < kCleanUpTerms; ++p) {
                double* const terms = ring.planes.data() + p * plane_ + kAround;
                for (int c = from; c < to; ++c) terms[c] = weights[c] != 0 ? terms[c] : 0.0;
            }
            ring.any = true;
        });
    }

    void smooth(int row) {
        if (!exists(row)) return;
        Row& to = to_[static_cast<std::size_t>(row - of_.first_)];
        const auto rows = around(fits_, row);
        to.some.assign(static_cast<std::size_t>(blocks_), 0);
        each_run(fits_, to.some, [&](int from, int last) {
            if (!to.terms) {
                to.terms.reset(new float[static_cast<std::size_t>(columns_) * kCleanUpTerms]());
            }
            of_.kernels_.smooth(rows.data(), plane_, from, last, to.terms.get(), columns_);
        });
    }

    /// Calls work(from, to) for columns of adjacent blocks that rings have something near, and
    /// marks these blocks.
    template <class Work>
    void each_run(const std::array<Ring, kCleanUpRows>& rings, std::vector<char>& some,
                  Work work) const {
        for (int b = 0; b < blocks_;) {
            if (!near(rings, b)) {
                ++b;
                continue;
            }
            const int start = b;
            for (; b < blocks_ && near(rings, b); ++b) some[static_cast<std::size_t>(b)] = 1;
            work(start * of_.cells_, std::min(b * of_.cells_, columns_));
        }
    }

    const CleanUp& of_;
    std::vector<Row>& to_;
    const Read& read_;
    const int columns_, blocks_;
    const std::ptrdiff_t plane_;
    std::array<Ring, kCleanUpRows> sums_, fits_;
    Block block_;
    std::vector<float> space_;
};

CleanUpCells clean_up_cells(const CleanUp::Place& place) {
    CleanUpCells cells;
    // Hosts may hand over more than the picture: what lies beyond does not count.
    const Area inside = common(place.source, place.picture);
    const Area source = is_empty(inside) ? place.source : inside;
    cells.source = source;
    const Area drawn = common(place.drawn, source);
    const std::int64_t left = place.picture.x1, bottom = place.picture.y1;
    const auto region = [](std::int64_t source1, std::int64_t source2, std::int64_t drawn1,
                           std::int64_t drawn2, int cell) {
        const auto [all1, all2] = cells_of(source1, source2, cell);
        const std::int64_t below = between(drawn1, cell).node - 2 * kAround;
        const std::int64_t above = between(drawn2 - 1, cell).node + 2 + 2 * kAround;
        return std::make_pair(static_cast<int>(std::max<std::int64_t>(all1, below)),
                              static_cast<int>(std::min<std::int64_t>(all2, above)));
    };
    if (is_empty(drawn)) return cells;
    std::tie(cells.column1, cells.column2) = region(
        source.x1 - left, source.x2 - left, drawn.x1 - left, drawn.x2 - left, place.cell_width);
    std::tie(cells.row1, cells.row2) =
        region(source.y1 - bottom, source.y2 - bottom, drawn.y1 - bottom, drawn.y2 - bottom,
               place.cell_height);
    const std::int64_t low = between(drawn.y1 - bottom, place.cell_height).node;
    const std::int64_t high = between(drawn.y2 - 1 - bottom, place.cell_height).node + 2;
    cells.first = static_cast<int>(std::max<std::int64_t>(cells.row1, low));
    cells.last = static_cast<int>(std::min<std::int64_t>(cells.row2, high));
    return cells;
}

CleanUp::CleanUp(std::shared_ptr<const Recolourer> map,
                 std::shared_ptr<const ColourConversion> conversion, double amount, Format format,
                 const Place& place)
    : map_(std::move(map)),
      conversion_(std::move(conversion)),
      amount_(amount),
      format_(format),
      kernels_(kernels_of<CleanUpKernels>(InstructionSet::kBest)),
      picks_(map_->plan().single.picks.plan()),
      set_picks_(kernels_of<PickKernels>(InstructionSet::kBest).set),
      place_(place),
      windows_(map_->picks().windows()),
      cells_(kInBlock / place.cell_width) {
    const CleanUpCells region = clean_up_cells(place);
    place_.source = region.source;
    column1_ = region.column1;
    column2_ = region.column2;
    row1_ = region.row1;
    row2_ = region.row2;
    first_ = region.first;
    last_ = region.last;
    rows_.resize(static_cast<std::size_t>(last_ - first_));
    for (int k = 0; k < place.cell_width; ++k) {
        parts_.push_back(between(place.cell_width / 2 + k, place.cell_width).part);
    }
}

CleanUp::~CleanUp() = default;

void CleanUp::prepare(const Read& read, int threads, const Share& share) {
    const int rows = last_ - first_;
    if (rows <= 0) return;
    const int strips = std::clamp(rows / kLeastStrip, 1, std::max(threads, 1));
    share(strips, [&](int i) {
        const auto start = [&](int strip) {
            return first_ + static_cast<int>(static_cast<std::int64_t>(rows) * strip / strips);
        };
        Strip(*this, rows_, read).run(start(i), start(i + 1));
    });
}

bool CleanUp::change(const float* pixels, int x, int y, int count, double own,
                     float* change) const {
    if (rows_.empty() || count <= 0) return false;
    const std::int64_t left = place_.picture.x1, bottom = place_.picture.y1;
    const Between at = between(y - bottom, place_.cell_height);
    const auto row_at = [&](std::int64_t row) -> const Row& {
        const auto inside = std::clamp<std::int64_t>(row, first_, last_ - 1);
        return rows_[static_cast<std::size_t>(inside - first_)];
    };
    const Row &below = row_at(at.node), &above = row_at(at.node + 1);
    if (!below.terms && !above.terms) return false;

    const int width = place_.cell_width, columns = column2_ - column1_;
    const std::vector<float> none(
        below.terms && above.terms ? 0 : static_cast<std::size_t>(columns) * kCleanUpTerms);
    const float* const low = below.terms ? below.terms.get() : none.data();
    const float* const high = above.terms ? above.terms.get() : none.data();
    const auto some = [&](const Row& row, int column) {
        return row.terms && row.some[static_cast<std::size_t>(column / cells_)] != 0;
    };
    std::fill_n(change, 3 * static_cast<std::ptrdiff_t>(count), 0.0f);
    bool any = false;
    Block block;
    alignas(64) float found[3][kInBlock];
    float ends[2][kCleanUpTerms * (kInBlock + 1)];
    // Blocks begin half a cell after a cell's start, so that each cell has one pair of nodes.
    const std::int64_t half = width / 2;
    const std::int64_t end = static_cast<std::int64_t>(x) + count;
    std::int64_t node = floored(x - left - half, width);
    for (; left + half + node * width < end; node += cells_) {
        const auto column_at = [&](std::int64_t cell) {
            return static_cast<int>(std::clamp<std::int64_t>(cell, column1_, column2_ - 1) -
                                    column1_);
        };
        // The nodes lie in at most two blocks.
        const int from = column_at(node), to = column_at(node + cells_);
        if (!some(below, from) && !some(above, from) && !some(below, to) && !some(above, to)) {
            continue;
        }
        const std::int64_t start = left + half + node * width;
        load(pixels, x, x + count, static_cast<int>(start), y, block);
        CleanUpKernels::Nodes nodes{low + from,    high + from, columns, at.part,
                                    parts_.data(), cells_,      width};
        if (to - from != cells_) {
            // At the picture's sides the last nodes reach to the end.
            for (int i = 0; i <= cells_; ++i) {
                for (int p = 0; p < kCleanUpTerms; ++p) {
                    const int term = p * columns + column_at(node + i);
                    ends[0][p * (cells_ + 1) + i] = low[term];
                    ends[1][p * (cells_ + 1) + i] = high[term];
                }
            }
            nodes.low = ends[0];
            nodes.high = ends[1];
            nodes.plane = cells_ + 1;
        }
        kernels_.apply(nodes, block.guide, block.moved, block.counts, static_cast<float>(amount_),
                       static_cast<float>(own), found);
        const auto first = static_cast<int>(std::max<std::int64_t>(0, x - start));
        const auto last = static_cast<int>(
            std::min<std::int64_t>(static_cast<std::int64_t>(cells_) * width, end - start));
        float* const result = change + 3 * (start - x);
        each_slot(width, cells_, [&](int slot, int pixel) {
            if (pixel < first || pixel >= last) return;
            for (int c = 0; c < 3; ++c) result[3 * pixel + c] = found[c][slot];
        });
        any = true;
    }
    return any;
}

}  // namespace palette4d
