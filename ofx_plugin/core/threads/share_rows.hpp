// Shares work among threads: the rows of a picture, the frames of a clip.
#pragma once

#include <functional>

namespace palette4d {

/// Returns the numbers 0 to count - 1, each once; then -1.
using NextRow = std::function<int()>;

/// Calls `work` in up to `threads` threads, this one included (0: one per processor). After an
/// exception no more rows are handed out. The first exception is rethrown when all threads have
/// returned.
void share_rows(int count, int threads, const std::function<void(const NextRow&)>& work);

}  // namespace palette4d
