// One thread's work for Precision::kDouble, colour by colour.
#pragma once

#include <cstddef>
#include <vector>

#include "recolour/recolour.hpp"

namespace palette4d {

/// Caches some displacements, since colours repeat in flat areas and in 8-bit images. They depend
/// on the colour alone, so the cache does not change results.
class DoubleWorker final : public RowWorker {
public:
    /// `recolourer` must outlive this and move some colour.
    DoubleWorker(const Recolourer& recolourer, const RecolourOptions& options, int channels);

    void row(const float* from, float* to, int width) override;
    void finish() override {}
    RecolourCounts counts() const override { return {0, 0, count_}; }
    /// Recolours one pixel that is recolourable().
    void recolour(const float* from, float* to);

private:
    struct Entry {
        Vec3 colour, displacement;
        bool known;
    };

    const Vec3& displacement(const Vec3& p);

    const Recolourer& recolourer_;
    const double strength_;
    const bool divide_;
    const int channels_;
    const bool picks_;
    const PickPlan<double> plan_;
    std::vector<double> weights_;
    PaletteBody::Workspace workspace_;
    std::vector<Entry> memory_;
    long long count_ = 0;
};

}  // namespace palette4d
