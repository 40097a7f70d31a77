// Recolouring of images by interpolation: as fast as a 3D LUT, and as close to the exact
// recolouring as is asked for, colour by colour.
#pragma once

#include <memory>

#include "recolour/recolour.hpp"

namespace palette4d {

/// One frame's displacements at the nodes of a lattice, interpolated tetrahedrally between them.
///
/// The lattice spans the unit cube and the palette's bounding box, and a sixteenth of that more on
/// every side. It is made while it is used: of its 72^3 cells only those that pixels lie in, eight
/// (2 x 2 x 2) at a time. Where these tell by their 27 nodes that the interpolation in one is good,
/// it is. Others are looked at in seven more points that are evaluated exactly, in twelve more
/// where that does not settle it, and those that err by too much are halved along each axis. Their
/// parts are treated alike; those of convex palettes of no more than a sixth of the lattice are
/// halved once more. Parts that are not good enough, and all that lies outside, are recoloured
/// exactly. What a cell holds depends on the palette and the edit only. Used by many threads at a
/// time.
///
/// Where the palette is convex (PaletteRegions), colours outside of it are not interpolated: their
/// displacement is an affine function of them, region by region. Nodes are then the inside's mean
/// value coordinates, beyond the surface as well, so that a cell that the surface crosses is
/// interpolated below it, as smoothly as if it were not there.
class Lattice final : public ColourMap {
public:
    /// Of (interpolated - exact) / max(|exact|, 0.1), channel by channel. Where cells are looked at
    /// less is asked for, since an error is larger in between.
    static constexpr double kTolerance = 0.002;

    /// Throws std::invalid_argument for null.
    explicit Lattice(std::shared_ptr<const Recolourer> recolourer);
    ~Lattice() override;
    Lattice(const Lattice&) = delete;
    Lattice& operator=(const Lattice&) = delete;

    const Recolourer& recolourer() const { return *recolourer_; }

    bool moves() const override { return recolourer_->moves(); }
    /// Colours outside of the lattice or in parts that are not good enough have the Recolourer's
    /// bits, as have all for precision double and at a strength beyond 0 to 1. kTolerance holds in
    /// the palette's code values.
    std::unique_ptr<RowWorker> worker(const RecolourOptions& options, int channels) const override;

    /// The largest error, measured as kTolerance says and at strength 1, that was seen so far: of
    /// the points looked at in the cells in use and of about every thousandth pixel, evaluated
    /// exactly as well. 0 before the first apply().
    double largest_error() const;

    /// What the lattice holds at the moment.
    struct Size {
        long long cells = 0;    ///< made
        long long cut = 0;      ///< cells and parts that were halved
        long long parts = 0;    ///< of these
        long long exact = 0;    ///< parts that are not good enough, among those in use
        long long colours = 0;  ///< evaluated exactly for all this
    };
    Size size() const;

private:
    class Store;   ///< nodes, cells, and how they are made
    class Worker;  ///< a thread's work

    std::shared_ptr<const Recolourer> recolourer_;
    std::unique_ptr<Store> store_;
};

}  // namespace palette4d
