#include "paths.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "sidecar/clip_name.hpp"
#include "windows.hpp"

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;

/// A variable of the environment, in UTF-8.
std::optional<std::string> variable(const std::string& name) {
#if defined(_WIN32)
    const fs::path wide = native(name);
    std::wstring value(32768, L'\0');  // the most that Windows allows
    SetLastError(ERROR_SUCCESS);
    const DWORD length =
        GetEnvironmentVariableW(wide.c_str(), value.data(), static_cast<DWORD>(value.size()));
    if (length == 0 && GetLastError() == ERROR_ENVVAR_NOT_FOUND) return std::nullopt;
    value.resize(length);
    return fs::path(value).u8string();
#else
    const char* value = std::getenv(name.c_str());
    return value ? std::optional<std::string>(value) : std::nullopt;
#endif
}

#if defined(_WIN32)
constexpr char kSeparator = ';';
constexpr const char* kHome = "USERPROFILE";
#else
constexpr char kSeparator = ':';
constexpr const char* kHome = "HOME";
#endif

bool in_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// The end of the variable that starts at `at`, and its name; the name is empty for no variable.
std::size_t variable_at(const std::string& path, std::size_t at, std::string& name) {
    name.clear();
    std::size_t begin = at + 1, end = begin;
    const bool braced = path[at] == '$' && begin < path.size() && path[begin] == '{';
    if (braced) end = ++begin;
    while (end < path.size() && in_name(path[end])) ++end;
    const char close = braced ? '}' : '%';
    const bool closed = path[at] == '$' && !braced;
    if (!closed && (end >= path.size() || path[end] != close)) return at + 1;
    name = path.substr(begin, end - begin);
    return closed ? end : end + 1;
}

bool is_file(const fs::path& path) {
    std::error_code error;
    return fs::is_regular_file(reachable(path), error);
}

/// Cleans a pasted path: blanks or line ends around it, quotes, or a file:// URL.
std::string unpasted(std::string path) {
    const auto blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
    while (!path.empty() && blank(path.back())) path.pop_back();
    path.erase(path.begin(), std::find_if_not(path.begin(), path.end(), blank));
    if (path.size() > 1 && path.front() == path.back() &&
        (path.front() == '"' || path.front() == '\'')) {
        path = path.substr(1, path.size() - 2);
    }
    constexpr const char* kUrl = "file://";
    if (path.rfind(kUrl, 0) != 0) return path;
    std::size_t start = std::strlen(kUrl);
    constexpr const char* kHere = "localhost/";
    if (path.compare(start, std::strlen(kHere), kHere) == 0) start += std::strlen(kHere) - 1;
    const bool drive = start + 1 < path.size() && path[start + 1] == ':';
    if (start < path.size() && path[start] != '/' && !drive) return path;  // another computer's
    std::string plain;
    for (std::size_t at = start; at < path.size(); ++at) {
        const auto hex = [&](std::size_t i) {
            return i < path.size() && std::isxdigit(static_cast<unsigned char>(path[i])) != 0;
        };
        if (path[at] == '%' && hex(at + 1) && hex(at + 2)) {
            plain += static_cast<char>(std::stoi(path.substr(at + 1, 2), nullptr, 16));
            at += 2;
        } else {
            plain += path[at];
        }
    }
#if defined(_WIN32)
    // file:///C:/… leaves /C:/….
    if (plain.size() > 2 && plain[0] == '/' && plain[2] == ':') plain.erase(0, 1);
#endif
    return plain;
}

constexpr const char* kProject = "[Project]/";

/// Natron prefixes every path that does not start with a slash with its project's folder. Removes
/// that prefix where the whole is no file and the rest is one of our forms.
std::string without_project(const std::string& path) {
    std::error_code error;
    if (native(path).is_relative() || fs::exists(reachable(native(expanded(path))), error)) {
        return path;
    }
    for (std::size_t at = path.find('/', 1); at != std::string::npos; at = path.find('/', at + 1)) {
        const std::string_view rest = std::string_view(path).substr(at + 1);
        const auto starts = [&](const char* with) { return rest.rfind(with, 0) == 0; };
        // Natron's own variable, chosen before the project had a folder.
        if (starts(kProject)) {
            return path.substr(0, at + 1).append(rest.substr(std::strlen(kProject)));
        }
        const bool quoted = (starts("\"") || starts("'")) && rest.size() > 1 &&
                            rest.find(rest[0], 1) == rest.size() - 1;
        // A variable further inside a path of the user's own is a folder's name.
        const auto first = [&] { return std::string(rest.substr(0, rest.find_first_of("/\\"))); };
        const bool variable =
            (starts("$") || starts("%")) && native(expanded(first()) + "/").is_absolute();
        if (variable || rest == "~" || starts("~/") || starts("file:/") || quoted) {
            return std::string(rest);
        }
    }
    return path;
}

std::vector<fs::path> search_folders(const std::string& folder) {
    std::vector<fs::path> folders;
    if (!folder.empty()) folders.push_back(native(expanded(folder)));
    std::string rest = variable(kSearchPath).value_or("");
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find(kSeparator), rest.size());
        if (end > 0) folders.push_back(native(expanded(rest.substr(0, end))));
        rest.erase(0, end + 1);
    }
    return folders;
}

/// Whether a name's number, which begins there, is a mark such as #### and no number.
bool is_mark(const std::string& stem, std::size_t begin) {
    const std::size_t digit = stem.find_first_of("0123456789", begin);
    return digit == std::string::npos || stem.find_first_of("#@%$", begin) != std::string::npos;
}

