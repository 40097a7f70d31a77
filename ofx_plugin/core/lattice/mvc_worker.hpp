// One thread's displacements by mean value coordinates, also outside the palette.
#pragma once

#include <utility>
#include <vector>

#include "recolour/mvc_kernels.hpp"
#include "recolour/recolour.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d {

/// Outside, these coordinates extend smoothly across a face, for a short distance.
class MvcWorker {
public:
    /// `recolourer` must outlive this, move some colour, and have a solid palette.
    MvcWorker(const Recolourer& recolourer, InstructionSet instructions);

    /// Writes the displacements of `count` colours, (count, 3).
    void displacements(const float* colours, std::size_t count, float* moved);

private:
    /// The kernel of one precision.
    template <class T>
    struct Stage {
        Plan<T> plan;
        const bool usable;
        const Kernels<T> kernels;
        Scratch<T> scratch;
        Block<T> block{};
        Stage(const PlanMemory<T>& memory, const Kernels<T>& of);
        /// Writes the displacements whose error is bounded; calls failed(i) for the others.
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
