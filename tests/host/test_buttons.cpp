// Analyse and Open in Studio: which program they start, how, and what the status says. This program
// stands in for Python here; test_buttons.py starts the real one.
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>

#include "../../ofx_plugin/node/program_file.hpp"
#include "harness.hpp"
#include "stand_in.hpp"

#if !defined(_WIN32)
#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <sys/xattr.h>
#endif

using namespace strict;
using namespace test;
using namespace palette4d::node;

namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

struct Window {
    Plugin plugin;
    std::unique_ptr<Instance> node = plugin.create();
    explicit Window(const std::string& bundle = installed()) : plugin(bundle) {}
    void push(const char* button) { CHECK(node->changed(button) == kOfxStatOK); }
    /// As the host tells of any change; the status after it.
    std::string status() {
        CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
        return node->text("status");
    }
    bool says(const std::string& words) { return status().find(words) != std::string::npos; }
    void expect(const std::string& words) { EXPECT(says(words), node->text("status")); }
};

/// Whether this process has neither children nor zombies.
bool no_children() {
#if defined(_WIN32)
    return true;
#else
    return ::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
#endif
}

/// Waits for the stand-ins of Studio, which end by themselves: each status looks for them.
void none_stays(Window& window) {
    CHECK(soon([&] { return !window.status().empty() && no_children(); }));
}

std::string note() { return text_of(folder() / "started"); }
bool noted() { return fs::exists(folder() / "started"); }

#if defined(_WIN32)
const std::string kRoot = "C:\\";
#else
const std::string kRoot = "/";
#endif

}  // namespace

TEST(the_programs_file_is_one_absolute_path) {
    for (const std::string& good :
         {kRoot + "usr/bin/python3", kRoot + "a b/\xc3\xa9", kRoot + "x\n", kRoot + "x\r\n"}) {
        const ProgramPath found = parse_program(good);
        EXPECT(found.problem.empty(), good);
        CHECK(found.path == good.substr(0, good.find_first_of("\r\n")));
    }
    for (const std::string& bad :
         {std::string(), std::string("\n"), std::string("python3"), std::string("./x"),
          kRoot + "x\n" + kRoot + "y", kRoot + "x\n\n", kRoot + "x\t", kRoot + std::string(1, '\0'),
          kRoot + std::string(kMaxProgramBytes, 'x')}) {
        const ProgramPath found = parse_program(bad);
        EXPECT(found.path.empty() && !found.problem.empty(), bad);
    }
}

