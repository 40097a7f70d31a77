// Clean up: the displacement that picks make, filtered with the picture as its guide, so that codec
// blocks, 4:2:0 edges and rims go. A fast guided filter (He, Sun: "Fast Guided Filter", 2015).
//
// Cells of pixels, counted from the picture's lower left corner, are averaged. In 5 x 5 cells the
// displacement is fitted by a linear function of the colour. The functions of 5 x 5 cells are
// averaged, interpolated between the cells' centres, and applied to the pixels' colours. So is the
// share, a matte times an amount of a colour: where it comes out as less than none, nothing moves.
// Colours beyond 0..1 guide as nearer ones, within -1..2. All sums have a fixed order: tiles,
// threads and render windows do not change the result.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "convert/colour_conversion.hpp"
#include "recolour/pick_kernels.hpp"
#include "recolour/recolour.hpp"

namespace palette4d {

struct CleanUpKernels;

/// A part of the plane of pixels; y counts upwards, and x2 and y2 are outside.
struct Area {
    int x1, y1, x2, y2;
};

/// The place of an image whose first pixel is (x, y) of a picture, whose rows go by `step` (1 or
/// -1) upwards, and which is the whole clip's.
ImagePlace image_place(const Area& picture, int x, int y, int step, const FramePicks& picks);

/// The side of a cell in pixels, in a picture drawn at `scale` (1: full size). `lines`: of the clip
/// (FramePicks::lines).
int clean_up_cell(double scale, double lines = 1);
/// Pixels that the filter sees on each side of a pixel, at most.
int clean_up_support(int cell);

/// One frame's filter. Const after prepare(), so that threads share it.
class CleanUp {
public:
    struct Place {
        Area picture;  ///< all that counts
        Area source;   ///< the part of it that can be read
        Area drawn;    ///< the part that will be drawn
        Area clip;     ///< the clip's picture, in which windows of picks lie
        int cell_width, cell_height;
    };
    struct Format {
        int channels;  ///< 3 or 4
        bool premultiplied;
    };
    /// Returns the float pixels x1 to x2 of row y: in `space`, or where they are.
    using Read = std::function<const float*(int y, int x1, int x2, float* space)>;
    /// Calls work(i) for each i below `count`, in any threads.
    using Share = std::function<void(int count, const std::function<void(int)>& work)>;

    /// `map` has picks, in the palette's code values; `conversion` leads there, null: none.
    CleanUp(std::shared_ptr<const Recolourer> map,
            std::shared_ptr<const ColourConversion> conversion, double amount, Format format,
            const Place& place);
    ~CleanUp();

    /// Reads the picture. `threads` is how many share() uses.
    void prepare(const Read& read, int threads, const Share& share);

    const Recolourer& map() const { return *map_; }
    double amount() const { return amount_; }
    /// Sets `change`, (count, 3), to what must be added, at strength 1 and in the palette's code
    /// values, to a row of pixels from (x, y) on: amount * filtered + own * unfiltered. False when
    /// that is 0 for all of them.
    bool change(const float* pixels, int x, int y, int count, double own, float* change) const;

private:
    class Strip;
    struct Block;
    /// The linear functions of one row of cells.
    struct Row {
        std::unique_ptr<float[]> terms;  ///< null where all are 0
        std::vector<char> some;          ///< for each block of cells, whether some are not 0
    };

    /// Reads pixels of row `y` into slots; `x` is the first slot's.
    bool load(const float* row, int row_x, int row_end, int x, int y, Block& block) const;

    const std::shared_ptr<const Recolourer> map_;
    const std::shared_ptr<const ColourConversion> conversion_;
    const double amount_;
    const Format format_;
    const CleanUpKernels& kernels_;
    const PickPlan<float> picks_;
    decltype(PickKernels::set) const set_picks_;
    Place place_;
    const bool windows_;
    const int cells_;                                      ///< in a block
    int column1_ = 0, column2_ = 0, row1_ = 0, row2_ = 0;  ///< cells that are summed
    int first_ = 0, last_ = 0;                             ///< rows of cells that are drawn from
    std::vector<Row> rows_;
    std::vector<float> parts_;
};

/// The cells of a place, counted from the picture's lower left corner.
struct CleanUpCells {
    Area source{};                                     ///< the part of it that counts
    int column1 = 0, column2 = 0, row1 = 0, row2 = 0;  ///< that are summed; none: nothing is drawn
    int first = 0, last = 0;                           ///< rows that are drawn from
};
CleanUpCells clean_up_cells(const CleanUp::Place& place);

}  // namespace palette4d
