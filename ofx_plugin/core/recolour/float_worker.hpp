// One thread's work for Precision::kSingle.
#pragma once

#include <memory>

#include "recolour/recolour.hpp"

namespace palette4d {

/// `recolourer` must outlive the worker and move some colour.
std::unique_ptr<RowWorker> float_worker(const Recolourer& recolourer,
                                        const RecolourOptions& options, int channels);

}  // namespace palette4d
