#include "child_process.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "paths.hpp"
#include "windows.hpp"

#if defined(_WIN32)
#include <io.h>
#else
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#if defined(__APPLE__)
#include <crt_externs.h>
#else
extern char** environ;
#endif
#endif

namespace palette4d::node {
namespace {

/// A host sets these for its own libraries and its own Python, which are not the program's.
bool belongs_to_host(const std::string& variable) {
    for (const char* start : {"LD_LIBRARY_PATH=", "LD_PRELOAD=", "DYLD_", "PYTHON",
                              "QT_PLUGIN_PATH=", "QT_QPA_PLATFORM_PLUGIN_PATH="}) {
        if (variable.rfind(start, 0) == 0) return true;
    }
    return false;
}

}  // namespace

/// What a program writes on standard error: a file without a name, which goes by itself.
class Errors {
public:
    Errors() = default;
    ~Errors() {
        if (file_) std::fclose(file_);
    }
    Errors(const Errors&) = delete;
    Errors& operator=(const Errors&) = delete;

    /// Null where there is no room for one.
    std::FILE* file() const { return file_; }
    /// Of the last line that is not empty, at most its end. The program has the same position in
    /// the file, so only after its end.
    std::string last_line() const {
        if (!file_ || std::fseek(file_, 0, SEEK_END) != 0) return "";
        const long size = std::ftell(file_);
        std::string text(static_cast<std::size_t>(size < 0 ? 0 : size < 4096 ? size : 4096), '\0');
        std::fseek(file_, -static_cast<long>(text.size()), SEEK_END);
        text.resize(std::fread(&text[0], 1, text.size(), file_));
        const std::size_t end = text.find_last_not_of(" \r\n");
        if (end == std::string::npos) return "";
        const std::size_t before = text.find_last_of("\r\n", end);
        return text.substr(before + 1, end - before);
    }

private:
    std::FILE* file_ = std::tmpfile();
};

#if defined(_WIN32)

struct Child::System {
    Errors errors;
    HANDLE process = nullptr;
    HANDLE job = nullptr;  ///< what the process starts belongs to it too
};

namespace {

std::wstring wide(const std::string& text) { return native(text).wstring(); }

/// As CommandLineToArgvW and the C run time take it apart again.
std::wstring quoted(const std::wstring& argument) {
    std::wstring result = L"\"";
    std::size_t slashes = 0;
    for (const wchar_t c : argument) {
        if (c == L'\\') {
            ++slashes;
            continue;
        }
        result.append(c == L'"' ? 2 * slashes + 1 : slashes, L'\\');
        slashes = 0;
        result += c;
    }
    return result.append(2 * slashes, L'\\') + L"\"";
}

std::vector<wchar_t> environment() {
    std::vector<wchar_t> block;
    wchar_t* all = GetEnvironmentStringsW();
    for (const wchar_t* at = all; at && *at; at += std::wcslen(at) + 1) {
        std::string start;
        for (std::size_t i = 0; i < 32 && at[i]; ++i) start += static_cast<char>(at[i]);
        if (!belongs_to_host(start)) block.insert(block.end(), at, at + std::wcslen(at) + 1);
    }
    if (all) FreeEnvironmentStringsW(all);
    block.push_back(L'\0');
    if (block.size() == 1) block.push_back(L'\0');
    return block;
}

/// The only handles that the process gets: nothing to read, nowhere to write but its errors.
class Standard {
public:
    explicit Standard(const Errors& errors) {
        SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
        nothing_ =
            CreateFileW(L"NUL", GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE,
                        &inherited, OPEN_EXISTING, 0, nullptr);
        if (nothing_ == INVALID_HANDLE_VALUE) return;
        if (errors.file()) {
            const auto own = reinterpret_cast<HANDLE>(_get_osfhandle(_fileno(errors.file())));
            DuplicateHandle(GetCurrentProcess(), own, GetCurrentProcess(), &errors_, 0, TRUE,
                            DUPLICATE_SAME_ACCESS);
        }
        handles_ = {nothing_};
        if (errors_) handles_.push_back(errors_);
        SIZE_T size = 0;
        InitializeProcThreadAttributeList(nullptr, 1, 0, &size);
        list_.resize(size);
        if (!InitializeProcThreadAttributeList(list(), 1, 0, &size)) return;
        begun_ = true;
        ready_ =
            UpdateProcThreadAttribute(list(), 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, handles_.data(),
                                      handles_.size() * sizeof(HANDLE), nullptr, nullptr) != 0;
    }
    ~Standard() {
        if (begun_) DeleteProcThreadAttributeList(list());
        if (errors_) CloseHandle(errors_);
        if (nothing_ != INVALID_HANDLE_VALUE) CloseHandle(nothing_);
    }
    Standard(const Standard&) = delete;
    Standard& operator=(const Standard&) = delete;

