// The colours around a convex palette, by what of it is the closest.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "recolour/palette_body.hpp"

namespace palette4d {

/// Space divided into the inside of a palette and, outside, what is closest to the same face, edge
/// or vertex. All regions are convex, bounded by planes that two of them share; outside, the
/// displacement is an affine function in each, and inside, away from the surface, a smooth one.
class PaletteRegions {
public:
    static constexpr int kInside = 0, kSeveral = -1;
    /// More than in any palette that is worked with.
    static constexpr std::size_t kMostRegions = 256;

    /// A choice: `below` is where normal . p < offset. What there is on either side is a region, or
    /// another choice, chosen(): they make trees.
    struct Plane {
        Vec3 normal;
        double offset;
        int below, above;
    };
    static constexpr int chosen(int plane) { return -1 - plane; }
    /// The displacement is the first of these and the others times red, green and blue.
    using Affine = std::array<Vec3, 4>;

    /// For boxes whose half widths are multiples of `unit`, with colours no farther than `size`
    /// from 0. Null for a palette that is not convex, or where single precision is not enough.
    static std::unique_ptr<const PaletteRegions> of(const PaletteBody& body,
                                                    const std::vector<Vec3>& displacement,
                                                    const float* unit, double size);

    const std::vector<Plane>& planes() const { return planes_; }
    /// Of a region; zeros inside.
    const Affine& affine(std::size_t region) const { return affine_[region]; }
    std::size_t count() const { return affine_.size(); }

    /// The regions of all colours of a box: one, where the displacement is that one's; or those
    /// that the choices from `plane` on lead to; or neither (kSeveral, -1).
    struct Within {
        int region, plane;
        bool inside;        ///< the inside is one of them
        bool edge = false;  ///< and an edge of it
    };
    Within within(const float* centre, float half_width, int start = kInside) const;
    /// The centre's region, or kSeveral where it was not found, and how many of the planes around
    /// it cross the box: 0 where the region is the whole box's. It is looked for from `start` on.
    struct Around {
        int region, crossings;
        std::size_t crossed;  ///< the last of those planes, as the region counts them
    };
    Around around(const float* centre, float half_width, int start) const;

    /// At least as many of the boxes of a grid, `side` along each axis, `width` wide and from `low`
    /// on, as within() says have some of the inside.
    std::size_t most_inside(const float* low, float width, int side) const;

private:
    /// Of one region, a number each.
    struct Walls {
        std::vector<float> normal[3], offset, reach;  ///< inwards; of a box of half width 1
        std::vector<int> plane, beyond;
    };
    /// How far a box's centre is from the walls, and how far the box.
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
    std::vector<int> edge_faces_[2];  ///< a region's, where it is an edge's; else -1
    std::vector<int> edge_choices_;   ///< between those, the edge and the inside
    std::array<float, 3> unit_{};
};

}  // namespace palette4d
