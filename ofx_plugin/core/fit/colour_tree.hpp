// A frame's colours as a k-d tree of weighted points; the losses of section 3 are computed on it.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "fit/loss_kernels.hpp"
#include "model/polytope.hpp"

namespace palette4d {

/// Weighted colours (a colour and its pixel count) in the leaves of a balanced k-d tree. Each level
/// has bounding boxes, so that many colours inside the palette cost one test.
class ColourTree {
public:
    static constexpr int kLeafSize = 16;  ///< most colours of a leaf

    /// Boxes stored side by side, to be tested together.
    struct Boxes {
        static constexpr int kSize = 8;
        double sides[2][3][kSize];  ///< low and high, axis by axis
        int count;                  ///< how many there are
    };

    /// Memory that is reused from one search to the next.
    struct Nearest {
        struct Candidate {
            double d2;
            int point;
        };
        std::vector<Candidate> best;
    };

    /// n colours (finite) and n positive counts. Throws std::invalid_argument otherwise.
    ColourTree(std::vector<Vec3> rgb, std::vector<double> counts);

    /// The mean of the k pixels nearest to v (v_N of eq. 3), or of all pixels when there are fewer.
    /// Pixels tied at the k-th distance share the remaining count, so their order does not matter.
    /// Throws std::invalid_argument unless v is finite and k > 0.
    Vec3 nearest_mean(const Vec3& v, double k, const LossKernels& kernels, Nearest& memory) const;
    Vec3 nearest_mean(const Vec3& v, double k) const;

    std::size_t size() const { return size_; }
    Vec3 rgb(int i) const { return {channel_[0][i], channel_[1][i], channel_[2][i]}; }
    /// size() numbers, and kLeafSize more as padding for reads past a leaf's end.
    const double* channel(int c) const { return channel_[c].data(); }
    const double* counts() const { return counts_.data(); }  ///< likewise
    const Vec3& low() const { return low_; }                 ///< the box around all colours
    const Vec3& high() const { return high_; }               ///< likewise
    /// The first points of the leaves, in order, and size().
    const std::vector<int>& leaf_starts() const { return leaf_starts_; }
    /// A wide and shallow tree. The first level has the leaves' boxes in order, Boxes::kSize at a
    /// time. Each further level has one box around each Boxes of the level
    /// before; the last has one Boxes.
    const std::vector<std::vector<Boxes>>& levels() const { return levels_; }
    double total() const { return total_; }

private:
    struct Colour {
        double along;  ///< its place along the axis that is split
        int index;     ///< index in the given order
    };
    class Search;
    using Box = std::pair<Vec3, Vec3>;  // low and high
    void build(int begin, int end, const std::vector<Vec3>& rgb, std::vector<Colour>& order,
               std::vector<Box>& leaves);
    void build_levels(std::vector<Box> boxes);

    std::size_t size_ = 0;
    std::array<std::vector<double>, 3> channel_;
    std::vector<double> counts_;
    std::vector<int> leaf_starts_;
    std::vector<std::vector<Boxes>> levels_;
    Vec3 low_{}, high_{};
    double total_ = 0;
};

}  // namespace palette4d
