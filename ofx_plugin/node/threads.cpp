#include "threads.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>

namespace palette4d::node {
namespace {

struct Work {
    int first, last, band_rows;
    std::int64_t bands;
    const std::function<void(int, int)>& band;
    const std::function<bool()>& stop;
    std::atomic<std::int64_t> next{0};
    std::atomic<bool> stopped{false};
    std::mutex mutex{};
    std::exception_ptr error{};

    void run() {
        while (!stopped.load()) {
            const std::int64_t index = next.fetch_add(1);
            if (index >= bands) return;
            try {
                if (stop()) {
                    stopped = true;
                    return;
                }
                const std::int64_t y1 = first + index * band_rows;
                const std::int64_t y2 = std::min<std::int64_t>(last, y1 + band_rows);
                band(static_cast<int>(y1), static_cast<int>(y2));
            } catch (...) {
                // Exceptions must not enter the host's threads.
                const std::lock_guard<std::mutex> lock(mutex);
                if (!error) error = std::current_exception();
                stopped = true;
            }
        }
    }
};

void run_band(unsigned int, unsigned int, void* work) { static_cast<Work*>(work)->run(); }

}  // namespace

int thread_count(const Suites& suites) {
    const OfxMultiThreadSuiteV1* host = suites.thread;
    unsigned int processors = 1;
    if (host && host->multiThread && host->multiThreadNumCPUs &&
        host->multiThreadNumCPUs(&processors) != kOfxStatOK) {
        processors = 1;
    }
    return static_cast<int>(std::clamp(processors, 1u, 1024u));
}

void for_each_band(const Suites& suites, int first, int last,
                   const std::function<void(int, int)>& band, const std::function<bool()>& stop,
                   int band_rows) {
    const std::int64_t rows = static_cast<std::int64_t>(last) - first;
    if (rows <= 0) return;
    Work work{first, last, band_rows, (rows + band_rows - 1) / band_rows, band, stop};
    const auto wanted =
        static_cast<unsigned int>(std::min<std::int64_t>(work.bands, thread_count(suites)));
    if (wanted > 1) suites.thread->multiThread(&run_band, wanted, &work);
    // Does the rest where a host refused or started fewer threads; usually nothing.
    work.run();
    if (work.error) std::rethrow_exception(work.error);
}

}  // namespace palette4d::node
