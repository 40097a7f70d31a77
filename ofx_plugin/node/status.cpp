#include "status.hpp"

#include <locale>
#include <optional>
#include <sstream>

#include "paths.hpp"

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
    return text.str();
}

}  // namespace

std::string words_of_picture(const Sidecar& sidecar, const std::string& picture) {
    std::string text = "expects the picture in " + picture;
    if (picture != sidecar.clip.encoding) text += "; the palette is in " + sidecar.clip.encoding;
    return text;
}

std::string status_of(const Chosen& chosen, int handles, const std::string& expects,
                      const std::string& copy, const std::string& shown) {
    if (!chosen.any) {
        return chosen.media.empty() ? "No sidecar chosen"
                                    : "No sidecar chosen, and none found for " + chosen.media;
    }
    if (!chosen.result.loaded) return chosen.result.problem;
    std::string text = describe(chosen.result.loaded->sidecar());
    if (handles > 0) {
        text +=
            ", " + counted(static_cast<std::size_t>(handles), "handle", "handles") + " in use here";
    }
    const std::string& source = chosen.result.loaded->sidecar().clip.source;
    if (!chosen.media.empty() && !same_clip(chosen.media, source)) {
        text += "\nnote: this sidecar is of " + source + ", and the host's clip is " + chosen.media;
    }
    for (const std::string& line : {expects, copy, shown}) {
        if (!line.empty()) text += "\n" + line;
    }
    return text;
}

}  // namespace palette4d::node
