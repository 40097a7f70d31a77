// Decompresses zlib streams (RFC 1950) with DEFLATE data (RFC 1951).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace palette4d {

/// The bytes of a base64 text (RFC 4648, with padding and without line breaks); none for any other.
std::optional<std::string> from_base64(const std::string& text);
/// The `size` bytes of a zlib stream; none where it is damaged or has another number of bytes.
std::optional<std::vector<std::uint8_t>> inflated(const std::string& stream, std::size_t size);

}  // namespace palette4d
