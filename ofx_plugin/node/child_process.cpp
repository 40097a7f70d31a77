#include "child_process.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "paths.hpp"
#include "windows.hpp"

#if !defined(_WIN32)
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

#if defined(_WIN32)

struct Child::System {
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

/// With a job, the process belongs to it before it runs.
HANDLE spawn(const std::vector<std::string>& arguments, HANDLE job, std::string& problem) {
    std::wstring line;
    for (const std::string& argument : arguments) {
        line += (line.empty() ? L"" : L" ") + quoted(wide(argument));
    }
    std::vector<wchar_t> variables = environment();
    STARTUPINFOW how{};
    how.cb = sizeof how;
    PROCESS_INFORMATION started{};
    if (!CreateProcessW(wide(arguments[0]).c_str(), &line[0], nullptr, nullptr, FALSE,
                        CREATE_NO_WINDOW | CREATE_NEW_PROCESS_GROUP | CREATE_SUSPENDED |
                            CREATE_UNICODE_ENVIRONMENT,
                        variables.data(), nullptr, &how, &started)) {
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

std::string start_detached(const std::vector<std::string>& arguments) {
    std::string problem;
    if (const HANDLE process = spawn(arguments, nullptr, problem)) CloseHandle(process);
    return problem;
}

std::unique_ptr<Child> Child::start(const std::vector<std::string>& arguments,
                                    std::string& problem) {
    auto system = std::make_unique<System>();
    system->job = CreateJobObjectW(nullptr, nullptr);
    system->process = spawn(arguments, system->job, problem);
    std::unique_ptr<Child> child(new Child(std::move(system)));
    return child->system_->process ? std::move(child) : nullptr;
}

Child::~Child() {
    if (system_->process) CloseHandle(system_->process);
    if (system_->job) CloseHandle(system_->job);
}

bool Child::running() { return WaitForSingleObject(system_->process, 0) == WAIT_TIMEOUT; }

void Child::stop() {
    if (system_->job) TerminateJobObject(system_->job, 1);
    TerminateProcess(system_->process, 1);
}

#else

struct Child::System {
    pid_t process = 0;
    bool ended = false;
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
    int start(const std::vector<std::string>& arguments, pid_t& process) {
        for (const int standard : {0, 1, 2}) {
            posix_spawn_file_actions_addopen(&files_, standard, "/dev/null",
                                             standard == 0 ? O_RDONLY : O_WRONLY, 0);
        }
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

pid_t spawn(const std::vector<std::string>& arguments, std::string& problem) {
    pid_t process = 0;
    if (const int error = Spawn().start(arguments, process)) {
        problem = arguments[0] + ": cannot be started (" + std::strerror(error) + ")";
        return 0;
    }
    return process;
}

}  // namespace

std::string start_detached(const std::vector<std::string>& arguments) {
    // The shell starts it in the background and ends at once, so that the program is no child of
    // the host. It passes the arguments on and reads none of them.
    std::vector<std::string> all = {"/bin/sh", "-c", "\"$@\" &", "palette4d"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::string problem;
    const pid_t shell = spawn(all, problem);
    while (shell > 0 && ::waitpid(shell, nullptr, 0) < 0 && errno == EINTR) {
    }
    return problem;
}

std::unique_ptr<Child> Child::start(const std::vector<std::string>& arguments,
                                    std::string& problem) {
    const pid_t process = spawn(arguments, problem);
    if (process <= 0) return nullptr;
    auto system = std::make_unique<System>();
    system->process = process;
    return std::unique_ptr<Child>(new Child(std::move(system)));
}

Child::~Child() { running(); }

bool Child::running() {
    if (system_->ended) return false;
    const pid_t done = ::waitpid(system_->process, nullptr, WNOHANG);
    // An error: the host has waited for it in our place.
    system_->ended = done != 0 && !(done < 0 && errno == EINTR);
    return !system_->ended;
}

void Child::stop() {
    if (!running()) return;
    ::kill(-system_->process, SIGTERM);
    for (int i = 0; i < 20 && running(); ++i) ::usleep(10000);
    if (running()) ::kill(-system_->process, SIGKILL);
}

#endif

Child::Child(std::unique_ptr<System> system) : system_(std::move(system)) {}

}  // namespace palette4d::node