#if defined(_WIN32)
TEST(the_programs_file_may_name_a_servers_folder) {
    CHECK(parse_program("\\\\server\\share\\python.exe").problem.empty());
    for (const char* bad : {"C:", "C:x", "\\x", "\\\\", "\\\\.\\pipe\\x", "\\\\?\\x", "/x"}) {
        EXPECT(!parse_program(bad).problem.empty(), bad);
    }
}
#else
TEST(the_programs_file_is_believed_only_if_it_is_ours) {
    const fs::path file = folder() / "program";
    const auto refused = [&](const char* why) {
        const ProgramPath found = read_program(file);
        EXPECT(found.path.empty(), why);
        EXPECT(found.problem.find(why) != std::string::npos, found.problem);
        EXPECT(found.problem.find("palette4d install-plugin") != std::string::npos, found.problem);
    };
    refused("found no such file");
    write("program", "/bin/sh\n");
    CHECK(read_program(file).path == "/bin/sh");
    fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
    refused("every user may change");
    fs::permissions(file, fs::perms::others_write, fs::perm_options::remove);
    if (::geteuid() == 0) {
        CHECK(::chown(file.c_str(), 12345, 12345) == 0);
        refused("of another user");
        CHECK(::chown(file.c_str(), 0, 0) == 0);
    }
    const fs::path place = folder() / "place";
    fs::create_directory(place);
    fs::copy_file(fs::canonical("/bin/sh"), place / "sh");
    fs::create_symlink(place / "sh", folder() / "link");
    for (const fs::path& named : {place / "sh", folder() / "link"}) {
        write("program", named.u8string());
        CHECK(read_program(file).path == named.u8string());
        for (const fs::path& open : {place / "sh", place}) {
            fs::permissions(open, fs::perms::others_write, fs::perm_options::add);
            refused("may be changed by other users");
            fs::permissions(open, fs::perms::others_write, fs::perm_options::remove);
        }
        if (::geteuid() == 0) {
            for (const fs::path& theirs : {place / "sh", place}) {
                CHECK(::chown(theirs.c_str(), 12345, 12345) == 0);
                refused("belongs to another user");
                CHECK(::chown(theirs.c_str(), 0, 0) == 0);
            }
        }
    }
    if (::geteuid() == 0) {
        // A link that leads through a folder of theirs, to a program of ours.
        const fs::path theirs = folder() / "theirs";
        fs::create_directory(theirs);
        fs::create_symlink(place / "sh", theirs / "sh");
        write("program", (folder() / "through").u8string());
        for (const fs::path& to : {theirs / "sh", fs::path("theirs/../theirs/sh")}) {
            fs::create_symlink(to, folder() / "through");
            CHECK(read_program(file).problem.empty());
            CHECK(::chown(theirs.c_str(), 12345, 12345) == 0);
            refused("theirs belongs to another user");
            CHECK(::chown(theirs.c_str(), 0, 0) == 0);
            fs::remove(folder() / "through");
        }
        // A virtual environment that a Python of theirs made.
        const fs::path made = folder() / "venv";
        fs::create_directories(made / "bin");
        fs::copy_file(place / "sh", made / "bin" / "python");
        write("program", (made / "bin" / "python").u8string());
        for (const char* key : {"home = ", "home=", " HOME\t= "}) {
            write("venv/pyvenv.cfg", "version = 3.11\n" + (key + theirs.u8string()) + " ");
            CHECK(read_program(file).problem.empty());
            CHECK(::chown(theirs.c_str(), 12345, 12345) == 0);
            refused("theirs belongs to another user");
            CHECK(::chown(theirs.c_str(), 0, 0) == 0);
        }
        fs::remove_all(made);
        fs::remove_all(theirs);
        // A group of the user's own name is the user; another is not.
        std::string open = "/tmp/palette4d-XXXXXX";  // where both users may read
        CHECK(::mkdtemp(open.data()) != nullptr);
        fs::copy_file(place / "sh", fs::path(open) / "sh");
        std::ofstream(open + "/program") << open << "/sh\n";
        for (const auto& [user, group, own] :
             {std::tuple("daemon", "daemon", true), std::tuple("daemon", "users", false)}) {
            const passwd* const who = ::getpwnam(user);
            const struct group* const of = ::getgrnam(group);
            if (!who || !of) continue;  // a system without these
            const uid_t id = who->pw_uid;
            CHECK(::chown(open.c_str(), id, of->gr_gid) == 0 && ::chmod(open.c_str(), 0775) == 0);
            CHECK(::setegid(of->gr_gid) == 0 && ::seteuid(id) == 0);
            const std::string problem = read_program(open + "/program").problem;
            CHECK(::seteuid(0) == 0 && ::setegid(0) == 0);
            EXPECT(own ? problem.empty() : problem.find("by other users") != std::string::npos,
                   problem);
        }
        fs::remove_all(open);
    }
    write("program", (place / "sh").u8string());
#if defined(__linux__)
    // Owner, user 12345, group, mask, others: the group's bits of the mode are the mask's.
    const unsigned short list[] = {2,      0,      1,  7, 0xffff, 0xffff, 2,  7,
                                   12345,  0,      4,  0, 0xffff, 0xffff, 16, 7,
                                   0xffff, 0xffff, 32, 5, 0xffff, 0xffff};
    CHECK(::setxattr(place.c_str(), "system.posix_acl_access", list, sizeof list, 0) == 0);
    refused("may be changed by other users");
#endif
    fs::remove_all(place);
    fs::remove(folder() / "link");
    write("program", "/bin");
    refused("/bin, which is not a program");
    write("program", file.u8string());
    refused("which is not a program");
    write("program", std::string(1 << 20, '/'));
    refused("more than 4096 bytes");
    fs::remove(file);
    fs::create_symlink("/bin/sh", file);
    refused("cannot be read");
    fs::remove(file);
    CHECK(::mkfifo(file.c_str(), 0600) == 0);  // nobody writes: to wait would be for ever
    refused("it is not a file");
    fs::remove(file);
    fs::create_directory(file);
    refused("it is not a file");
}

