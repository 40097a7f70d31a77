// Applies a lattice of displacements to 64 pixels at a time. Plain data and pointers only, as in
// mvc_kernels.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace palette4d {

/// A cube of cells spans the domain. Cells that are too coarse are cut in half along each axis,
/// into a brick of eight parts; some palettes cut parts again. Nodes in memory: the cells' nodes,
/// one zero node, four nodes for each surface region, then each brick's nodes. Blue runs fastest in
/// all numbering. A part's number follows from its brick's and comes after the cells' numbers.
/// Bricks without nodes (nothing is interpolated in them) come last.
constexpr int kLatticeSide = 72;  ///< cells along each axis
constexpr int kLatticeCells = kLatticeSide * kLatticeSide * kLatticeSide;
constexpr int kLatticeNodes = (kLatticeSide + 1) * (kLatticeSide + 1) * (kLatticeSide + 1);
constexpr int kLatticeZero = kLatticeNodes;            ///< the zero node
constexpr int kLatticeFirstRegion = kLatticeZero + 1;  ///< the first region's first node
constexpr int kLatticeMostRegions = 256;
constexpr int kLatticeFirstBrick = kLatticeFirstRegion + 4 * kLatticeMostRegions;
constexpr int kBrickParts = 8;
constexpr int kBrickNodes = 27;
constexpr int kLatticeBricks = ((1 << 24) - kLatticeFirstBrick) / kBrickNodes;  ///< exact as floats
static_assert(kLatticeBricks >= kLatticeCells, "each cell may be cut");
/// Number ranges: cells, then one for outside the domain, then parts.
constexpr int kLatticeOutside = kLatticeCells;
constexpr int kLatticeFirstPart = kLatticeCells + 1;
/// The state of a cell or part. Its last three bits are kLatticeGood when it can be applied. The
/// upper bits are 0 for interpolation, else a region, or a plane between two. Negative when cut
/// into parts: brick -1 - state.
constexpr int kLatticeGood = 3;
constexpr int kLatticeKind = 7;
constexpr int lattice_region(int region) { return 8 * region + kLatticeGood; }
constexpr int kLatticeFirstPlane = 8 * kLatticeMostRegions;
constexpr int lattice_plane(int plane) { return kLatticeFirstPlane + 8 * plane + kLatticeGood; }

/// The states on both sides of normal . colour = offset; each may be another plane's.
struct LatticePlane {
    float normal[3], offset;
    std::int32_t sides[2];
};

struct LatticeDomain {
    float low[3], high[3];
    float scale[3];  ///< cells per unit
};

struct LatticeBlock {
    static constexpr int kSize = 64;
    alignas(64) float colour[3][kSize];  ///< unpremultiplied
    alignas(64) float within[3][kSize];  ///< position in the cell, 0 to 1
    alignas(64) float first[kSize];      ///< the cell's first node
    alignas(64) float cut[kSize];        ///< 1 in a brick, 0 in an uncut cell
    alignas(64) int number[kSize];       ///< cell or part number
    alignas(64) int state[kSize];        ///< its state
    /// Nodes of the tetrahedron around the colour, as byte offsets from the first node.
    alignas(64) unsigned corner[4][kSize];
    alignas(64) float weight[4][kSize];
};

/// The kernels of one instruction set. Each pixel's result depends on that pixel only.
struct LatticeKernels {
    /// Finds the cells of `count` pixels of 3 or 4 channels: sets colour, within, first, cut,
    /// number. Premultiplied colours are straight(); those without colour are
    /// outside.
    void (*locate)(const LatticeDomain& domain, LatticeBlock& block, const float* from,
                   int channels, int count, bool premultiplied);
    /// Where `state` is a brick's, moves from the cell to the part: sets within, first, cut,
    /// number.
    void (*descend)(LatticeBlock& block, int count);
    /// Where `state` is a plane's, replaces it by the state on the colour's side until it is no
    /// plane. Not 0 when some pixel's final state is not good.
    std::int32_t (*choose_sides)(const LatticePlane* planes, LatticeBlock& block, int count);
    /// Sets corner and weight: tetrahedral interpolation, or a region's affine function of the
    /// colour. Both are zero where `state` is not good.
    void (*weigh)(LatticeBlock& block, int count);
    /// Writes to `to` the `count` pixels of `from`, recoloured at a strength. Channels that do not
    /// move keep their bits. `nodes` have four floats each, the last one 0.
    void (*blend)(const float* nodes, const LatticeBlock& block, int count, const float* from,
                  float* to, int channels, float strength, bool premultiplied);

    /// One for each instruction set in this build.
    static const LatticeKernels& baseline();
    static const LatticeKernels& avx2();
    static const LatticeKernels& avx512();
};

}  // namespace palette4d
