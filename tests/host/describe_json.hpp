// What a plugin describes, as text.
#pragma once

#include <string>

#include "strict_host.hpp"

namespace strict {

/// The parameters of a description, in their order: an object of the names, each with `type`,
/// `label`, `options` and, where it has them, `default`, `min`, `max`, `displayMin`, `displayMax`
/// and `animates`; a value of several components is an array.
std::string described_json(const OfxImageEffectStruct& descriptor);

}  // namespace strict
