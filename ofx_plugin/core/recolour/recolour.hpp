// Recolouring of images: p' = p + strength * (h(p) sum_i w_i(q) (v'_i - v_i) + the picks at p),
// where h is what holds leave.
#pragma once

#include <memory>
#include <vector>

#include "recolour/frame_picks.hpp"
#include "recolour/mvc.hpp"
#include "recolour/recolour_image.hpp"

namespace palette4d {

struct RecolourPlan;

/// Prepared once per frame; const, so many threads share it.
class Recolourer {
public:
    /// n original and n edited colours, the faces between them, and any picks, all finite. Throws
    /// std::invalid_argument when they do not match.
    Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited, std::vector<Face> faces,
               FramePicks picks = {});
    ~Recolourer();
    Recolourer(const Recolourer&) = delete;
    Recolourer& operator=(const Recolourer&) = delete;

    /// False when no colour moves; apply() then copies.
    bool moves() const { return palette_moves() || !picks_.picks.empty(); }
    /// Whether some vertex moves.
    bool palette_moves() const { return !displaced_.empty(); }
    const FramePicks& picks() const { return picks_; }
    /// The memory that it takes.
    std::size_t bytes() const;
    /// `in` and `out` have the same size and channels, and may be the same memory. A pixel's result
    /// depends on that pixel, its place and the options only, not on threads or processor. Colours
    /// with NaN or infinity pass; so do premultiplied ones whose alpha is 0 or not finite. Throws
    /// std::invalid_argument for mismatched views or instructions that this processor lacks.
    RecolourCounts apply(const ConstImageView& in, const ImageView& out,
                         const RecolourOptions& options) const;
    /// A worker for pixels of this many channels. Ignores options.threads and options.conversion;
    /// options.premultiplied is true for four channels only. This must outlive the worker.
    std::unique_ptr<RowWorker> worker(const RecolourOptions& options, int channels) const;
    const std::vector<Vec3>& original() const { return body_.rgb(); }
    /// For the core's own sources; the plan exists only where some colour moves.
    const PaletteBody& body() const { return body_; }
    const std::vector<Vec3>& displacement() const { return displacement_; }
    const RecolourPlan& plan() const { return *plan_; }
    /// One colour, in double precision. A colour with NaN or infinity is returned unchanged.
    /// Windows count where its pixel's spot is given.
    Vec3 displaced(const Vec3& p, double strength, const Spot* spot = nullptr) const;

private:
    friend class DoubleWorker;

    /// At strength 1, without picks. `p` must be finite; `weights` has one element per vertex.
    Vec3 palette_displacement(const Vec3& p, std::vector<double>& weights,
                              PaletteBody::Workspace& workspace) const;
    PaletteBody body_;
    std::vector<Vec3> displacement_;  ///< edited - original, one per vertex
    std::vector<int> displaced_;      ///< indices of the vertices that move
    FramePicks picks_;
    std::unique_ptr<const RecolourPlan> plan_;
};

}  // namespace palette4d
