// The node's status line.
#pragma once

#include <string>

#include "params.hpp"
#include "sidecar_cache.hpp"

namespace palette4d::plugin {

/// What was loaded, or what is wrong; `handles` are in use in the host, and `shown` says which
/// frame is shown, if that is known.
std::string status_of(const SidecarResult& result, bool chosen, int handles,
                      const std::string& shown);

}  // namespace palette4d::plugin
