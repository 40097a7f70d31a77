#include "status.hpp"

#include <locale>
#include <optional>
#include <sstream>

namespace palette4d::node {
namespace {

std::string counted(std::size_t count, const char* one, const char* many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string describe(const Sidecar& sidecar) {
    std::size_t edits = sidecar.edits.stops.size();
    for (const std::optional<Vec3>& rgb : sidecar.edits.vertex_rgb) edits += rgb.has_value();
    const ClipInfo& clip = sidecar.clip;
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << clip.name << ": frames " << clip.first << "-" << clip.last << " at "
         << static_cast<double>(clip.rate_num) / static_cast<double>(clip.rate_den) << " fps, "
         << counted(sidecar.polytope.vertices().size(), "palette vertex", "palette vertices")
         << ", " << counted(edits, "edit", "edits");
    if (sidecar.conversion) {
        text << "; " << sidecar.conversion->input_space << ", palette in " << clip.encoding;
    }
    return text.str();
}

}  // namespace

std::string status_of(const Chosen& chosen, int handles, const std::string& copy,
                      const std::string& shown) {
    if (!chosen.any) return "No sidecar chosen";
    if (!chosen.result.loaded) return chosen.result.problem;
    std::string text = describe(chosen.result.loaded->sidecar());
    if (handles > 0) {
        text +=
            ", " + counted(static_cast<std::size_t>(handles), "handle", "handles") + " in use here";
    }
    if (!copy.empty()) text += "; " + copy;
    if (!shown.empty()) text += "; " + shown;
    return text;
}

}  // namespace palette4d::node
