#include "sidecar/clip_name.hpp"

namespace palette4d {
namespace {

/// The length of a file's name without its extension.
std::size_t stem_length(const std::string& file_name) {
    const std::size_t dot = file_name.rfind('.');
    return dot == std::string::npos || dot == 0 ? file_name.size() : dot;
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

}  // namespace palette4d