TEST(a_program_gets_nothing_of_the_hosts) {
    write("python", "#!/bin/sh\ncd '" + folder().u8string() +
                        "'\necho $$ > pid\n"
                        "ls -l /proc/self/fd > files; env > variables; exec sleep 600");
    fs::permissions(folder() / "python", fs::perms::owner_all);
    Window window(installed(folder() / "python"));
    // Without O_CLOEXEC, as hosts have many.
    const int mine = ::fcntl(STDERR_FILENO, F_DUPFD, 100);
    setenv("LD_LIBRARY_PATH", "/of/the/host", 1);
    setenv("PYTHONHOME", "/of/the/host", 1);
    window.node->set("sidecar", sidecar());
    window.push("openInStudio");
    CHECK(soon([] { return text_of(folder() / "variables").find("PWD=") != std::string::npos; }));
    const std::string files = text_of(folder() / "files");
    EXPECT(files.find(" " + std::to_string(mine) + " ->") == std::string::npos, files);
    CHECK(text_of(folder() / "variables").find("/of/the/host") == std::string::npos);
    // It runs on until its end, which the node notices.
    CHECK(!window.says("ended"));
    CHECK(::kill(std::stoi(text_of(folder() / "pid")), SIGKILL) == 0);
    CHECK(soon([&] { return window.says("ended: it ended without a word"); }));
    CHECK(no_children());
    ::close(mine);
    unsetenv("LD_LIBRARY_PATH");
    unsetenv("PYTHONHOME");
}
#endif

TEST(studio_opens_the_sidecar_at_the_frame) {
    Window window;
    const std::string path = sidecar("a name's $(touch no).p4d.json");
    window.node->set("sidecar", path);
    window.node->shown_time = 2.5;
    const auto began = std::chrono::steady_clock::now();
    window.push("openInStudio");
    CHECK(Seconds(std::chrono::steady_clock::now() - began).count() < 5);
    EXPECT(window.node->text("status").find("opening " + path + " in Studio; ") == 0,
           window.node->text("status"));
    CHECK(soon(noted));
    EXPECT(note() == "-E\n-P\n-Xutf8\n-m\npalette4d\nstudio\n" + path + "\n--frame\n12.5\n",
           note());
    none_stays(window);
    CHECK(!window.says("Studio"));
    // A frame outside of the clip is the nearest of it.
    fs::remove(folder() / "started");
    window.node->shown_time = 1000;
    window.push("openInStudio");
    CHECK(soon(noted));
    CHECK(note().find("--frame\n20\n") != std::string::npos);
    none_stays(window);
}

TEST(studio_that_does_not_open_says_why) {
    Window window;
    window.node->set("sidecar", sidecar());
    write("fails", "a warning\npalette4d: error: found no PySide6, expected it\n\n");
    window.push("openInStudio");
    CHECK(soon([&] { return window.says("ended: found no PySide6, expected it\nbox: frames"); }));
    CHECK(no_children());
    // Another node has nothing to do with it, and it is forgotten.
    const auto other = window.plugin.create();
    CHECK(other->changed("reload") == kOfxStatOK && other->text("status") == "No sidecar chosen");
    CHECK(!window.says("PySide6"));
    // Python itself, with more than the node keeps; and the end of one that opens is nothing.
    write("fails", std::string(100000, 'x') + "\r\nNo module named palette4d");
    window.push("openInStudio");
    CHECK(soon([&] { return window.says("ended: No module named palette4d\n"); }));
    fs::remove(folder() / "fails");
    window.push("openInStudio");
    none_stays(window);
    CHECK(!window.says("Studio"));
}

