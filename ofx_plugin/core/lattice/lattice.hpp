// Recolouring of images by interpolation: as fast as a 3D LUT, with a bounded error per colour.
#pragma once

#include <memory>

#include "recolour/recolour.hpp"

namespace palette4d {

/// One frame's displacements at the nodes of a lattice, interpolated tetrahedrally in between.
///
/// The lattice spans the unit cube and the palette's bounding box, plus a margin on every side. It
/// has 72^3 cells and is built on demand, eight cells (2 x 2 x 2) at a time. A cell whose 27 nodes
/// show a smooth displacement is used as it is. Any other is probed at seven points, then at twelve
/// more where seven do not decide. A cell whose error is too large is cut into eight parts, which
/// are tested the same way. Parts of convex palettes that fill at most a sixth of the lattice may
/// be cut once more. Parts that miss the tolerance, and colours outside the lattice, are recoloured
/// exactly. A cell's content depends on the palette and the edit only. Thread-safe.
///
/// Outside a convex palette (PaletteRegions) the displacement is affine in each region and needs no
/// interpolation. Its nodes then hold mean value coordinates extended beyond the surface. So cells
/// that the surface crosses interpolate smoothly.
///
/// Picks and holds are not interpolated: they are evaluated at each colour.
class Lattice final : public ColourMap {
public:
    /// Bound of |interpolated - exact| / max(|exact|, 0.1) for each channel, without picks. Probes
    /// use a tighter tolerance, since the error between them is larger.
    static constexpr double kTolerance = 0.002;

    /// Throws std::invalid_argument for null.
    explicit Lattice(std::shared_ptr<const Recolourer> recolourer);
    ~Lattice() override;
    Lattice(const Lattice&) = delete;
    Lattice& operator=(const Lattice&) = delete;

    const Recolourer& recolourer() const { return *recolourer_; }

    bool moves() const override { return recolourer_->moves(); }
    /// Bit-identical to the Recolourer for colours outside the lattice or in parts that miss the
    /// tolerance. So is all of precision double, and any strength beyond 0 to 1. kTolerance is in
    /// the palette's code values.
    std::unique_ptr<RowWorker> worker(const RecolourOptions& options, int channels) const override;

    /// The largest error so far, as kTolerance measures it and at strength 1; 0 before the first
    /// apply(). It covers the probes of used cells and about every thousandth pixel, evaluated
    /// exactly too.
    double largest_error() const;

    struct Size {
        long long cells = 0;    ///< built
        long long cut = 0;      ///< cells and parts cut into eight
        long long parts = 0;    ///< parts that these cuts made
        long long exact = 0;    ///< parts in use that are recoloured exactly
        long long colours = 0;  ///< colours evaluated exactly to build the lattice
    };
    Size size() const;

private:
    class Store;   ///< nodes and cells, and how they are built
    class Worker;  ///< one thread's work

    std::shared_ptr<const Recolourer> recolourer_;
    std::unique_ptr<Store> store_;
};

}  // namespace palette4d
