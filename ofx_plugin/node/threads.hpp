// Runs bands of rows in the host's threads.
#pragma once

#include <functional>

#include "host.hpp"

namespace palette4d::node {

/// Rows of a band: few enough to notice an abort soon and to share evenly; enough for low overhead.
inline constexpr int kBandRows = 16;

/// How many threads for_each_band() uses at most.
int thread_count(const Suites& suites);

/// Calls band(y1, y2) for disjoint bands of rows that cover [first, last). Uses the host's
/// MultiThread suite if there is one, else this thread. Calls `stop` before each band, and ends
/// early when it returns true. Both may run in several threads at once. The first exception in a
/// band ends the work and is rethrown here.
void for_each_band(const Suites& suites, int first, int last,
                   const std::function<void(int, int)>& band, const std::function<bool()>& stop,
                   int band_rows = kBandRows);

}  // namespace palette4d::node
