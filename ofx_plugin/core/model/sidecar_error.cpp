#include "model/sidecar_error.hpp"

#include <utility>

namespace palette4d {
namespace {

/// The length of the well-formed UTF-8 sequence at text[at], 0 when there is none.
std::size_t utf8_length(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const auto tail = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xbf) {
        return byte(i) >= low && byte(i) <= high;
    };
    const unsigned lead = byte(at);
    if (lead < 0x80) return 1;
    if (lead >= 0xc2 && lead <= 0xdf) return tail(at + 1) ? 2 : 0;
    if (lead >= 0xe0 && lead <= 0xef) {
        const unsigned low = lead == 0xe0 ? 0xa0 : 0x80;
        const unsigned high = lead == 0xed ? 0x9f : 0xbf;
        return tail(at + 1, low, high) && tail(at + 2) ? 3 : 0;
    }
    if (lead >= 0xf0 && lead <= 0xf4) {
        const unsigned low = lead == 0xf0 ? 0x90 : 0x80;
        const unsigned high = lead == 0xf4 ? 0x8f : 0xbf;
        return tail(at + 1, low, high) && tail(at + 2) && tail(at + 3) ? 4 : 0;
    }
    return 0;
}

std::string message(const std::string& file, const std::string& pointer, const std::string& found,
                    const std::string& expected) {
    std::string text;
    if (!file.empty()) text += file + ": ";
    if (!pointer.empty()) text += printable(pointer, 400) + ": ";
    return text + "found " + found + ", expected " + expected;
}

}  // namespace

std::string printable(const std::string& text, std::size_t limit) {
    static const char* const kHex = "0123456789abcdef";
    std::string shown;
    for (std::size_t i = 0; i < text.size();) {
        if (shown.size() >= limit) return shown + "...";
        const std::size_t length = utf8_length(text, i);
        const auto c = static_cast<unsigned char>(text[i]);
        if (length == 0 || c < 0x20 || c == 0x7f) {
            shown += "\\x";
            shown += kHex[c >> 4];
            shown += kHex[c & 15];
            ++i;
        } else {
            shown.append(text, i, length);
            i += length;
        }
    }
    return shown;
}

std::string in_quotes(const std::string& text) { return '"' + printable(text, 60) + '"'; }

SidecarError::SidecarError(std::string file, std::string pointer, std::string found,
                           std::string expected)
    : std::runtime_error(message(file, pointer, found, expected)),
      file_(std::move(file)),
      pointer_(std::move(pointer)),
      found_(std::move(found)),
      expected_(std::move(expected)) {}

}  // namespace palette4d