    bool ready() const { return ready_; }
    STARTUPINFOEXW how() {
        STARTUPINFOEXW all{};
        all.StartupInfo.cb = sizeof all;
        all.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
        all.StartupInfo.hStdInput = all.StartupInfo.hStdOutput = nothing_;
        all.StartupInfo.hStdError = errors_ ? errors_ : nothing_;
        all.lpAttributeList = list();
        return all;
    }

private:
    LPPROC_THREAD_ATTRIBUTE_LIST list() {
        return reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(list_.data());
    }

    HANDLE nothing_ = INVALID_HANDLE_VALUE, errors_ = nullptr;
    std::vector<HANDLE> handles_;
    std::vector<char> list_;
    bool begun_ = false, ready_ = false;
};

/// With a job, the process belongs to it before it runs.
HANDLE spawn(const std::vector<std::string>& arguments, HANDLE job, const Errors& errors,
             std::string& problem) {
    std::wstring line;
    for (const std::string& argument : arguments) {
        line += (line.empty() ? L"" : L" ") + quoted(wide(argument));
    }
    std::vector<wchar_t> variables = environment();
    Standard standard(errors);
    STARTUPINFOEXW how = standard.how();
    PROCESS_INFORMATION started{};
    if (!standard.ready() ||
        !CreateProcessW(wide(arguments[0]).c_str(), &line[0], nullptr, nullptr, TRUE,
                        CREATE_NO_WINDOW | CREATE_NEW_PROCESS_GROUP | CREATE_SUSPENDED |
                            CREATE_UNICODE_ENVIRONMENT | EXTENDED_STARTUPINFO_PRESENT,
                        variables.data(), nullptr, &how.StartupInfo, &started)) {
        problem =
            arguments[0] + ": cannot be started (error " + std::to_string(GetLastError()) + ")";
        return nullptr;
    }
    if (job) AssignProcessToJobObject(job, started.hProcess);
    ResumeThread(started.hThread);
    CloseHandle(started.hThread);
    return started.hProcess;
}

}  // namespace

std::unique_ptr<Child> Child::start(const std::vector<std::string>& arguments,
                                    std::string& problem) {
    auto system = std::make_unique<System>();
    system->job = CreateJobObjectW(nullptr, nullptr);
    system->process = spawn(arguments, system->job, system->errors, problem);
    std::unique_ptr<Child> child(new Child(std::move(system)));
    return child->system_->process ? std::move(child) : nullptr;
}

Child::~Child() {
    if (system_->process) CloseHandle(system_->process);
    if (system_->job) CloseHandle(system_->job);
}

bool Child::running() { return WaitForSingleObject(system_->process, 0) == WAIT_TIMEOUT; }

bool Child::failed() const {
    DWORD status = 0;
    return GetExitCodeProcess(system_->process, &status) && status != 0;
}

void Child::stop() {
    if (system_->job) TerminateJobObject(system_->job, 1);
    TerminateProcess(system_->process, 1);
}

#else

struct Child::System {
    Errors errors;
    pid_t process = 0;
    bool ended = false, failed = false;
};

namespace {

char** variables() {
#if defined(__APPLE__)
    return *_NSGetEnviron();
#else
    return environ;
#endif
}

/// Owns what posix_spawn() needs to know.
class Spawn {
public:
    Spawn() {
        posix_spawn_file_actions_init(&files_);
        posix_spawnattr_init(&how_);
    }
    ~Spawn() {
        posix_spawnattr_destroy(&how_);
        posix_spawn_file_actions_destroy(&files_);
    }
    Spawn(const Spawn&) = delete;
    Spawn& operator=(const Spawn&) = delete;

