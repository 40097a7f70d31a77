#include "recolour/recolour.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d {

Recolourer::Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
                       std::vector<Face> faces, FramePicks picks)
    : body_(std::move(original), std::move(faces)), picks_(std::move(picks)) {
    const std::vector<Vec3>& colours = body_.rgb();
    if (edited.size() != colours.size()) {
        throw std::invalid_argument("recolour: " + std::to_string(edited.size()) +
                                    " edited colours; expected as many as original ones, " +
                                    std::to_string(colours.size()));
    }
    for (std::size_t i = 0; i < colours.size(); ++i) {
        if (!finite(edited[i])) {
            throw std::invalid_argument("recolour: edited colour " + std::to_string(i) +
                                        " is not finite");
        }
        displacement_.push_back(edited[i] - colours[i]);
        if (displacement_[i] != Vec3{0, 0, 0}) displaced_.push_back(static_cast<int>(i));
    }
    for (const FramePick& pick : picks_.picks) {
        if (!finite(pick.colour) || !finite(pick.change) || !pick.matte ||
            pick.matte->size() != MatteGrid::kSize || !(pick.strength > 0 && pick.strength <= 1)) {
            throw std::invalid_argument(
                "recolour: found a pick with a number that is not finite, without a matte, or with "
                "a strength that is not above 0 and at most 1");
        }
    }
    if (picks_.left && picks_.left->size() != MatteGrid::kSize) {
        throw std::invalid_argument("recolour: found holds whose grid has another size");
    }
    if (!moves()) return;
    // What the palette does to the picked colours: picks do the rest, so that their targets are
    // met.
    std::vector<Vec3> done;
    std::vector<double> weights(colours.size());
    PaletteBody::Workspace workspace;
    for (const FramePick& pick : picks_.picks) {
        const Vec3 moved = palette_displacement(pick.colour, weights, workspace);
        done.push_back(left_at(picks_, pick.colour) * moved);
    }
    plan_ = std::make_unique<RecolourPlan>(body_, displacement_, picks_, done);
}

Recolourer::~Recolourer() = default;

std::size_t Recolourer::bytes() const {
    std::size_t sum =
        sizeof *this + body_.bytes() + vector_bytes(displacement_, displaced_) + picks_.bytes();
    if (plan_) {
        sum += plan_->single.palette.bytes() + plan_->single.picks.bytes() +
               plan_->twofold.palette.bytes() + plan_->twofold.picks.bytes();
    }
    return sum;
}

Vec3 Recolourer::palette_displacement(const Vec3& p, std::vector<double>& weights,
                                      PaletteBody::Workspace& workspace) const {
    if (!palette_moves()) return {0, 0, 0};
    body_.project(p, weights.data(), workspace);
    Vec3 sum{};
    for (const int i : displaced_) sum = sum + weights[i] * displacement_[i];
    return sum;
}

Vec3 Recolourer::displaced(const Vec3& p, double strength, const Spot* spot) const {
    if (!moves() || strength == 0 || !finite(p)) return p;
    std::vector<double> weights(body_.rgb().size());
    PaletteBody::Workspace workspace;
    const Vec3 moved = with_picks(picks_, plan_->twofold.picks.plan(), p,
                                  palette_displacement(p, weights, workspace), spot);
    Vec3 result = p;
    for (std::size_t c = 0; c < 3; ++c) {
        const double step = strength * moved[c];
        if (step != 0) result[c] += step;
    }
    return result;
}

}  // namespace palette4d
