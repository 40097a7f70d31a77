#include "program_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <optional>
#include <sstream>
#include <vector>

#include "paths.hpp"
#include "sidecar/file_bytes.hpp"

#if !defined(_WIN32)
#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <sys/xattr.h>
#endif

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "; run 'palette4d install-plugin' again in a terminal";
constexpr const char* kMissing =
    "found no such file, so no palette4d is known to this node; install "
    "palette4d and run 'palette4d install-plugin' in a terminal";

#if !defined(_WIN32)
bool ours(uid_t owner) { return owner == 0 || owner == ::geteuid(); }
#endif

bool absolute(const std::string& path) {
#if defined(_WIN32)
    const bool of_a_drive = std::isalpha(static_cast<unsigned char>(path[0])) != 0 &&
                            path[1] == ':' && (path[2] == '\\' || path[2] == '/');
    const bool of_a_server =
        path.rfind("\\\\", 0) == 0 && path[2] != '\\' && path[2] != '.' && path[2] != '?';
    return path.size() > 2 && (of_a_drive || of_a_server);
#else
    return path[0] == '/';
#endif
}

/// The file's text, at most one byte longer than the limit; else what is wrong with the file.
std::string text_of(const fs::path& file, std::string& problem) {
#if defined(_WIN32)
    const std::optional<std::string> text = bytes_of(file, kMaxProgramBytes + 1);
    std::error_code error;
    if (!text) {
        problem =
            fs::exists(reachable(file), error) ? "it is not a file that can be read" : kMissing;
    }
    return text.value_or("");
#else
    std::string text(kMaxProgramBytes + 1, '\0');
    std::size_t size = 0;
    const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (handle < 0) {
        problem =
            errno == ENOENT ? kMissing : std::string("it cannot be read: ") + std::strerror(errno);
        return "";
    }
    struct stat about{};
    if (::fstat(handle, &about) != 0 || !S_ISREG(about.st_mode)) {
        problem = "it is not a file";
    } else if (!ours(about.st_uid)) {
        problem = "found a file of another user, expected one of yours or of root";
    } else if ((about.st_mode & S_IWOTH) != 0) {
        problem = "found a file that every user may change, expected one that only its owner may";
    } else {
        ssize_t got = 0;
        while (size < text.size() && (got = ::read(handle, &text[size], text.size() - size)) > 0) {
            size += static_cast<std::size_t>(got);
        }
        if (got < 0) problem = std::string("it cannot be read: ") + std::strerror(errno);
    }
    ::close(handle);
    text.resize(problem.empty() ? size : 0);
    return text;
#endif
}

#if !defined(_WIN32)
/// Whether a group is the user's own, as some systems give one of the user's name to each, and has
/// no other members.
bool of_me_alone(gid_t group) {
    struct passwd user{}, *me = nullptr;
    struct group about{}, *found = nullptr;
    std::array<char, 16384> of_user{}, of_group{};
    if (::getpwuid_r(::geteuid(), &user, of_user.data(), of_user.size(), &me) != 0 || !me ||
        ::getgrgid_r(group, &about, of_group.data(), of_group.size(), &found) != 0 || !found ||
        std::strcmp(user.pw_name, about.gr_name) != 0) {
        return false;
    }
    for (char** member = about.gr_mem; *member; ++member) {
        if (std::strcmp(*member, user.pw_name) != 0) return false;
    }
    return true;
}

/// Whether a file has an access list: the group's bits are then those of all whom it names.
bool has_list([[maybe_unused]] const fs::path& path) {
#if defined(__linux__)
    return ::getxattr(path.c_str(), "system.posix_acl_access", nullptr, 0) > 0;
#else
    return false;
#endif
}

/// What is wrong with a file or folder that other users could change; empty: they cannot.
std::string changeable(const fs::path& path) {
    struct stat about{};
    if (::lstat(path.c_str(), &about) != 0) return "";
    if (!ours(about.st_uid)) return path.u8string() + " belongs to another user";
    const bool is_link = S_ISLNK(about.st_mode);  // its mode says nothing
    const bool sticky = S_ISDIR(about.st_mode) && (about.st_mode & S_ISVTX) != 0;
    if (is_link || sticky) return "";
    const bool own_group = (about.st_gid == 0 || of_me_alone(about.st_gid)) && !has_list(path);
    if ((about.st_mode & S_IWOTH) != 0 || ((about.st_mode & S_IWGRP) != 0 && !own_group)) {
        return path.u8string() + " may be changed by other users";
    }
    return "";
}

