#include "threads/share_rows.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace palette4d {
namespace {

/// Rows that a thread takes at once.
constexpr int kMostRowsAtOnce = 16;

}  // namespace

void share_rows(int count, int threads, const std::function<void(const NextRow&)>& work) {
    if (threads == 0) threads = static_cast<int>(std::thread::hardware_concurrency());
    threads = std::clamp(threads, 1, std::max(count, 1));
    // Several rows at a time, but few enough to keep all threads busy to the end.
    const int band = std::clamp(count / threads / 8, 1, kMostRowsAtOnce);
    std::atomic<int> next{0};
    std::exception_ptr problem;
    std::mutex guard;
    const auto guarded = [&] {
        int row = 0, end = 0;
        const NextRow next_row = [&] {
            if (row == end) {
                row = next.fetch_add(band);
                end = row + band;
            }
            return row < count ? row++ : -1;
        };
        try {
            work(next_row);
        } catch (...) {
            const std::lock_guard<std::mutex> lock(guard);
            if (!problem) problem = std::current_exception();
            next = count;
        }
    };
    std::vector<std::thread> helpers;
    helpers.reserve(static_cast<std::size_t>(threads - 1));
    try {
        for (int i = 1; i < threads; ++i) helpers.emplace_back(guarded);
    } catch (const std::system_error&) {
        // The system gives no more threads: those that run share the rows.
    }
    guarded();
    for (std::thread& helper : helpers) helper.join();
    if (problem) std::rethrow_exception(problem);
}

}  // namespace palette4d