std::string name_of(const std::string& media) {
    return clip_name(native(media).filename().u8string());
}

}  // namespace

fs::path native(const std::string& utf8) {
#if defined(_WIN32)
    // The standard library throws where bytes are no UTF-8.
    const auto convert = [&](wchar_t* to, int most) {
        return MultiByteToWideChar(CP_UTF8, 0, utf8.data(), static_cast<int>(utf8.size()), to,
                                   most);
    };
    std::wstring wide(static_cast<std::size_t>(convert(nullptr, 0)), L'\0');
    convert(wide.data(), static_cast<int>(wide.size()));
    return wide;
#else
    return fs::u8path(utf8);
#endif
}

std::optional<std::string> find_beside(const std::string& media, const std::string& folder) {
    const fs::path file = native(media);
    if (!file.has_filename()) return std::nullopt;
    std::vector<fs::path> folders = search_folders(meant(folder));
    folders.insert(folders.begin(), file.parent_path());
    for (const fs::path& base : folders) {
        const std::string stem = file.stem().u8string(), clip = name_of(media);
        for (const std::string& name : {stem, clip, file_safe(clip)}) {
            const fs::path path = base / native(name + kSidecarEnding);
            if (is_file(path)) return path.u8string();
        }
    }
    return std::nullopt;
}

std::string sidecar_beside(const std::string& clip) {
    return (native(clip).parent_path() / native(name_of(clip) + kSidecarEnding)).u8string();
}

std::string clip_spec(const std::string& media) {
    const fs::path file = native(media);
    if (!is_still(file.filename().u8string())) return media;
    std::string stem = file.stem().u8string();
    const std::size_t begin = number_start(stem);
    if (begin == std::string::npos || is_mark(stem, begin)) return media;
    const std::size_t first = stem.find_first_of("0123456789", begin);
    const std::size_t digits = std::min(stem.find_first_not_of("0123456789", first), stem.size());
    stem.replace(begin, std::string::npos, digits - first, '#');
    return (file.parent_path() / native(stem + file.extension().u8string())).u8string();
}

std::optional<double> first_number(const std::string& media) {
    const fs::path file = native(media);
    if (!is_still(file.filename().u8string())) return std::nullopt;
    const std::string stem = file.stem().u8string();
    const std::size_t begin = number_start(stem);
    if (begin == std::string::npos || is_mark(stem, begin)) return std::nullopt;
    const std::string number = stem.substr(stem[begin] == '[' ? begin + 1 : begin);
    return std::strtod(number.substr(0, number.find_first_not_of("0123456789", 1)).c_str(),
                       nullptr);
}

bool same_clip(const std::string& media, const std::string& source) {
    return name_of(media) == name_of(source);
}

std::string meant(const std::string& path) {
    return path.size() > kLongestPath ? path : unpasted(without_project(path));
}

std::string expanded(const std::string& path) {
    std::string result, name;
    std::size_t at = 0;
    if (!path.empty() && path[0] == '~' &&
        (path.size() == 1 || path[1] == '/' || path[1] == '\\')) {
        if (const auto home = variable(kHome)) {
            result = *home;
            at = 1;
        }
    }
    while (at < path.size()) {
        const char c = path[at];
        if (c != '$' && c != '%') {
            result += c;
            ++at;
            continue;
        }
        const std::size_t end = variable_at(path, at, name);
        const auto value = name.empty() ? std::nullopt : variable(name);
        if (value) {
            result += *value;
            at = end;
        } else {
            result += c;
            ++at;
        }
    }
    return result;
}

std::optional<std::string> find_file(const std::string& path, const std::string& folder) {
    const std::string plain = meant(path);
    if (plain != path) {
        if (const auto found = find_file(plain, folder)) return found;
    }
    const fs::path given = native(expanded(path));
    if (given.empty()) return std::nullopt;
    if (given.is_absolute() && is_file(given)) return given.u8string();
    const std::vector<fs::path> folders = search_folders(meant(folder));
    if (given.is_relative()) {
        for (const fs::path& base : folders) {
            if (is_file(base / given)) return (base / given).u8string();
        }
        if (is_file(given)) return given.u8string();
    }
    for (const fs::path& base : folders) {
        if (is_file(base / given.filename())) return (base / given.filename()).u8string();
    }
    return std::nullopt;
}

std::string words_of_missing(const std::string& given_path) {
    const std::string path = meant(given_path);
    std::string name;
    for (std::size_t at = 0; at < path.size(); ++at) {
        if (path[at] != '$' && path[at] != '%') continue;
        const std::size_t end = variable_at(path, at, name);
        if (!name.empty() && !variable(name)) {
            return "the host's environment has no variable " + name +
                   "; set it and restart the host, or write its value into the path";
        }
        at = end - 1;
    }
    std::error_code error;
    const fs::path given = native(expanded(path));
    if (fs::exists(reachable(given), error)) return "";
    const bool relative = given.is_relative();
    std::string words = "the file does not exist";
    words +=
        relative ? " in Clip's folder, " : ", and no file with its name is in Clip's folder or ";
    words += kSearchPath;
    if (relative) words += " or " + fs::current_path(error).u8string();
    return words + "; choose the file again, or set Clip's folder to its folder";
}

std::string clip_folder(const std::string& path, const std::string& source) {
    std::error_code error;
    const fs::path sidecar = fs::absolute(native(path), error);
    if (error || source.empty()) return "";
    const fs::path frames = (sidecar.parent_path() / native(source)).lexically_normal();
    const fs::path folder = frames.parent_path();
    return fs::is_directory(reachable(folder), error) ? folder.u8string() : "";
}

}  // namespace palette4d::node
