#include "palette4d_command.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <locale>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "child_process.hpp"
#include "model/sidecar_error.hpp"
#include "paths.hpp"
#include "program_file.hpp"
#include "sidecar/json_tree.hpp"
#include "windows.hpp"

#if !defined(_WIN32)
#include <dlfcn.h>
#include <stdlib.h>
#include <unistd.h>
#endif

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;

/// This library's own file: Palette4D.ofx in the bundle's folder of a system.
fs::path own_file() {
    static const char anchor = 0;
#if defined(_WIN32)
    HMODULE module = nullptr;
    wchar_t name[4096] = L"";
    if (GetModuleHandleExW(
            GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
            reinterpret_cast<LPCWSTR>(&anchor), &module)) {
        GetModuleFileNameW(module, name, 4096);
    }
    return name;
#else
    Dl_info about{};
    if (::dladdr(&anchor, &about) == 0 || !about.dli_fname) return {};
    std::error_code error;
    return fs::absolute(about.dli_fname, error);
#endif
}

/// The command line of palette4d with these arguments; empty with a problem. Hosts start in any
/// folder: `-P` keeps Python from looking for modules there, and `-E` from the host's variables.
/// Its errors are UTF-8 on every system.
std::vector<std::string> command(const std::vector<std::string>& arguments, std::string& problem) {
    const ProgramPath python =
        read_program(own_file().parent_path().parent_path() / "Resources" / "program");
    problem = python.problem;
    if (!problem.empty()) return {};
    std::vector<std::string> all = {python.path, "-E", "-P", "-Xutf8", "-m", "palette4d"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return all;
}

std::string in_full(const std::string& path) {
    std::error_code error;
    const fs::path full = fs::absolute(native(path), error);
    return error ? path : full.u8string();
}

struct Analysis {
    std::string clip;
    std::unique_ptr<Child> child;  ///< null: it has failed
    fs::path folder;               ///< temporary
    std::string failure;
};

struct Analyses {
    std::mutex mutex;
    std::map<std::string, Analysis> by_sidecar;
};

Analyses& analyses() {
    static Analyses all;
    return all;
}

struct Studios {
    struct One {
        std::string path;
        std::unique_ptr<Child> child;
    };
    std::mutex mutex;
    std::vector<One> open;
    std::map<std::string, std::string> failures;  ///< by path
};

Studios& studios() {
    static Studios all;
    return all;
}

std::string key_of(const std::string& sidecar) {
    std::error_code error;
    const fs::path path = fs::weakly_canonical(reachable(native(sidecar)), error);
    return error ? sidecar : path.u8string();
}

/// A new one, which others cannot enter; empty where there can be none.
fs::path temporary_folder() {
    std::error_code error;
    const fs::path base = fs::temp_directory_path(error);
    if (error) return {};
#if defined(_WIN32)
    for (DWORD i = 0; i < 100; ++i) {
        const fs::path folder = base / ("palette4d-" + std::to_string(GetCurrentProcessId()) + "-" +
                                        std::to_string(GetTickCount() + i));
        if (fs::create_directory(folder, error)) return folder;
    }
    return {};
#else
    std::string folder = (base / "palette4d-XXXXXX").string();
    return ::mkdtemp(&folder[0]) ? fs::path(folder) : fs::path();
#endif
}

using Json = nlohmann::json;

/// The last whole line that `palette4d analyze --progress` has written; null where there is none.
Json last_event(const fs::path& file) {
    constexpr std::streamoff kMost = 1 << 16;
    std::ifstream lines(file, std::ios::binary | std::ios::ate);
    const std::streamoff size = lines ? static_cast<std::streamoff>(lines.tellg()) : 0;
    std::string text(static_cast<std::size_t>(std::min(size, kMost)), '\0');
    lines.seekg(size - static_cast<std::streamoff>(text.size()));
    lines.read(&text[0], static_cast<std::streamsize>(text.size()));
    text.resize(text.rfind('\n') + 1);
    if (text.empty()) return nullptr;
    text.pop_back();
    try {
        return json_tree(text.substr(text.rfind('\n') + 1), "progress");
    } catch (const SidecarError&) {
        return nullptr;
    }
}

std::string string_of(const Json& object, const char* name) {
    const Json value = object.is_object() ? object.value(name, Json()) : Json();
    return value.is_string() ? value.get<std::string>() : "";
}

/// The text of an error event, which names fields of Studio's dialog; "" for other events.
std::string error_of(const Json& event) {
    std::string text;
    bool fields = false;
    for (const Json& part : event.is_object() ? event.value("error", Json()) : Json()) {
        const std::string field = string_of(part, "field");
        fields = fields || !field.empty();
        text += part.is_string() ? part.get<std::string>()
                : !field.empty() ? field
                                 : string_of(part, "option");
    }
    std::replace(text.begin(), text.end(), '\n', ' ');
    if (!fields) return text;
    if (text.back() == '.') text.pop_back();
    return text + ". Push Open in Studio for these, and choose File > Analyse\xe2\x80\xa6";
}

/// How far an analysis is; "" where it has not said.
std::string progress(const Json& event) {
    const std::string stage = string_of(event, "stage");
    if (stage.empty()) return "";
    const Json done = event.value("done", Json()), total = event.value("total", Json());
    return ": " + stage + (total.is_number() ? ": " + done.dump() + " of " + total.dump() : "");
}

/// Why a program has ended: the error that it wrote, without the program's name.
std::string reason(const std::string& line) {
    const std::string start = "palette4d: error: ";
    if (line.rfind(start, 0) == 0) return line.substr(start.size());
    return line.empty() ? "it ended without a word; free some memory, or run 'palette4d "
                          "install-plugin' again in a terminal"
                        : line;
}

/// Takes note of an analysis that has ended; false where it has succeeded.
bool keep(Analysis& one) {
    if (!one.child || one.child->running()) return true;
    const Json event = last_event(one.folder / "progress");
    std::string said = error_of(event);
    if (said.empty()) said = reason(one.child->last_words());
    one.child.reset();
    std::error_code error;
    fs::remove_all(one.folder, error);
    if (event.is_object() && event.contains("finished")) return false;
    one.failure = "the analysis of " + one.clip + " failed: " + said;
    return true;
}

}  // namespace

