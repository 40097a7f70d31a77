// Divides the colours around a convex palette by the closest part of its surface.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "recolour/mvc.hpp"

namespace palette4d {

/// Space is divided into the inside and, outside, one region for each face, edge and vertex that is
/// closest. All regions are convex, with planes between them. The displacement is affine in each
/// outer region; inside it is smooth, away from the surface.
class PaletteRegions {
public:
    static constexpr int kInside = 0, kSeveral = -1;
    /// Larger than any practical palette.
    static constexpr std::size_t kMostRegions = 256;

    /// A choice: `below` holds where normal . p < offset. Each side is a region or another choice,
    /// chosen(), so choices form trees.
    struct Plane {
        Vec3 normal;
        double offset;
        int below, above;
    };
    static constexpr int chosen(int plane) { return -1 - plane; }
    /// The displacement is the first vector plus the others times red, green and blue.
    using Affine = std::array<Vec3, 4>;

    /// For boxes whose half widths are multiples of `unit`, with colours no farther than `size`
    /// from 0. Null for a non-convex palette, or where single precision is not enough.
    static std::unique_ptr<const PaletteRegions> of(const PaletteBody& body,
                                                    const std::vector<Vec3>& displacement,
                                                    const float* unit, double size);

    const std::vector<Plane>& planes() const { return planes_; }
    /// The affine displacement of a region; zeros for the inside.
    const Affine& affine(std::size_t region) const { return affine_[region]; }
    std::size_t count() const { return affine_.size(); }

    /// The regions of all colours in a box. Either one `region` whose displacement holds for all,
    /// or the choices that start at `plane`, or neither (kSeveral, -1).
    struct Within {
        int region, plane;
        bool inside;        ///< the inside is one of the regions
        bool edge = false;  ///< the inside and one of its edges are among them
    };
    Within within(const float* centre, float half_width, int start = kInside) const;
    /// The region of the box's centre, or kSeveral when it was not found. `crossings` counts that
    /// region's planes that cross the box: 0 when the whole box is in the region. The search begins
    /// at `start`.
    struct Around {
        int region, crossings;
        std::size_t crossed;  ///< the last of those planes, by the region's numbering
    };
    Around around(const float* centre, float half_width, int start) const;

    /// An upper bound on how many boxes of a grid contain some of the inside, as within() finds it.
    /// The grid has `side` boxes of `width` along each axis, from `low` on.
    std::size_t most_inside(const float* low, float width, int side) const;

private:
    /// One region's walls.
    struct Walls {
        std::vector<float> normal[3], offset, reach;  ///< inwards; of a box of half width 1
        std::vector<int> plane, beyond;
    };
    /// Signed distances of a box's centre from the walls, and the box's extent towards them.
    struct Rooms;
    /// Regions that a box touches.
    struct Found;

    PaletteRegions() = default;
    int add_region(const Affine& affine);
    int add_plane(const Vec3& normal, const Vec3& through, int below, int above);
    bool add_surface(const PaletteBody& body, const std::vector<Vec3>& displacement);
    void add_walls(const float* unit);
    bool precise(double size) const;
    bool alike(int a, int b, const float* centre, float half_width) const;
    bool touches_inside(const float* centre, float half_width) const;
    bool within_two(int region, int other, const float* centre, float half_width) const;
    bool find(int region, const float* centre, float half_width, Found& found) const;

    std::vector<Plane> planes_;
    std::vector<Affine> affine_;
    std::vector<Walls> walls_;
    std::vector<int> edge_faces_[2];  ///< for an edge's region its two faces; else -1
    std::vector<int> edge_choices_;   ///< of an edge's region: its first choice; else -1
    std::array<float, 3> unit_{};
};

}  // namespace palette4d