    /// 0, or an error number.
    int start(const std::vector<std::string>& arguments, const Errors& errors, pid_t& process) {
        // First, as the file may be 0 or 1 where the host has closed those.
        if (errors.file()) {
            posix_spawn_file_actions_adddup2(&files_, ::fileno(errors.file()), 2);
        } else {
            posix_spawn_file_actions_addopen(&files_, 2, "/dev/null", O_WRONLY, 0);
        }
        posix_spawn_file_actions_addopen(&files_, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files_, 1, "/dev/null", O_WRONLY, 0);
        short flags = POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
#if defined(__APPLE__)
        flags |= POSIX_SPAWN_CLOEXEC_DEFAULT;
#else
        close_others();
#endif
        // A group of its own: a Ctrl-C for the host is not for the program.
        posix_spawnattr_setpgroup(&how_, 0);
        sigset_t signals;
        sigemptyset(&signals);
        posix_spawnattr_setsigmask(&how_, &signals);
        for (const int one : {SIGCHLD, SIGHUP, SIGINT, SIGPIPE, SIGQUIT, SIGTERM}) {
            sigaddset(&signals, one);
        }
        posix_spawnattr_setsigdefault(&how_, &signals);
        posix_spawnattr_setflags(&how_, flags);
        std::vector<char*> given, kept;
        for (const std::string& argument : arguments) {
            given.push_back(const_cast<char*>(argument.c_str()));
        }
        given.push_back(nullptr);
        for (char** at = variables(); at && *at; ++at) {
            if (!belongs_to_host(*at)) kept.push_back(*at);
        }
        kept.push_back(nullptr);
        return posix_spawn(&process, given[0], &files_, &how_, given.data(), kept.data());
    }

private:
    /// Closes what the host holds open in the new process; only macOS has an attribute for it.
    void close_others() {
        DIR* open = ::opendir("/proc/self/fd");
        if (!open) return;
        while (const dirent* entry = ::readdir(open)) {
            const int file = std::atoi(entry->d_name);
            if (file > 2 && file != ::dirfd(open)) {
                posix_spawn_file_actions_addclose(&files_, file);
            }
        }
        ::closedir(open);
    }

    posix_spawn_file_actions_t files_{};
    posix_spawnattr_t how_{};
};

}  // namespace

std::unique_ptr<Child> Child::start(const std::vector<std::string>& arguments,
                                    std::string& problem) {
    auto system = std::make_unique<System>();
    if (system->errors.file()) ::fcntl(::fileno(system->errors.file()), F_SETFD, FD_CLOEXEC);
    if (const int error = Spawn().start(arguments, system->errors, system->process)) {
        problem = arguments[0] + ": cannot be started (" + std::strerror(error) + ")";
        return nullptr;
    }
    return std::unique_ptr<Child>(new Child(std::move(system)));
}

Child::~Child() { running(); }

bool Child::running() {
    if (system_->ended) return false;
    int status = 0;
    const pid_t done = ::waitpid(system_->process, &status, WNOHANG);
    // An error: the host has waited for it in our place.
    system_->ended = done != 0 && !(done < 0 && errno == EINTR);
    system_->failed = done > 0 && !(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    return !system_->ended;
}

bool Child::failed() const { return system_->failed; }

void Child::stop() {
    if (!running()) return;
    ::kill(-system_->process, SIGTERM);
    for (int i = 0; i < 20 && running(); ++i) ::usleep(10000);
    if (running()) ::kill(-system_->process, SIGKILL);
}

#endif

Child::Child(std::unique_ptr<System> system) : system_(std::move(system)) {}

std::string Child::last_words() const { return system_->errors.last_line(); }

}  // namespace palette4d::node
