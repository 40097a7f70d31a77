#include "sidecar/file_bytes.hpp"

#include <algorithm>
#include <cerrno>

#if defined(_WIN32)
#if !defined(NOMINMAX)
#define NOMINMAX
#endif
#include <windows.h>
#else
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace palette4d {

namespace fs = std::filesystem;

fs::path reachable(const fs::path& path) {
#if defined(_WIN32)
    const auto starts = [](const std::wstring& text, const wchar_t* with) {
        return text.rfind(with, 0) == 0;
    };
    // 260 with the name of a file in a folder; none for paths that have a prefix.
    if (path.native().size() < 248 || starts(path.native(), L"\\\\?\\")) return path;
    std::wstring full(32768, L'\0');
    full.resize(
        GetFullPathNameW(path.c_str(), static_cast<DWORD>(full.size()), full.data(), nullptr));
    if (full.empty() || starts(full, L"\\\\?\\") || starts(full, L"\\\\.\\")) return path;
    return starts(full, L"\\\\") ? L"\\\\?\\UNC" + full.substr(1) : L"\\\\?\\" + full;
#else
    return path;
#endif
}

std::optional<std::string> bytes_of(const fs::path& file, std::size_t most) {
    std::string text;
    char block[65536];
    const auto wanted = [&] { return std::min(sizeof block, most - text.size()); };
#if defined(_WIN32)
    const HANDLE handle = CreateFileW(reachable(file).c_str(), GENERIC_READ,
                                      FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                      nullptr, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (handle == INVALID_HANDLE_VALUE) return std::nullopt;
    DWORD got = 0;
    bool read = GetFileType(handle) == FILE_TYPE_DISK;
    while (read && wanted() > 0) {
        read = ReadFile(handle, block, static_cast<DWORD>(wanted()), &got, nullptr) != 0;
        if (!read || got == 0) break;
        text.append(block, got);
    }
    CloseHandle(handle);
    if (!read) return std::nullopt;
#else
    // A pipe in the file's place would make an ordinary open wait for its writer.
    const int handle = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (handle < 0) return std::nullopt;
    struct stat about{};
    ssize_t got = ::fstat(handle, &about) == 0 && S_ISREG(about.st_mode) ? 1 : -1;
    while (got > 0 && wanted() > 0) {
        got = ::read(handle, block, wanted());
        if (got > 0) text.append(block, static_cast<std::size_t>(got));
        if (got < 0 && errno == EINTR) got = 1;
    }
    ::close(handle);
    if (got < 0) return std::nullopt;
#endif
    return text;
}

}  // namespace palette4d
