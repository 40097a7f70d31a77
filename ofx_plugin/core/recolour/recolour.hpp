// Recolouring of images: p' = p + strength * sum_i w_i(q) (v'_i - v_i).
#pragma once

#include <memory>
#include <vector>

#include "recolour/colour_map.hpp"
#include "recolour/palette_body.hpp"

namespace palette4d {

struct RecolourPlan;

/// Prepared once per frame; const, so many threads share it.
class Recolourer final : public ColourMap {
public:
    /// n original and n edited colours, and the faces between them, all finite. Throws
    /// std::invalid_argument when they do not match.
    Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
               std::vector<Face> faces);
    ~Recolourer() override;
    Recolourer(const Recolourer&) = delete;
    Recolourer& operator=(const Recolourer&) = delete;

    bool moves() const override { return !displaced_.empty(); }
    std::unique_ptr<RowWorker> worker(const RecolourOptions& options, int channels) const override;
    const std::vector<Vec3>& original() const { return body_.rgb(); }
    /// For the core's own sources; the plan exists only where some colour moves.
    const PaletteBody& body() const { return body_; }
    const std::vector<Vec3>& displacement() const { return displacement_; }
    const RecolourPlan& plan() const { return *plan_; }
    /// One colour, in double precision. A colour with NaN or infinity is returned unchanged.
    Vec3 displaced(const Vec3& p, double strength) const;

private:
    friend class OneByOne;

    /// At strength 1. `p` must be finite; `weights` has one element per vertex.
    Vec3 displacement_at(const Vec3& p, std::vector<double>& weights,
                         PaletteBody::Workspace& workspace) const;

    PaletteBody body_;
    std::vector<Vec3> displacement_;  ///< edited - original, one per vertex
    std::vector<int> displaced_;      ///< indices of the vertices that move
    std::unique_ptr<const RecolourPlan> plan_;
};

}  // namespace palette4d