std::string open_in_studio(const std::string& path, std::optional<double> frame) {
    std::vector<std::string> arguments = {"studio", in_full(path)};
    if (frame) {
        std::ostringstream number;
        number.imbue(std::locale::classic());
        number.precision(10);
        number << *frame;
        arguments.insert(arguments.end(), {"--frame", number.str()});
    }
    std::string problem;
    const std::vector<std::string> all = command(arguments, problem);
    if (all.empty()) return problem;
    std::unique_ptr<Child> child = Child::start(all, problem);
    Studios& every = studios();
    const std::lock_guard<std::mutex> lock(every.mutex);
    every.failures.erase(path);
    if (child) every.open.push_back({path, std::move(child)});
    return problem;
}

std::string studio_problem(const std::string& path) {
    Studios& all = studios();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto ended = [&all](Studios::One& one) {
        if (one.child->running()) return false;
        if (one.child->failed()) {
            all.failures[one.path] =
                "Studio with " + one.path + " ended: " + reason(one.child->last_words());
        }
        return true;
    };
    all.open.erase(std::remove_if(all.open.begin(), all.open.end(), ended), all.open.end());
    const auto found = all.failures.find(path);
    return found == all.failures.end() ? "" : found->second;
}

std::string refused_target(const std::string& sidecar) {
    const fs::path path = native(in_full(sidecar));
    std::error_code error;
    fs::path folder = fs::canonical(reachable(path.parent_path()), error);
    if (error) folder = path.parent_path().lexically_normal();
    const std::string name = path.filename().u8string(), ending = ".json";
    const bool json = name.size() > ending.size() &&
                      name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
    const bool hidden = std::any_of(folder.begin(), folder.end(), [](const fs::path& part) {
        return part.u8string().rfind('.', 0) == 0;
    });
    if (json && name[0] != '.' && !hidden) return "";
    return sidecar + ": expected a name such as shot.p4d.json, in a folder that is not hidden; " +
           "enter another path";
}

std::string start_analysis(const std::string& clip, const std::string& sidecar) {
    std::string problem = refused_target(sidecar);
    if (!problem.empty()) return problem;
    Analyses& all = analyses();
    const std::string key = key_of(sidecar);
    const std::lock_guard<std::mutex> lock(all.mutex);
    Analysis one;
    one.clip = clip;
    one.folder = temporary_folder();
    if (one.folder.empty()) return "no folder can be made for temporary files";
    const std::vector<std::string> line =
        command({"analyze", in_full(clip), "-o", in_full(sidecar), "--quiet", "--progress",
                 (one.folder / "progress").u8string()},
                problem);
    if (!line.empty()) one.child = Child::start(line, problem);
    if (one.child) {
        all.by_sidecar[key] = std::move(one);
        return "";
    }
    std::error_code error;
    fs::remove_all(one.folder, error);
    return problem;
}

bool cancel_analysis(const std::string& sidecar) {
    Analyses& all = analyses();
    const std::lock_guard<std::mutex> lock(all.mutex);
    const auto found = all.by_sidecar.find(key_of(sidecar));
    if (found == all.by_sidecar.end()) return false;
    Analysis& one = found->second;
    const bool ran = one.child && one.child->running();
    if (ran) one.child->stop();
    std::error_code error;
    fs::remove_all(one.folder, error);
    all.by_sidecar.erase(found);
    return ran;
}

AnalysisState analysis_state(const std::string& sidecar) {
    Analyses& all = analyses();
    const std::lock_guard<std::mutex> lock(all.mutex);
    if (all.by_sidecar.empty() || sidecar.empty()) return {};
    const auto found = all.by_sidecar.find(key_of(sidecar));
    if (found == all.by_sidecar.end()) return {};
    Analysis& one = found->second;
    if (!keep(one)) {
        all.by_sidecar.erase(found);
        return {};
    }
    if (!one.child) return {false, one.failure};
    return {true, "analysing " + one.clip + progress(last_event(one.folder / "progress")) +
                      "; push Analyse to cancel it"};
}

void forget_failures() {
    {
        Studios& all = studios();
        const std::lock_guard<std::mutex> lock(all.mutex);
        all.failures.clear();
    }
    Analyses& all = analyses();
    const std::lock_guard<std::mutex> lock(all.mutex);
    for (auto at = all.by_sidecar.begin(); at != all.by_sidecar.end();) {
        at = at->second.child ? std::next(at) : all.by_sidecar.erase(at);
    }
}

}  // namespace palette4d::node
