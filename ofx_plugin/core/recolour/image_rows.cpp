#include "recolour/image_rows.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

namespace palette4d {
namespace {

/// Neighbouring rows have the same colours: threads that each work on one wait for each other where
/// these are to be prepared first (the cells of a Lattice).
constexpr int kMostRowsAtOnce = 16;

template <class View>
void check_view(const View& view, const char* name) {
    const std::string what = std::string("recolour: the ") + name + " image ";
    if (view.channels != 3 && view.channels != 4) {
        throw std::invalid_argument(what + "has " + std::to_string(view.channels) +
                                    " channels; expected 3 or 4");
    }
    if (view.width < 0 || view.height < 0) {
        throw std::invalid_argument(what + "is " + std::to_string(view.width) + " by " +
                                    std::to_string(view.height) + "; expected no negative size");
    }
    if (view.width == 0 || view.height == 0) return;
    if (view.data == nullptr) throw std::invalid_argument(what + "has no data");
    const auto row = static_cast<std::ptrdiff_t>(sizeof(float)) * view.width * view.channels;
    if (view.height > 1 && std::abs(view.row_bytes) < row) {
        throw std::invalid_argument(what + "has rows " + std::to_string(view.row_bytes) +
                                    " bytes apart; expected at least " + std::to_string(row));
    }
}

}  // namespace

void check_recolouring(const ConstImageView& in, const ImageView& out,
                       const RecolourOptions& options) {
    check_view(in, "input");
    check_view(out, "output");
    if (in.width != out.width || in.height != out.height || in.channels != out.channels) {
        const auto size = [](const auto& view) {
            return std::to_string(view.width) + " by " + std::to_string(view.height) + " with " +
                   std::to_string(view.channels) + " channels";
        };
        throw std::invalid_argument("recolour: the output image is " + size(out) +
                                    "; expected that of the input image, " + size(in));
    }
    if (!std::isfinite(options.strength)) {
        throw std::invalid_argument("recolour: the strength is not finite");
    }
    if (options.threads < 0) {
        throw std::invalid_argument("recolour: " + std::to_string(options.threads) +
                                    " threads; expected 0 (one per processor) or more");
    }
    resolved(options.instructions);
}

void copy_rows(const ConstImageView& in, const ImageView& out) {
    const std::size_t bytes =
        sizeof(float) * static_cast<std::size_t>(in.width) * static_cast<std::size_t>(in.channels);
    for (int y = 0; y < in.height; ++y) {
        if (row_of(in, y) != row_of(out, y)) std::memmove(row_of(out, y), row_of(in, y), bytes);
    }
}

void share_rows(int count, int threads, const std::function<void(const NextRow&)>& work) {
    if (threads == 0) threads = static_cast<int>(std::thread::hardware_concurrency());
    threads = std::clamp(threads, 1, std::max(count, 1));
    // Several rows in a piece, as long as there is work for all to the end.
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
        // No more threads to be had: those that run share the rows.
    }
    guarded();
    for (std::thread& helper : helpers) helper.join();
    if (problem) std::rethrow_exception(problem);
}

}  // namespace palette4d
