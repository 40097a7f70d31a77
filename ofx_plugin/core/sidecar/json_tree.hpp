// The text of a sidecar as a JSON tree, under limits of size and depth.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace palette4d {

/// Throws SidecarError with `file`, and the place, for text that is no JSON or beyond the limits.
/// A name twice in an object is refused.
nlohmann::json json_tree(const std::string& text, const std::string& file);

/// One reference token of a JSON pointer (RFC 6901, section 3), with its slash.
std::string pointer_token(const std::string& name);

}  // namespace palette4d