TEST(studio_opens_the_clip_where_there_is_no_sidecar) {
    Window window;
    window.push("openInStudio");
    window.expect("No sidecar chosen");
    CHECK(!noted());
    window.node->set("clipFile", (folder() / "shot.1001.exr").u8string());
    window.push("openInStudio");
    CHECK(soon(noted));
    CHECK(note() == "-E\n-P\n-Xutf8\n-m\npalette4d\nstudio\n" +
                        (folder() / "shot.####.exr").u8string() + "\n");
    none_stays(window);
}

TEST(studio_says_what_it_opens_in_the_place_of_a_broken_sidecar) {
    Window window;
    const auto open = [&] {
        window.push("openInStudio");
        return window.node->text("status");
    };
    const std::string path = sidecar();
    window.node->set("sidecar", path);
    window.node->set("embed", 1);
    CHECK(window.node->changed("embed") == kOfxStatOK);
    std::ofstream(fs::u8path(path)) << "{";
    CHECK(open().find("only the project's copy of the sidecar is here") != std::string::npos);
    window.node->set("embed", 0);
    CHECK(window.node->changed("embed") == kOfxStatOK);
    CHECK(open().find("Open in Studio: this sidecar cannot be opened; choose another") == 0);
    CHECK(!noted());
    const std::string clip = (folder() / "shot.mov").u8string();
    window.node->set("clipFile", clip);
    CHECK(open().find("opening " + clip + " in Studio; ") == 0);
    CHECK(soon(noted));
    none_stays(window);
}

TEST(nothing_starts_where_nothing_is_installed) {
    // Neither the clip's folder nor the project's, where the host runs, is asked for a program.
    const fs::path here = fs::current_path(), project = folder() / "project";
    for (const fs::path& place : {folder(), project}) {
        fs::create_directories(place / "Resources");
        for (const char* name : {"program", "Resources/program"}) {
            std::ofstream(place / name) << own_file().u8string() << "\n";
        }
    }
    Plugin plugin(bundle());
    const auto node = plugin.create();
    node->set("sidecar", sidecar());
    node->set("clipFile", (folder() / "shot.mov").u8string());
    fs::current_path(project);
    for (const char* button : {"openInStudio", "analyse"}) {
        CHECK(node->changed(button) == kOfxStatOK);
        const std::string said = node->text("status");
        EXPECT(said.find("found no such file") != std::string::npos &&
                   said.find("'palette4d install-plugin'") != std::string::npos,
               said);
        EXPECT(said.find("box: frames 10-20") != std::string::npos, said);
    }
    fs::current_path(here);
}

