#include "recolour/recolour.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"
#include "recolour/double_worker.hpp"
#include "recolour/float_worker.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d {

Recolourer::Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
                       std::vector<Face> faces, std::vector<Bump> bumps)
    : body_(std::move(original), std::move(faces)), bumps_(std::move(bumps)) {
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
    for (const Bump& bump : bumps_) {
        if (!finite(bump.centre) || !finite(bump.by) || !(bump.radius > 0) ||
            !std::isfinite(bump.radius)) {
            throw std::invalid_argument(
                "recolour: found a bump with a number that is not finite, or with no radius");
        }
        if (!(dot(bump.along, bump.along) < 1)) {
            throw std::invalid_argument(
                "recolour: found a bump that is infinitely long, expected a shorter `along` than "
                "1");
        }
        if (!(bump.keep >= 0 && bump.keep <= 1)) {
            throw std::invalid_argument("recolour: found a hold that keeps " +
                                        std::to_string(bump.keep) + ", expected 0 to 1");
        }
    }
    const auto still = [](const Bump& bump) { return bump.keep == 0 && bump.by == Vec3{0, 0, 0}; };
    bumps_.erase(std::remove_if(bumps_.begin(), bumps_.end(), still), bumps_.end());
    const auto moving = [](const Bump& bump) { return bump.keep == 0; };
    const auto holds = std::stable_partition(bumps_.begin(), bumps_.end(), moving);
    if (holds == bumps_.begin() && displaced_.empty()) bumps_.clear();
    if (moves()) plan_ = std::make_unique<RecolourPlan>(body_, displacement_, bumps_);
}

Recolourer::~Recolourer() = default;

Vec3 Recolourer::palette_displacement(const Vec3& p, std::vector<double>& weights,
                                      PaletteBody::Workspace& workspace) const {
    if (!palette_moves()) return {0, 0, 0};
    body_.project(p, weights.data(), workspace);
    Vec3 sum{};
    for (const int i : displaced_) sum = sum + weights[i] * displacement_[i];
    return sum;
}

Vec3 Recolourer::with_bumps(const Vec3& p, const Vec3& moved) const {
    Vec3 sum = moved;
    for (const Bump& bump : bumps_) {
        const Vec3 away = bump.centre - p;
        const double along = dot(bump.along, away);
        const double t =
            std::max(0.0, 1 - (dot(away, away) - along * along) / (bump.radius * bump.radius));
        const double weight = t * t * t, rest = 1 - weight;
        if (bump.keep > 0) {
            sum = (1 - bump.keep * (1 - rest * rest * rest)) * sum;
        } else {
            add(sum, weight, bump.by);
        }
    }
    return sum;
}

Vec3 Recolourer::displaced(const Vec3& p, double strength) const {
    if (!moves() || strength == 0 || !finite(p)) return p;
    std::vector<double> weights(body_.rgb().size());
    PaletteBody::Workspace workspace;
    const Vec3 moved = with_bumps(p, palette_displacement(p, weights, workspace));
    Vec3 result = p;
    for (std::size_t c = 0; c < 3; ++c) {
        const double step = strength * moved[c];
        if (step != 0) result[c] += step;
    }
    return result;
}

std::unique_ptr<RowWorker> Recolourer::worker(const RecolourOptions& options, int channels) const {
    if (options.precision == Precision::kDouble) {
        return std::make_unique<DoubleWorker>(*this, options, channels, true);
    }
    return float_worker(*this, options, channels, true);
}

}  // namespace palette4d
