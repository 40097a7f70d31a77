// Any bytes at all as a sidecar, and what the node does with those that pass for one.
#include <cstdint>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>

#include "fuzz.hpp"
#include "model/handles.hpp"
#include "model/lineage.hpp"
#include "model/ramps.hpp"
#include "recolour/recolour.hpp"
#include "sidecar/clip_name.hpp"
#include "sidecar/sidecar.hpp"

namespace {

using namespace palette4d;

/// A frame of a sidecar that was accepted: whatever it holds, nothing may come of it but numbers.
/// Picks take most of the time, hence not at each frame.
void use(const Sidecar& sidecar, const Edits& edits, double frame, bool with_picks) {
    const Slice slice = slice_at(sidecar.polytope, frame);
    const std::vector<Handle> handles = handles_of(sidecar.polytope, edits);
    const Lineage lineage(sidecar.polytope, edits, static_cast<int>(handles.size()) - 1);
    const Recolourer edit(slice.rgb, edited_colours(sidecar.polytope, edits, slice), slice.faces,
                          with_picks ? picks_at(edits, slice.frame) : FramePicks());
    const Recolourer weight(slice.rgb, weight_reader(slice, lineage), slice.faces);
    const float pixels[3][4] = {{0.2f, 0.4f, 0.6f, 1}, {-1, 7, 0.5f, 0.5f}, {0, 0, 0, 0}};
    float result[3][4];
    if (with_picks && !edits.picks.empty()) matte_at(edits, edits.picks[0].id, slice.frame);
    for (const Recolourer* recolourer : {&edit, &weight}) {
        RecolourOptions options;
        options.premultiplied = true;
        recolourer->apply({pixels[0], 3, 1, 4, sizeof pixels}, {result[0], 3, 1, 4, sizeof result},
                          options);
    }
}

/// The other readers of text: of a conversion's steps, and of a path, which leads to no sidecar.
void read_otherwise(const std::string& text) {
    try {
        parse_conversion(text, "fuzz");
    } catch (const SidecarError&) {
    }
    try {
        read_sidecar(text);
        std::abort();
    } catch (const SidecarError&) {
    }
}

}  // namespace

std::string outcome_of(const std::uint8_t* data, std::size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    if (size < 1000) read_otherwise(text);
    try {
        const Sidecar sidecar = parse_sidecar(text, "fuzz");
        if (file_safe(clip_name(sidecar.clip.source)).size() > kLongestName) std::abort();
        const double first = sidecar.polytope.first_frame(), last = sidecar.polytope.last_frame();
        for (const double part : {0.0, 0.31, 0.5, 1.0, 2.0}) {
            try {
                const double frame = first + part * (last - first);
                use(sidecar, sidecar.edits, frame, part == 0.31);
                for (const NamedVersion& version : sidecar.versions) {
                    use(sidecar, version.edits, frame, part == 0.31);
                }
            } catch (const std::invalid_argument&) {
                // The node says so and passes the picture through.
            }
        }
        return "accepted";
    } catch (const SidecarError& error) {
        // In words, and in one line.
        const std::string said = error.what();
        if (error.found().empty() || error.expected().empty() ||
            said.find('\n') != std::string::npos) {
            std::abort();
        }
        return kind_of(error.expected());
    }
}
