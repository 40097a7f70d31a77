// One thread's displacements by mean value coordinates, outside of the palette as well.
#pragma once

#include <utility>
#include <vector>

#include "exact_worker.hpp"
#include "recolour_plan.hpp"

namespace palette4d {

/// Outside, the coordinates go on across a face as smoothly as they are inside, for a while.
class MeanValueWorker {
public:
    /// `recolourer` must outlive this, move some colour and be solid.
    MeanValueWorker(const Recolourer& recolourer, InstructionSet instructions);

    /// Of `count` colours, (count, 3). Where single precision does not do, of the exact
    /// recolouring: inside the same, outside the closest point's.
    void displacements(const float* colours, std::size_t count, float* moved);

private:
    const Plan<float>& plan_;
    const bool usable_;
    const Kernels<float> kernels_;
    ExactWorker exact_;
    Block<float> block_{};
    Scratch<float> scratch_;
    std::vector<std::pair<const float*, float*>> others_;  ///< colours and results of exact_
};

}  // namespace palette4d
