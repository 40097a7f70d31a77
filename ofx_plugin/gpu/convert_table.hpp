// A conversion of colour spaces as the kernel reads it (kernel/convert.inc).
#pragma once

#include "convert/colour_conversion.hpp"
#include "gpu/frame_table.hpp"

namespace palette4d::gpu {

/// Whether its numbers are single precision's: curves still rise, and nothing is infinite.
bool fits(const ColourConversion& conversion);
/// What it adds to a table, in floats.
std::size_t table_size(const ColourConversion& conversion);
void add_conversion(const ColourConversion& conversion, FrameTable& to);

}  // namespace palette4d::gpu
