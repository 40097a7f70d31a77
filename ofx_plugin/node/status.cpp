#include "status.hpp"

#include <algorithm>
#include <iomanip>
#include <locale>
#include <optional>
#include <sstream>
#include <utility>

#include "model/sidecar_error.hpp"
#include "paths.hpp"

namespace palette4d::node {
namespace {

/// Bytes of a clip's name that are shown: as many as a file's name has.
constexpr std::size_t kLongestName = 255;

std::string short_name(const std::string& name) {
    std::size_t end = 0;
    while (end < name.size() && end < kLongestName) {
        end += std::max<std::size_t>(1, utf8_length(name, end));
    }
    return end < name.size() ? name.substr(0, end) + "..." : name;
}

std::string counted(std::size_t count, const char* one, const char* many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::size_t handle_edits(const Edits& edits) {
    std::size_t count = edits.stops.size();
    for (const std::optional<Vec3>& rgb : edits.vertex_rgb) count += rgb.has_value();
    return count;
}

std::string describe(const Sidecar& sidecar) {
    const std::size_t edits = handle_edits(sidecar.edits);
    const ClipInfo& clip = sidecar.clip;
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << short_name(clip.name) << ": frames " << clip.first << "-" << clip.last << " at "
         << static_cast<double>(clip.rate_num) / static_cast<double>(clip.rate_den) << " fps, "
         << counted(sidecar.polytope.vertices().size(), "handle", "handles") << ", "
         << counted(edits, "edit", "edits");
    std::size_t picks = 0;
    for (const Pick& pick : sidecar.edits.picks) picks += pick.enabled;
    if (picks > 0) text << ", " << counted(picks, "pick or hold", "picks and holds");
    return text.str();
}

std::string words_of_play(const Sidecar& sidecar) {
    if (!sidecar.play) return "";
    if (sidecar.play->speed == 0) return "the edit shows a freeze frame";
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text << "the edit plays it with Speed " << std::setprecision(9) << sidecar.play->speed
         << (sidecar.play->reverse ? ", Reverse on" : "") << ", In-point "
         << sidecar.play->in_point;
    return text.str();
}

/// Bytes of a line in the status or a message: two of the longest paths. Each text of a file may
/// have 64 MB.
constexpr std::size_t kLongestLine = 8192;

/// The code point of two or three bytes at `i`, or of one byte below 128; its length otherwise 1.
std::pair<unsigned, std::size_t> code_point(const std::string& text, std::size_t i) {
    const auto byte = [&](std::size_t at) {
        return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
    };
    const unsigned first = byte(i), second = byte(i + 1), third = byte(i + 2);
    if ((first & 0xe0) == 0xc0 && (second & 0xc0) == 0x80) {
        return {(first & 0x1f) << 6 | (second & 0x3f), 2};
    }
    if ((first & 0xf0) == 0xe0 && (second & 0xc0) == 0x80 && (third & 0xc0) == 0x80) {
        return {(first & 0x0f) << 12 | (second & 0x3f) << 6 | (third & 0x3f), 3};
    }
    return {first, 1};
}

bool acts_on_terminals(unsigned code, std::size_t length) {
    const bool control = code < 0x20 || code == 0x7f || (length == 2 && code < 0xa0);
    return (control && code != '\n') || code == 0x61c || code == 0x200e || code == 0x200f ||
           (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
}

std::string words_of_versions(const Sidecar& sidecar) {
    std::string text;
    for (const NamedVersion& one : sidecar.versions) {
        text += (text.empty() ? "versions '" : ", '") + one.name + "'";
    }
    return text;
}

}  // namespace

std::string without_controls(const std::string& text) {
    static const char* const kDigits = "0123456789abcdef";
    std::string result;
    std::size_t line = 0;  ///< where it begins in the result
    for (std::size_t i = 0; i < text.size();) {
        if (text[i] == '\n') {
            line = result.size() + 1;
        } else if (result.size() - line >= kLongestLine) {
            result += "...";
            i = std::min(text.find('\n', i), text.size());
            continue;
        }
        const auto [code, length] = code_point(text, i);
        if (acts_on_terminals(code, length)) {
            result += "\\u";
            for (const unsigned shift : {12u, 8u, 4u, 0u}) result += kDigits[code >> shift & 15];
        } else {
            result.append(text, i, length);
        }
        i += length;
    }
    return result;
}

bool has_edits(const Sidecar& sidecar) {
    return handle_edits(sidecar.edits) > 0 || !sidecar.edits.picks.empty() ||
           !sidecar.versions.empty();
}

std::string words_of_picture(const Sidecar& sidecar, const std::string& picture) {
    std::string text = "expects the picture in " + picture;
    if (picture != sidecar.clip.encoding) text += "; the palette is in " + sidecar.clip.encoding;
    return text;
}

std::string status_of(const Chosen& chosen, const std::vector<std::string>& first, int handles,
                      const std::vector<std::string>& last) {
    std::vector<std::string> lines = first;
    if (!chosen.any) {
        lines.push_back(chosen.media.empty()
                            ? "No sidecar chosen"
                            : "No sidecar chosen, and none found for " + chosen.media);
    } else if (!chosen.result.loaded) {
        lines.push_back(chosen.result.problem);
    } else {
        const Sidecar& sidecar = chosen.result.loaded->sidecar();
        std::string text = describe(sidecar);
        if (!chosen.version.empty()) text += " in version '" + chosen.version + "'";
        if (handles > 0) {
            text += ", " + counted(static_cast<std::size_t>(handles), "handle", "handles") +
                    " in use here";
        }
        lines.push_back(text);
        if (!chosen.embedded) lines.push_back("file " + chosen.path);
        lines.push_back(words_of_versions(sidecar));
        lines.push_back(words_of_play(sidecar));
        if (!chosen.media.empty() && !same_clip(chosen.media, sidecar.clip.source)) {
            lines.push_back("note: this sidecar is of " + sidecar.clip.source +
                            ", and the host's clip is " + chosen.media);
        }
        lines.insert(lines.end(), last.begin(), last.end());
    }
    std::string text;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (lines[i].empty()) continue;
        if (!text.empty()) text += '\n';
        // A name of the file's begins no line; errors of programs may have several.
        for (const char c : lines[i]) {
            text += c == '\n' && i >= first.size() ? std::string("\\n") : std::string(1, c);
        }
    }
    return without_controls(text);
}

}  // namespace palette4d::node
