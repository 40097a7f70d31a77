// One thread's displacements by mean value coordinates, outside of the palette as well.
#pragma once

#include <utility>
#include <vector>

#include "recolour/block_kernels.hpp"
#include "recolour/recolour.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d {

/// Outside, the coordinates go on across a face as smoothly as they are inside, for a while.
class MeanValueWorker {
public:
    /// `recolourer` must outlive this, move some colour and be solid.
    MeanValueWorker(const Recolourer& recolourer, InstructionSet instructions);

    /// Of `count` colours, (count, 3).
    void displacements(const float* colours, std::size_t count, float* moved);

private:
    /// The kernel of one precision.
    template <class T>
    struct Stage {
        const Plan<T>& plan;
        const bool usable;
        const Kernels<T> kernels;
        Scratch<T> scratch;
        Block<T> block{};
        Stage(const PlanMemory<T>& memory, const Kernels<T>& of);
        /// The displacements that can be promised; failed(i) for the others.
        template <class From, class To, class Failed>
        void run(std::size_t count, const From& from, const To& to, const Failed& failed);
    };

    void one_by_one(const float* colour, float* moved);

    const Recolourer& recolourer_;
    Stage<float> single_;
    Stage<double> twofold_;
    std::vector<std::pair<const float*, float*>> others_;  ///< colours and results of twofold_
    std::vector<double> weights_;
    PaletteBody::Workspace workspace_;
};

}  // namespace palette4d
