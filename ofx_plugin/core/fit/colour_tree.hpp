// A frame's colours as a k-d tree of weighted points; the losses of section 3 are computed on it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Weighted colours (a colour and its pixel count) in a balanced k-d tree. Nodes have bounding
/// boxes, so a subtree inside the palette costs one test.
class ColourTree {
public:
    static constexpr int kLeafSize = 16;  ///< most colours of a leaf

    struct alignas(64) Node {  // a cache line
        Vec3 low, high;
        int begin, end;   ///< points of the subtree
        int left, right;  ///< children, -1 in a leaf
    };

    /// Boxes stored side by side, to be tested together.
    struct Boxes {
        static constexpr int kSize = 8;
        double sides[2][3][kSize];  ///< low and high, axis by axis
        int count;                  ///< how many there are
    };

    /// n colours (finite) and n positive counts. Throws std::invalid_argument otherwise.
    ColourTree(std::vector<Vec3> rgb, std::vector<double> counts);

    /// The mean of the k pixels nearest to v (v_N of eq. 3), or of all pixels when there are fewer.
    /// Pixels tied at the k-th distance share the remaining count, so their order does not matter.
    /// Throws std::invalid_argument unless v is finite and k > 0.
    Vec3 nearest_mean(const Vec3& v, double k) const;

    std::size_t size() const { return size_; }
    Vec3 rgb(int i) const { return {channel_[0][i], channel_[1][i], channel_[2][i]}; }
    /// size() numbers, and kLeafSize more as padding for reads past a leaf's end.
    const double* channel(int c) const { return channel_[c].data(); }
    const double* counts() const { return counts_.data(); }  ///< likewise
    const std::vector<Node>& nodes() const { return nodes_; }
    const std::vector<int>& leaves() const { return leaves_; }  ///< their nodes, in order
    /// The tree again, wide and shallow. The first level has the leaves' boxes in order,
    /// Boxes::kSize at a time. Each further level has one box around each Boxes of the level
    /// before; the last has one Boxes.
    const std::vector<std::vector<Boxes>>& levels() const { return levels_; }
    double total() const { return total_; }

private:
    struct Colour {
        Vec3 rgb;
        int index;  ///< index in the given order
    };
    int build(int begin, int end, std::vector<Colour>& order);
    void build_levels();

    std::size_t size_ = 0;
    std::array<std::vector<double>, 3> channel_;
    std::vector<double> counts_;
    std::vector<Node> nodes_;
    std::vector<int> leaves_;
    std::vector<std::vector<Boxes>> levels_;
    double total_ = 0;
};

}  // namespace palette4d
