// Any bytes as the copy of a sidecar that a project keeps: what the node loads, prepares and says
// of it, without a host. fuzz_node.cpp has the whole node.
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>

#include "fuzz.hpp"
#include "sidecar_cache.hpp"
#include "status.hpp"

namespace {

using namespace palette4d::node;

/// What the node shows must not act on a terminal.
void check(const std::string& said) {
    for (const char c : said) {
        if (static_cast<unsigned char>(c) < 0x20 && c != '\n') {
            std::cerr << "fuzz_copy: a control character is shown" << std::endl;
            std::abort();
        }
    }
}

void use(LoadedSidecar& loaded) {
    const palette4d::Polytope& polytope = loaded.sidecar().polytope;
    for (const double frame : {polytope.first_frame(), 14.5, polytope.last_frame()}) {
        try {
            loaded.recolourer_at(frame);
            loaded.weight_at(frame, 0);
            loaded.surface_at(frame);
        } catch (const std::invalid_argument&) {
            // The node says so and passes the picture through.
        }
    }
}

}  // namespace

std::string outcome_of(const std::uint8_t* data, std::size_t size) {
    Chosen chosen;
    chosen.any = chosen.embedded = true;
    chosen.path = chosen.media = "clip.mov";
    chosen.result = load_sidecar_text(std::string(reinterpret_cast<const char*>(data), size),
                                      "clip.p4d.json (the project's copy)");
    check(status_of(chosen, {"first"}, 3, {"last"}));
    check(without_controls(chosen.result.problem));
    if (!chosen.result.loaded) {
        return kind_of(chosen.result.problem.substr(chosen.result.problem.rfind("expected") + 1));
    }
    use(*chosen.result.loaded);
    for (const palette4d::NamedVersion& version : chosen.result.loaded->sidecar().versions) {
        use(*chosen.result.loaded->version(version.name));
    }
    return "accepted";
}