TEST(an_analysis_runs_beside_the_host) {
    Window window;
    write("box.json", sidecar_text());
    const fs::path target = folder() / "shot.p4d.json";
    const std::string clip = (folder() / "shot.####.exr").u8string();
    window.node->set("clipFile", (folder() / "shot.1001.exr").u8string());
    window.push("analyse");
    CHECK(window.node->text("sidecar") == target.u8string());
    CHECK(soon([&] { return window.says("analysing " + clip + ": structure search: 3 of 40"); }));
    CHECK(note().find("palette4d\nanalyze\n" + clip + "\n-o\n" + target.u8string() +
                      "\n--quiet\n--progress\n") != std::string::npos);
    // The picture passes, and the host shows why.
    const Layout layout;
    Picture source(layout), output(layout);
    fill(source);
    CHECK(window.node->render(4, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(layout.bounds) == source.pixels(layout.bounds));
    EXPECT(window.node->effect().persistent_message.find("analysing " + clip) == 0,
           window.node->effect().persistent_message);
    // Another instance of the same sidecar sees it too, and a third one has nothing to do with it.
    const auto other = window.plugin.create(), third = window.plugin.create();
    other->set("sidecar", target.u8string());
    CHECK(other->changed("sidecar") == kOfxStatOK && third->changed("reload") == kOfxStatOK);
    CHECK(other->text("status").find("analysing " + clip) == 0);
    CHECK(third->text("status") == "No sidecar chosen");
    write("go", kFinished);
    CHECK(soon([&] { return window.status().find("box: frames 10-20") == 0; }));
    CHECK(window.node->render(4, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(layout.bounds) != source.pixels(layout.bounds));
    CHECK(window.node->effect().persistent_message.empty());
    CHECK(no_children());
}

TEST(a_second_push_stops_the_analysis) {
    Window window;
    const fs::path target = folder() / "mine.p4d.json";
    window.node->set("clipFile", (folder() / "shot.mov").u8string());
    window.node->set("sidecar", target.u8string());
    window.push("analyse");
    CHECK(window.node->text("sidecar") == target.u8string());
    CHECK(soon([&] { return window.says("3 of 40"); }));
    window.push("analyse");
    EXPECT(window.node->text("status").find("cancelled the analysis") == 0,
           window.node->text("status"));
    CHECK(soon(no_children));
    write("go", kFinished);
    CHECK(!window.says("analysing"));
    CHECK(!fs::exists(target));
}

TEST(an_analysis_that_fails_says_why) {
    Window window;
    const std::string kept = sidecar("mine.p4d.json");
    window.node->set("clipFile", (folder() / "shot.mov").u8string());
    window.node->set("sidecar", kept);
    write("go", R"({"error": ["it has edits; keep them with\n", {"field": "'Edits'"}]})"
                "\n");
    window.push("analyse");
    CHECK(soon(
        [&] { return window.says("failed: it has edits; keep them with 'Edits'. Push Open"); }));
    // The sidecar that is there still serves.
    window.expect("3 edits");
    CHECK(text_of(fs::u8path(kept)) == sidecar_text());
    CHECK(window.node->changed("reload") == kOfxStatOK);
    CHECK(!window.says("failed"));
    // One that dies.
    write("go", "killed\n");
    window.push("analyse");
    CHECK(soon([&] { return window.says("it ended without a word"); }));
    write("fails", "MemoryError\n");
    window.push("analyse");
    CHECK(soon([&] { return window.says("failed: MemoryError\n"); }));
}

TEST(an_analysis_writes_what_is_a_sidecar_by_its_name) {
    Window window;
    window.node->set("clipFile", (folder() / "shot.mov").u8string());
    fs::create_directories(folder() / ".bashrc.d");
    std::vector<std::string> refused = {".bash_profile",  "shot",  "shot.sh",
                                        ".shot.p4d.json", ".json", ".bashrc.d/shot.p4d.json",
                                        "sub/.."};
#if !defined(_WIN32)
    fs::create_directory_symlink(folder() / ".bashrc.d", folder() / "plain");
    refused.emplace_back("plain/shot.p4d.json");
#endif
    for (const std::string& name : refused) {
        window.node->set("sidecar", (folder() / name).u8string());
        window.push("analyse");
        const std::string status = window.node->text("status");
        EXPECT(status.find("expected a name such as shot.p4d.json") != std::string::npos, status);
    }
    CHECK(!noted());
    window.node->set("sidecar", (folder() / "." / "shot.p4d.json").u8string());
    window.push("analyse");
    CHECK(soon([&] { return window.says("3 of 40"); }));
    window.push("analyse");
}

TEST(analyse_needs_to_know_the_clip) {
    Window window;
    window.push("analyse");
    EXPECT(window.node->text("status").find("choose it as Clip's file") != std::string::npos,
           window.node->text("status"));
    CHECK(!noted());
    // Resolve tells, and then finds the sidecar by the clip's name.
    window.node->effect().properties.put("OfxImageEffectPropSrcFilePath",
                                         (folder() / "shot.[1001-1003].exr").u8string());
    write("box.json", sidecar_text());
    write("go", kFinished);
    window.push("analyse");
    CHECK(soon([&] { return window.says("time 0 is frame 10"); }));
    CHECK(window.node->text("sidecar").empty());
    CHECK(note().find((folder() / "shot.####.exr").u8string()) != std::string::npos);
    CHECK(fs::exists(folder() / "shot.p4d.json"));
}