/// The same for a program, each link on the way and where it leads, and all folders above these.
std::string changeable_program(const fs::path& program) {
    constexpr int kMostLinks = 40;  // as on Linux
    fs::path done = program.root_path();
    std::vector<fs::path> ahead;  // the next one last
    const auto add = [&ahead](const fs::path& path) {
        const fs::path names = path.relative_path();
        const std::vector<fs::path> parts(names.begin(), names.end());
        ahead.insert(ahead.end(), parts.rbegin(), parts.rend());
    };
    add(program);
    for (int links = 0; !ahead.empty();) {
        const fs::path name = ahead.back();
        ahead.pop_back();
        if (name == "..") done = done.parent_path();
        if (name == ".." || name == "." || name.empty()) continue;
        const fs::path place = done / name;
        const std::string problem = changeable(place);
        if (!problem.empty()) return problem;
        std::error_code error;
        if (!fs::is_symlink(place, error)) {
            done = place;
            continue;
        }
        if (++links > kMostLinks) return program.u8string() + " leads through too many links";
        const fs::path target = fs::read_symlink(place, error);
        if (target.is_absolute()) done = target.root_path();
        add(target);
    }
    return "";
}

/// The same for the Python that made the program's virtual environment, whose library it runs.
std::string changeable_base(const fs::path& program) {
    const std::optional<std::string> settings =
        bytes_of(program.parent_path().parent_path() / "pyvenv.cfg", kMaxProgramBytes);
    std::istringstream lines(settings.value_or(""));
    for (std::string line; std::getline(lines, line);) {
        // As Python reads it: blanks around both count for nothing, nor does the key's case.
        const auto trimmed = [](const std::string& text) {
            constexpr const char* kBlanks = " \t\r\n\v\f";
            const std::size_t from = text.find_first_not_of(kBlanks);
            if (from == std::string::npos) return std::string();
            return text.substr(from, text.find_last_not_of(kBlanks) - from + 1);
        };
        const std::size_t sign = line.find('=');
        std::string key = trimmed(line.substr(0, sign));
        for (char& c : key) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        if (key != "home" || sign == std::string::npos) continue;
        const fs::path home = trimmed(line.substr(sign + 1));
        if (home.is_absolute()) return changeable_program(home);
    }
    return "";
}
#endif

bool executable(const std::string& path) {
    std::error_code error;
    if (!fs::is_regular_file(reachable(native(path)), error)) return false;
#if defined(_WIN32)
    return true;
#else
    return ::access(path.c_str(), X_OK) == 0;
#endif
}

}  // namespace

ProgramPath parse_program(const std::string& text) {
    if (text.size() > kMaxProgramBytes) {
        return {"", "found more than " + std::to_string(kMaxProgramBytes) +
                        " bytes, expected one line with a path"};
    }
    std::string line = text;
    if (!line.empty() && line.back() == '\n') line.pop_back();
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const bool plain = std::none_of(line.begin(), line.end(), [](char c) {
        const auto code = static_cast<unsigned char>(c);
        return code < 0x20 || code == 0x7f;
    });
    if (line.empty() || !plain || !absolute(line)) {
        return {"", "found something else than one line with an absolute path"};
    }
    return {line, ""};
}

ProgramPath read_program(const fs::path& file) {
    ProgramPath found;
    const std::string text = text_of(file, found.problem);
    if (found.problem.empty()) found = parse_program(text);
    if (found.problem.empty() && !executable(found.path)) {
        found.problem = "it names " + found.path + ", which is not a program";
    }
#if !defined(_WIN32)
    if (found.problem.empty()) {
        std::string problem = changeable_program(found.path);
        if (problem.empty()) problem = changeable_base(found.path);
        if (!problem.empty()) {
            found.problem = "it names " + found.path + ", and " + problem +
                            "; expected a palette4d that you or root alone may change";
        }
    }
#endif
    if (found.problem.empty()) return found;
    const bool missing = found.problem == kMissing;
    return {"", file.u8string() + ": " + found.problem + (missing ? "" : kRemedy)};
}

}  // namespace palette4d::node
