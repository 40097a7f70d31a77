#include "model/sidecar_error.hpp"

#include <cstdio>
#include <utility>

namespace palette4d {
namespace {

std::string message(const std::string& file, const std::string& pointer, const std::string& found,
                    const std::string& expected) {
    std::string text;
    if (!file.empty()) text += file + ": ";
    if (!pointer.empty()) text += printable(pointer, 400) + ": ";
    return text + "found " + found + ", expected " + expected;
}

}  // namespace

std::size_t utf8_length(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned lead = byte(at), second = byte(at + 1);
    const std::size_t length = lead < 0x80   ? 1
                               : lead < 0xc2 ? 0
                               : lead < 0xe0 ? 2
                               : lead < 0xf0 ? 3
                               : lead < 0xf5 ? 4
                                             : 0;
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xc0) != 0x80) return 0;
    }
    // Longer than needed, surrogates, and numbers above 10FFFF.
    const bool none = (lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) ||
                      (lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f);
    return none ? 0 : length;
}

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

std::string decimal_text(double number) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.15g", number);
    return buffer;
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
