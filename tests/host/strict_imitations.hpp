// Hosts that the strict host can imitate, as far as what they do is published. None of them is the
// host itself: what passes here may still fail there, what fails here fails there.
#pragma once

#include <string>
#include <vector>

#include "strict_host.hpp"

namespace strict {

struct Imitation {
    std::string name;
    Config config;
    std::string context = kOfxImageEffectContextFilter;
    std::vector<Layout> layouts;   ///< of the pictures that it hands over
    int tile = 0;                  ///< renders squares of this size; 0: all at once
    bool tells_changes = true;     ///< sends InstanceChanged
    bool fresh_instances = false;  ///< one for every frame, created with the defaults
};

const std::vector<Imitation>& imitations();

}  // namespace strict
