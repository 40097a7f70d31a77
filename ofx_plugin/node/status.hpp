// The node's status line.
#pragma once

#include <string>
#include <vector>

#include "sidecar_choice.hpp"

namespace palette4d::node {

/// Whether it has edits or versions.
bool has_edits(const Sidecar& sidecar);

/// Which encoding the node's picture must have.
std::string words_of_picture(const Sidecar& sidecar, const std::string& picture);

/// What was loaded with its file, version and edits, or what is wrong. `handles` counts the host's
/// handles in use. The others are lines, omitted when empty: `first` those that come before, and
/// `last` the expected encoding, the project's copy and the frame.
std::string status_of(const Chosen& chosen, const std::vector<std::string>& first, int handles,
                      const std::vector<std::string>& last);

/// The text (UTF-8) without what acts on a terminal: control characters but line breaks, and marks
/// that turn the direction of writing, become escapes such as \u001b.
std::string without_controls(const std::string& text);

}  // namespace palette4d::node
