#include "lattice/mvc_worker.hpp"

#include <algorithm>
#include <cstdint>

#include "model/vec3.hpp"
#include "simd/kernel_choice.hpp"

namespace palette4d {

template <class T>
MvcWorker::Stage<T>::Stage(const PlanMemory<T>& memory, const Kernels<T>& of)
    : plan(memory.plan()),
      usable(memory.usable()),
      kernels(of),
      scratch(usable ? plan : Plan<T>{}) {
    plan.convex = false;
    plan.beyond = true;
}

template <class T>
template <class From, class To, class Failed>
void MvcWorker::Stage<T>::run(std::size_t count, const From& from, const To& to,
                              const Failed& failed) {
    constexpr std::size_t kSize = Block<T>::kSize;
    const T tolerance = static_cast<T>(kSingleTolerance) * std::max(T(1), plan.spread);
    for (std::size_t at = 0; at < count; at += kSize) {
        const std::size_t size = std::min(kSize, count - at);
        if (usable) {
            for (std::size_t i = 0; i < size; ++i) {
                for (std::size_t c = 0; c < 3; ++c) block.colour[c][i] = from(at + i)[c];
            }
            kernels.inside(plan, block, static_cast<int>(size), tolerance, T(0), scratch.data());
        }
        for (std::size_t i = 0; i < size; ++i) {
            if (usable && block.verdict[i] > 0) {
                for (std::size_t c = 0; c < 3; ++c) {
                    to(at + i)[c] = static_cast<float>(block.moved[c][i]);
                }
            } else {
                failed(at + i);
            }
        }
    }
}

MvcWorker::MvcWorker(const Recolourer& recolourer, InstructionSet instructions)
    : recolourer_(recolourer),
      single_(recolourer.plan().single.palette, kernels_of<MvcKernels>(instructions).single),
      twofold_(recolourer.plan().twofold.palette, kernels_of<MvcKernels>(instructions).twofold),
      weights_(recolourer.original().size()) {}

void MvcWorker::displacements(const float* colours, std::size_t count, float* moved) {
    others_.clear();
    single_.run(
        count, [&](std::size_t i) { return colours + 3 * i; },
        [&](std::size_t i) { return moved + 3 * i; },
        [&](std::size_t i) { others_.push_back({colours + 3 * i, moved + 3 * i}); });
    twofold_.run(
        others_.size(), [&](std::size_t i) { return others_[i].first; },
        [&](std::size_t i) { return others_[i].second; },
        [&](std::size_t i) { one_by_one(others_[i].first, others_[i].second); });
}

/// Needed in the plane of a face, for example. Outside, never the closest point: it bends at the
/// surface, and a node that used it would not match its neighbours.
void MvcWorker::one_by_one(const float* colour, float* moved) {
    const Vec3 p{static_cast<double>(colour[0]), static_cast<double>(colour[1]),
                 static_cast<double>(colour[2])};
    recolourer_.body().mean_value(p, weights_.data(), workspace_);
    Vec3 sum{};
    for (std::size_t i = 0; i < weights_.size(); ++i) {
        sum = sum + weights_[i] * recolourer_.displacement()[i];
    }
    for (std::size_t c = 0; c < 3; ++c) moved[c] = static_cast<float>(sum[c]);
}

}  // namespace palette4d
