// Rows of images that somebody else owns, and sharing them among threads. The core's own.
#pragma once

#include <functional>

#include "recolour/recolour.hpp"

namespace palette4d {

inline const float* row_of(const ConstImageView& view, int y) {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(view.data) +
                                          view.row_bytes * y);
}
inline float* row_of(const ImageView& view, int y) {
    return reinterpret_cast<float*>(reinterpret_cast<char*>(view.data) + view.row_bytes * y);
}

/// Throws std::invalid_argument when the views or the options cannot be used.
void check_recolouring(const ConstImageView& in, const ImageView& out,
                       const RecolourOptions& options);

/// Copies the rows that do not lie in the same place.
void copy_rows(const ConstImageView& in, const ImageView& out);

/// Hands out the numbers 0 to count - 1, each once; -1 when there are none left.
using NextRow = std::function<int()>;

/// Calls `work` in up to `threads` threads (0: one per processor), this one among them. The first
/// exception ends the handing out, and is thrown when all have returned.
void share_rows(int count, int threads, const std::function<void(const NextRow&)>& work);

}  // namespace palette4d
