// The node's status line.
#pragma once

#include <string>

#include "sidecar_choice.hpp"

namespace palette4d::node {

/// What was loaded, or what is wrong. `handles` are in use in the host; `copy` says what there is
/// to say of the project's copy, and `shown` which frame is shown: empty for nothing.
std::string status_of(const Chosen& chosen, int handles, const std::string& copy,
                      const std::string& shown);

}  // namespace palette4d::node
