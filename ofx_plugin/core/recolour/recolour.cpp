#include "recolour/recolour.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"
#include "recolour/exact_worker.hpp"
#include "recolour/one_by_one.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d {

Recolourer::Recolourer(std::vector<Vec3> original, const std::vector<Vec3>& edited,
                       std::vector<Face> faces)
    : body_(std::move(original), std::move(faces)) {
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
    if (!displaced_.empty()) plan_ = std::make_unique<RecolourPlan>(body_, displacement_);
}

Recolourer::~Recolourer() = default;

Vec3 Recolourer::displacement_at(const Vec3& p, std::vector<double>& weights,
                                 PaletteBody::Workspace& workspace) const {
    body_.project(p, weights.data(), workspace);
    Vec3 sum{};
    for (const int i : displaced_) sum = sum + weights[i] * displacement_[i];
    return sum;
}

Vec3 Recolourer::displaced(const Vec3& p, double strength) const {
    if (!moves() || strength == 0 || !finite(p)) return p;
    std::vector<double> weights(body_.rgb().size());
    PaletteBody::Workspace workspace;
    const Vec3 moved = displacement_at(p, weights, workspace);
    Vec3 result = p;
    for (std::size_t c = 0; c < 3; ++c) {
        const double step = strength * moved[c];
        if (step != 0) result[c] += step;
    }
    return result;
}

std::unique_ptr<RowWorker> Recolourer::worker(const RecolourOptions& options, int channels) const {
    if (options.precision == Precision::kDouble) {
        return std::make_unique<OneByOne>(*this, options, channels);
    }
    return exact_worker(*this, options, channels);
}

}  // namespace palette4d
