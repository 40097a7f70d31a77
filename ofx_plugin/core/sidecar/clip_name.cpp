#include "sidecar/clip_name.hpp"

#include <algorithm>
#include <cstdint>

#include "model/sidecar_error.hpp"

namespace palette4d {
namespace {

/// The length of a file's name without its extension.
std::size_t stem_length(const std::string& file_name) {
    const std::size_t dot = file_name.rfind('.');
    return dot == std::string::npos || dot == 0 ? file_name.size() : dot;
}

/// The code point of `length` bytes at text[at]; U+FFFD where the length is 0.
std::uint32_t code_point(const std::string& text, std::size_t at, std::size_t length) {
    if (length == 0) return 0xfffd;
    std::uint32_t value =
        static_cast<unsigned char>(text[at]) & (length == 1 ? 0x7fu : 0x7fu >> length);
    for (std::size_t i = 1; i < length; ++i) {
        value = value << 6 | (static_cast<unsigned char>(text[at + i]) & 0x3fu);
    }
    return value;
}

/// Controls, spaces, marks without a shape, private and special characters (Unicode: Cc, Cf, Co,
/// Z).
bool is_unsafe(std::uint32_t c) {
    if (c < 0x80) {
        return !((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                 c == '.' || c == '_' || c == '-');
    }
    struct Range {
        std::uint32_t first, last;
    };
    for (const Range& range : {Range{0x80, 0xa0},
                               {0xad, 0xad},
                               {0x61c, 0x61c},
                               {0x1680, 0x1680},
                               {0x180e, 0x180e},
                               {0x2000, 0x200f},
                               {0x2028, 0x202f},
                               {0x205f, 0x206f},
                               {0x3000, 0x3000},
                               {0xe000, 0xf8ff},
                               {0xfeff, 0xfeff},
                               {0xfff0, 0xffff},
                               {0xe0000, 0x10ffff}}) {
        if (c >= range.first && c <= range.last) return true;
    }
    return false;
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

bool is_still(const std::string& file_name) {
    std::string ending = file_name.substr(stem_length(file_name));
    for (char& c : ending) c = lower(c);
    for (const char* known :
         {".ari",  ".avif", ".bmp", ".cin", ".dng", ".dpx", ".exr",  ".hdr", ".heic", ".j2c",
          ".j2k",  ".jp2",  ".jpe", ".jpg", ".jxl", ".pgm", ".pic",  ".png", ".pnm",  ".ppm",
          ".jpeg", ".psd",  ".rgb", ".sgi", ".tga", ".tif", ".tiff", ".webp"}) {
        if (ending == known) return true;
    }
    return false;
}

std::size_t without_number(const std::string& stem) {
    const std::size_t end = stem.find_last_not_of("0123456789#@%d[]-");
    if (end == std::string::npos || end + 1 == stem.size()) return stem.size();
    if (lower(stem[end]) == 'v' &&
        (end == 0 || std::string("._- ").find(stem[end - 1]) != std::string::npos)) {
        return stem.size();
    }
    const std::size_t name = stem.find_last_not_of("._- ", end);
    return name == std::string::npos ? stem.size() : name + 1;
}

std::string clip_name(const std::string& file_name) {
    const std::string stem = file_name.substr(0, stem_length(file_name));
    return is_still(file_name) ? stem.substr(0, without_number(stem)) : stem;
}

std::string file_safe(const std::string& name, std::size_t longest) {
    std::string result;
    bool replaced = false;
    for (std::size_t at = 0; at < name.size();) {
        const std::size_t length = utf8_length(name, at);
        const bool unsafe = is_unsafe(code_point(name, at, length));
        const std::string next = unsafe ? "_" : name.substr(at, length);
        at += std::max(length, std::size_t{1});
        if (unsafe && replaced) continue;
        if (result.size() + next.size() > longest) break;
        result += next;
        replaced = unsafe;
    }
    const std::size_t begin = result.find_first_not_of("-.");
    if (begin == std::string::npos) return "clip";
    return result.substr(begin, result.find_last_not_of("-.") + 1 - begin);
}

}  // namespace palette4d
