// The node's status line.
#pragma once

#include <string>

#include "sidecar_choice.hpp"

namespace palette4d::node {

/// Which encoding the node's picture must have.
std::string words_of_picture(const Sidecar& sidecar, const std::string& picture);

/// What was loaded, or what is wrong. `handles` counts the host's handles in use. The others are
/// one line each, omitted when empty: `expects` the picture's encoding, `copy` the project's copy,
/// `shown` the frame.
std::string status_of(const Chosen& chosen, int handles, const std::string& expects,
                      const std::string& copy, const std::string& shown);

/// The text (UTF-8) without what acts on a terminal: control characters but line breaks, and marks
/// that turn the direction of writing, become escapes such as \u001b.
std::string printable(const std::string& text);

}  // namespace palette4d::node
