#include "mean_value_worker.hpp"

#include <algorithm>
#include <cstdint>

#include "kernel_choice.hpp"
#include "recolour_plan.hpp"

namespace palette4d {
namespace {

RecolourOptions with(InstructionSet instructions) {
    RecolourOptions options;
    options.instructions = instructions;
    return options;
}

}  // namespace

MeanValueWorker::MeanValueWorker(const Recolourer& recolourer, InstructionSet instructions)
    : plan_(recolourer.plan().single.plan()),
      usable_(recolourer.plan().single.usable()),
      kernels_(kernels_of(instructions).single),
      exact_(recolourer, with(instructions)),
      scratch_(usable_ ? plan_ : Plan<float>{}) {}

void MeanValueWorker::displacements(const float* colours, std::size_t count, float* moved) {
    constexpr std::size_t kSize = Block<float>::kSize;
    const float tolerance = static_cast<float>(kSingleTolerance) * std::max(1.0f, plan_.spread);
    for (std::size_t at = 0; at < count; at += kSize, colours += 3 * kSize, moved += 3 * kSize) {
        const std::size_t size = std::min(kSize, count - at);
        if (usable_) {
            for (std::size_t i = 0; i < size; ++i) {
                for (std::size_t c = 0; c < 3; ++c) block_.high[c][i] = colours[3 * i + c];
            }
            kernels_.mean_value(plan_, block_, static_cast<int>(size), tolerance, scratch_.data());
        }
        for (std::size_t i = 0; i < size; ++i) {
            float* const to = moved + 3 * i;
            if (usable_ && block_.verdict[i] > 0) {
                for (std::size_t c = 0; c < 3; ++c) to[c] = block_.moved[c][i];
            } else {
                others_.push_back({colours + 3 * i, to});
                exact_.pixel(colours + 3 * i, to, 3);
            }
        }
    }
    exact_.finish();
    for (const auto& [colour, to] : others_) {
        for (std::size_t c = 0; c < 3; ++c) to[c] -= colour[c];
    }
    others_.clear();
}

}  // namespace palette4d
