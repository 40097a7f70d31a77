// Bands of rows, shared among the host's threads.
#pragma once

#include <functional>

#include "host.hpp"

namespace palette4d::node {

/// Calls band(y1, y2) for disjoint bands of rows that make up [first, last), in the threads of the
/// host's MultiThread suite where it has one, else in this one. `stop` is asked before each band
/// and ends the work early. Both are called from several threads at once. The first exception of a
/// band ends the work and is thrown again here.
void for_each_band(const Suites& suites, int first, int last,
                   const std::function<void(int, int)>& band, const std::function<bool()>& stop);

}  // namespace palette4d::node
