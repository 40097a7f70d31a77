// One thread's work for Precision::kSingle.
#pragma once

#include <memory>

#include "recolour/recolour.hpp"

namespace palette4d {

/// Single pixels too, with the same bits as row().
class FloatWorker : public RowWorker {
public:
    virtual void pixel(const float* from, float* to) = 0;
};

/// `recolourer` must outlive the worker and move some colour. Its picks count only with `picks`.
std::unique_ptr<FloatWorker> float_worker(const Recolourer& recolourer,
                                          const RecolourOptions& options, int channels, bool picks);

}  // namespace palette4d
