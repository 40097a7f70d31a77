// Writes EXR files: half floats, uncompressed, by scanlines.
#pragma once

#include <filesystem>

#include "pixels.hpp"

namespace palette4d::node {

/// Writes the whole image: RGB, and its alpha where it is premultiplied, as EXR has it. False where
/// that fails; a part of the file may then be there. Only for three or four channels.
bool write_exr(const std::filesystem::path& path, const Image& image);

}  // namespace palette4d::node
