// The text of a sidecar as a JSON tree, under limits of size and depth.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace palette4d {

/// Members keep their order.
using Json = nlohmann::ordered_json;

/// Limits of a tree: the format itself has six levels. "[],[],[]" takes twenty times the memory of
/// its text.
constexpr std::size_t kMaxDepth = 64, kMaxValues = 4'000'000;

/// Throws SidecarError for text beyond the limit of sidecars.
void require_size(const std::string& text, const std::string& file);
/// Throws SidecarError with `file`, and the place, for text that is no JSON or beyond the limits.
/// A name twice in an object is refused.
Json json_tree(const std::string& text, const std::string& file);

/// An integer beyond 64 bits, as its digits: no number to the format, but kept as it is.
Json long_integer(const std::string& digits);
/// Its digits.
std::string digits_of(const Json& long_integer);

/// One reference token of a JSON pointer (RFC 6901, section 3), with its slash.
std::string pointer_token(const std::string& name);

}  // namespace palette4d
