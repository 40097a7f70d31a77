// The application of a lattice of displacements to 64 pixels at a time. Plain data and pointers
// only, as block_kernels.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palette4d {

/// A cube of cells spans the domain. One that is too coarse is cut in half along each axis (into a
/// brick of parts), and so are, for some palettes, parts. Nodes in memory: those of the cells, one
/// that is always 0, four for each region of the palette's surface, then those of each brick.
/// Cells, parts and nodes are numbered with blue running fastest; the number of a part is its
/// brick's, counted from the cells on. Bricks that have no nodes, since nothing is interpolated in
/// them, follow all that have.
constexpr int kLatticeSide = 72;  ///< cells along each axis
constexpr int kLatticeCells = kLatticeSide * kLatticeSide * kLatticeSide;
constexpr int kLatticeNodes = (kLatticeSide + 1) * (kLatticeSide + 1) * (kLatticeSide + 1);
constexpr int kLatticeZero = kLatticeNodes;            ///< the node that is 0
constexpr int kLatticeFirstRegion = kLatticeZero + 1;  ///< its first node
constexpr int kLatticeMostRegions = 256;
constexpr int kLatticeFirstBrick = kLatticeFirstRegion + 4 * kLatticeMostRegions;
constexpr int kBrickParts = 8;
constexpr int kBrickNodes = 27;
constexpr int kLatticeBricks = ((1 << 24) - kLatticeFirstBrick) / kBrickNodes;  ///< floats count
static_assert(kLatticeBricks >= kLatticeCells, "each cell may be cut");
/// Numbers: the cells, what lies outside of the domain, the parts.
constexpr int kLatticeOutside = kLatticeCells;
constexpr int kLatticeFirstPart = kLatticeCells + 1;
/// What a cell or a part is. Its last three bits tell whether there is something to apply (those of
/// kLatticeGood); the others what that is: 0 for interpolation, else a region, or a plane between
/// two. Negative where it is cut into parts: brick -1 - state.
constexpr int kLatticeGood = 3;
constexpr int kLatticeKind = 7;
constexpr int lattice_region(int region) { return 8 * region + kLatticeGood; }
constexpr int kLatticeFirstPlane = 8 * kLatticeMostRegions;
constexpr int lattice_plane(int plane) { return kLatticeFirstPlane + 8 * plane + kLatticeGood; }

/// The states below and above normal . colour = offset; they may be other planes'.
struct LatticePlane {
    float normal[3], offset;
    std::int32_t sides[2];
};

struct LatticeDomain {
    float low[3], high[3];
    float scale[3];  ///< cells a unit
};

struct LatticeBlock {
    static constexpr int kSize = 64;
    alignas(64) float colour[3][kSize];  ///< straight
    alignas(64) float within[3][kSize];  ///< place in the cell, 0 to 1
    alignas(64) float first[kSize];      ///< the cell's first node
    alignas(64) float cut[kSize];        ///< 1 in a brick, 0 in an uncut cell
    alignas(64) int number[kSize];       ///< of the cell or part
    alignas(64) int state[kSize];        ///< its state
    /// Nodes of the tetrahedron around the colour, in bytes from the first of all.
    alignas(64) unsigned corner[4][kSize];
    alignas(64) float weight[4][kSize];
};

/// The kernels of one instruction set. Each pixel's result depends on it alone.
struct LatticeKernels {
    /// Where `count` pixels of 3 or 4 channels lie: colour, within, first, cut, number. Colours are
    /// divided by alpha where premultiplied; alpha that cannot be divided by is outside.
    void (*locate)(const LatticeDomain& domain, LatticeBlock& block, const float* from,
                   int channels, int count, bool premultiplied);
    /// Where `state` is a brick's, from the cell to the brick's part: within, first, cut, number.
    void (*descend)(LatticeBlock& block, int count);
    /// Where `state` is a plane's: from it to that of the colour's side, until it is none. Not 0
    /// where something is then not good.
    std::int32_t (*choose_sides)(const LatticePlane* planes, LatticeBlock& block, int count);
    /// Tetrahedral interpolation there, or what a region does, an affine function of the colour:
    /// corner, weight. All of it 0 where `state` is not good.
    void (*weigh)(LatticeBlock& block, int count);
    /// In `to`, what the `count` pixels of `from` become at a strength; channels that do not move
    /// keep their bits. `nodes` are 4 numbers each, the last is 0.
    void (*blend)(const float* nodes, const LatticeBlock& block, int count, const float* from,
                  float* to, int channels, float strength, bool premultiplied);

    /// One for each set of instructions that this build has.
    static const LatticeKernels& baseline();
    static const LatticeKernels& avx2();
    static const LatticeKernels& avx512();
};

}  // namespace palette4d
