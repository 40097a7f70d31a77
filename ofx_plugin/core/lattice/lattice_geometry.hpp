// Positions of a Lattice's nodes, cells and parts, and their neighbours. In an unnamed namespace,
// like four.hpp.
#pragma once

#include <algorithm>
#include <cstddef>

#include "lattice/lattice_store.hpp"
#include "simd/four.hpp"

namespace palette4d {
namespace {

constexpr int kSide = kLatticeSide, kNodeSide = kSide + 1;

/// The place, 0 or 1, along an axis of one of eight corners or parts: number 4 x + 2 y + z.
constexpr int bit(int corner, int axis) { return corner >> (2 - axis) & 1; }

/// Node positions in a brick along each axis, in halves of the cut cell's width.
struct BrickPlaces {
    float at[kBrickNodes][4]{};
    constexpr BrickPlaces() {
        for (int node = 0; node < kBrickNodes; ++node) {
            at[node][0] = static_cast<float>(node / 9);
            at[node][1] = static_cast<float>(node / 3 % 3);
            at[node][2] = static_cast<float>(node % 3);
        }
    }
};
constexpr BrickPlaces kPlaces;

/// Where a cell or part is probed: the nodes that its brick would add. First the middles of body
/// and faces, then of the edges. Every corner touches a probe, so a crease that cuts off a corner
/// is seen.
struct Probes {
    static constexpr std::size_t kMiddles = 7, kAll = 19;
    struct Probe {
        int node;     ///< node number in the brick
        int ends[2];  ///< the probe is half way between these two corners
    };
    Probe all[kAll]{};

    constexpr Probes() {
        std::size_t middles = 0, edges = kMiddles;
        for (int node = 0; node < kBrickNodes; ++node) {
            const int x = node / 9, y = node / 3 % 3, z = node % 3;
            const int halves = (x == 1) + (y == 1) + (z == 1);
            if (halves == 0) continue;
            all[halves > 1 ? middles++ : edges++] = {
                node,
                {4 * (x / 2) + 2 * (y / 2) + z / 2,
                 4 * ((x + 1) / 2) + 2 * ((y + 1) / 2) + (z + 1) / 2}};
        }
    }
};
constexpr Probes kProbes;

/// Lines of three nodes in a cube of 3 x 3 x 3 nodes, along edges of the tetrahedra.
struct Lines {
    static constexpr std::size_t kCount = 37, kTouching = 19;
    struct Line {
        int middle, step;
    };
    Line all[kCount]{};
    int of_part[8][kTouching]{};  ///< lines that touch each of the eight parts

    constexpr Lines() {
        int count = 0, touching[8] = {};
        for (int direction = 1; direction < 8; ++direction) {
            for (int node = 0; node < kBrickNodes; ++node) {
                const int at[3] = {node / 9, node / 3 % 3, node % 3};
                bool middle = true;
                for (int c = 0; c < 3; ++c) middle &= !bit(direction, c) || at[c] == 1;
                if (!middle) continue;
                for (int part = 0; part < 8; ++part) {
                    bool touches = true;
                    for (int c = 0; c < 3; ++c) {
                        touches &= bit(direction, c) || at[c] == 1 || at[c] / 2 == bit(part, c);
                    }
                    if (touches) of_part[part][touching[part]++] = count;
                }
                all[count++] = {node,
                                9 * bit(direction, 0) + 3 * bit(direction, 1) + bit(direction, 2)};
            }
        }
    }
};
constexpr Lines kLines;

struct Cell {
    int x, y, z;
    int first_node() const { return (x * kNodeSide + y) * kNodeSide + z; }
};

inline Cell cell_at(int number) {
    return {number / (kSide * kSide), number / kSide % kSide, number % kSide};
}

/// A cell of the group, given the group's first cell.
inline int group_cell(int group, int part) {
    return group + (bit(part, 0) * kSide + bit(part, 1)) * kSide + bit(part, 2);
}

/// The group that a cell belongs to.
inline int group_of(int number) {
    const Cell cell = cell_at(number);
    return number - (cell.x % 2 * kSide + cell.y % 2) * kSide - cell.z % 2;
}

inline LatticePlace place_of(const Cell& cell) {
    return {{kCellWidth * static_cast<float>(cell.x), kCellWidth * static_cast<float>(cell.y),
             kCellWidth * static_cast<float>(cell.z), 0}};
}

/// Places are whole numbers: a place has the same colour from any cell that it is computed from.
inline Four colour_at(const float* low, const float* step, Four place) {
    return load_four(low) + place * load_four(step);
}

struct Point {
    float at[4];
};
/// The centre of a cube `width` wide whose lowest corner is `place`.
inline Point centre_of(const float* low, const float* step, const LatticePlace& place,
                       float half_width) {
    Point centre;
    store_four(centre.at, colour_at(low, step, load_four(place.at) + all_four(half_width)));
    return centre;
}

inline float largest_of(Four error) { return std::max(std::max(error[0], error[1]), error[2]); }

}  // namespace
}  // namespace palette4d
