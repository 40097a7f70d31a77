// One thread's work in Precision::kSingle: of Recolourer::apply(), and pixel by pixel of others.
#pragma once

#include <memory>

#include "recolour/recolour.hpp"

namespace palette4d {

class ExactWorker {
public:
    /// `recolourer` must outlive this and move some colour; its apply() says what `options` may be.
    ExactWorker(const Recolourer& recolourer, const RecolourOptions& options);
    ~ExactWorker();
    ExactWorker(const ExactWorker&) = delete;
    ExactWorker& operator=(const ExactWorker&) = delete;

    /// Pixels that lie next to each other, and one; `from` and `to` stay where they are until
    /// finish() has returned, when all is written. The bits are those of apply().
    void row(const float* from, float* to, int width, int channels);
    void pixel(const float* from, float* to, int channels);
    void finish();
    RecolourCounts counts() const;

private:
    class Pipeline;
    std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace palette4d
