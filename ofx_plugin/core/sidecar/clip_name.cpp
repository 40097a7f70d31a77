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

/// Whether a text is a range of frames, as some programs write it before a mark: "1001-1100",
/// "-3-10x2,15". A number alone may belong to the name: "sh_010####".
bool is_range(const std::string& text) {
    std::size_t at = 0;
    bool several = false;
    const auto number = [&] {
        const std::size_t begin = at;
        while (at < text.size() && text[at] >= '0' && text[at] <= '9') ++at;
        return at > begin;
    };
    const auto skip = [&](char c) { return at < text.size() && text[at] == c && ++at > 0; };
    do {
        skip('-');
        if (!number()) return false;
        if (skip('-')) {
            several = true;
            skip('-');
            if (!number() || (skip('x') && !number())) return false;
        }
        several |= at < text.size();
    } while (skip(','));
    return several && at == text.size();
}

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

std::size_t number_start(const std::string& stem) {
    const char* const digits = "0123456789";
    const std::size_t end = stem.size();
    // Where the characters of a set begin that end before `from`.
    const auto run = [&](const char* set, std::size_t from) {
        return from == 0 ? from : stem.find_last_not_of(set, from - 1) + 1;
    };
    const auto is_one_of = [&](const char* set, std::size_t at) {
        return std::string(set).find(stem[at]) != std::string::npos;
    };
    std::size_t begin = run(digits, end);
    if (begin < end) {
        if (begin > 1 && stem.compare(begin - 2, 2, "$F") == 0) return begin - 2;
        if (begin > 0 && lower(stem[begin - 1]) == 'v' &&
            (begin == 1 || is_one_of("._- ", begin - 2))) {
            return std::string::npos;
        }
    } else if (end > 0 && stem[end - 1] == ']') {
        const std::size_t open = stem.rfind('[');
        if (open != std::string::npos &&
            stem.find_first_not_of("0123456789-,x#@%d", open + 1) == end - 1) {
            begin = open;
        }
    } else if (end > 0 && is_one_of("#@", end - 1)) {
        begin = run(stem[end - 1] == '#' ? "#" : "@", end);
        const std::size_t range = run("0123456789-x,", begin);
        if ((range == 0 || is_one_of("._ ", range - 1)) &&
            is_range(stem.substr(range, begin - range))) {
            begin = range;
        }
    } else if (end > 0 && stem[end - 1] == 'd') {
        const std::size_t width = run(digits, end - 1);
        if (width > 0 && stem[width - 1] == '%') begin = width - 1;
    } else if (end > 1 && stem.compare(end - 2, 2, "$F") == 0) {
        return end - 2;
    }
    if (begin == end) return std::string::npos;
    const bool is_signed =
        begin > 0 && stem[begin - 1] == '-' && (begin == 1 || is_one_of("._ ", begin - 2));
    return is_signed ? begin - 1 : begin;
}

std::string clip_name(const std::string& file_name) {
    const std::string stem = file_name.substr(0, stem_length(file_name));
    const std::size_t number = is_still(file_name) ? number_start(stem) : std::string::npos;
    if (number == 0 || number == std::string::npos) return stem;
    const std::size_t last = stem.find_last_not_of("._- ", number - 1);
    return last == std::string::npos ? stem : stem.substr(0, last + 1);
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
