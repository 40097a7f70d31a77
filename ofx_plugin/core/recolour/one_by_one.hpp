// One thread's work in Precision::kDouble, colour by colour.
#pragma once

#include <cstddef>
#include <vector>

#include "recolour/recolour.hpp"

namespace palette4d {

/// Colours repeat, in flat areas next to each other and in 8-bit pictures all over: a worker
/// remembers some that it has met. The displacement depends on the colour alone, so that what is
/// remembered never shows in the result.
class OneByOne {
public:
    /// `recolourer` must outlive this and move some colour.
    OneByOne(const Recolourer& recolourer, const RecolourOptions& options);

    void row(const float* in, float* out, int width, int channels);
    /// `from` is finite, with an alpha that can be divided by where colours are premultiplied.
    void recolour(const float* from, float* to);
    long long count() const { return count_; }

private:
    struct Entry {
        Vec3 colour, displacement;
        bool known;
    };

    const Vec3& displacement(const Vec3& p);

    const Recolourer& recolourer_;
    const double strength_;
    const bool divide_;
    std::vector<double> weights_;
    PaletteBody::Workspace workspace_;
    std::vector<Entry> memory_;
    long long count_ = 0;
};

}  // namespace palette4d
