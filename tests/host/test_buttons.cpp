// Analyse and Open in Studio: which program they start, how, and what the status says. A script
// stands in for Python here; test_buttons.py starts the real one.
#if !defined(_WIN32)
#include <cerrno>
#include <csignal>
#include <cstdlib>

#include "../../ofx_plugin/node/program_file.hpp"
#include "harness.hpp"
#include "stand_in.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace strict;
using namespace test;
using namespace palette4d::node;

namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

struct Window {
    Plugin plugin;
    std::unique_ptr<Instance> node = plugin.create();
    explicit Window(const std::string& body) : plugin(installed(script(body))) {}
    void push(const char* button) { CHECK(node->changed(button) == kOfxStatOK); }
    /// As the host tells of any change; the status after it.
    std::string status() {
        CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
        return node->text("status");
    }
    bool says(const std::string& words) { return status().find(words) != std::string::npos; }
    void expect(const std::string& words) { EXPECT(says(words), node->text("status")); }
};

}  // namespace

TEST(the_programs_file_is_one_absolute_path) {
    for (const std::string good : {"/usr/bin/python3", "/a b/\xc3\xa9", "/x\n", "/x\r\n"}) {
        const ProgramPath found = parse_program(good);
        EXPECT(found.problem.empty(), good);
        CHECK(found.path == good.substr(0, good.find_first_of("\r\n")));
    }
    for (const std::string& bad :
         {std::string(), std::string("\n"), std::string("python3"), std::string("./x"),
          std::string("/x\n/y"), std::string("/x\n\n"), std::string("/x\t"),
          std::string("/x\0y", 4), "/" + std::string(kMaxProgramBytes, 'x')}) {
        const ProgramPath found = parse_program(bad);
        EXPECT(found.path.empty() && !found.problem.empty(), bad);
    }
}

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

TEST(studio_opens_the_sidecar_at_the_frame) {
    Window window("echo $$ > pid\n" + std::string(kRecord) +
                  "ls -l /proc/self/fd > files; env > variables; sleep 600");
    // Without O_CLOEXEC, as hosts have many.
    const int mine = ::fcntl(STDERR_FILENO, F_DUPFD, 100);
    setenv("LD_LIBRARY_PATH", "/of/the/host", 1);
    setenv("PYTHONHOME", "/of/the/host", 1);
    const std::string path = sidecar("a name's $(touch no).p4d.json");
    window.node->set("sidecar", path);
    window.node->shown_time = 2.5;
    const auto began = std::chrono::steady_clock::now();
    window.push("openInStudio");
    CHECK(Seconds(std::chrono::steady_clock::now() - began).count() < 5);
    EXPECT(window.node->text("status").find("opened " + path + " in Studio") == 0,
           window.node->text("status"));
    CHECK(soon([] { return fs::exists(folder() / "variables"); }));
    CHECK(text_of(folder() / "started") ==
          "-E\n-P\n-m\npalette4d\nstudio\n" + path + "\n--frame\n12.5\n");
    CHECK(soon([] { return text_of(folder() / "variables").find("PWD=") != std::string::npos; }));
    CHECK(text_of(folder() / "variables").find("/of/the/host") == std::string::npos);
    const std::string files = text_of(folder() / "files");
    EXPECT(files.find(" " + std::to_string(mine) + " ->") == std::string::npos, files);
    // No child of the host: neither one that it could wait for, nor a zombie.
    CHECK(::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD);
    ::close(mine);
    unsetenv("LD_LIBRARY_PATH");
    unsetenv("PYTHONHOME");
    const auto end = [] { CHECK(::kill(std::stoi(text_of(folder() / "pid")), SIGKILL) == 0); };
    end();
    // A frame outside of the clip is the nearest of it.
    fs::remove(folder() / "started");
    window.node->shown_time = 1000;
    window.push("openInStudio");
    CHECK(soon([] { return fs::exists(folder() / "started"); }));
    CHECK(text_of(folder() / "started").find("--frame\n20\n") != std::string::npos);
    end();
}

TEST(studio_opens_the_clip_where_there_is_no_sidecar) {
    Window window(kRecord);
    window.push("openInStudio");
    window.expect("No sidecar chosen");
    CHECK(!fs::exists(folder() / "started"));
    window.node->set("clipFile", (folder() / "shot.1001.exr").u8string());
    window.push("openInStudio");
    CHECK(soon([] { return fs::exists(folder() / "started"); }));
    CHECK(text_of(folder() / "started") ==
          "-E\n-P\n-m\npalette4d\nstudio\n" + (folder() / "shot.####.exr").u8string() + "\n");
}

TEST(nothing_starts_where_nothing_is_installed) {
    Plugin plugin(bundle());
    const auto node = plugin.create();
    node->set("sidecar", sidecar());
    node->set("clipFile", (folder() / "shot.mov").u8string());
    for (const char* button : {"openInStudio", "analyse"}) {
        CHECK(node->changed(button) == kOfxStatOK);
        const std::string said = node->text("status");
        EXPECT(said.find("run 'palette4d install-plugin'") != std::string::npos, said);
        EXPECT(said.find("box: frames 10-20") != std::string::npos, said);
    }
    // Neither the project's nor the clip's folder is asked for a program.
    fs::create_directories(folder() / "Resources");
    write("Resources/program", "/bin/sh");
    CHECK(node->changed("openInStudio") == kOfxStatOK);
    CHECK(node->text("status").find("found no such file") != std::string::npos);
}

TEST(an_analysis_runs_beside_the_host) {
    Window window(kAnalyse);
    write("box.json", sidecar_text());
    const fs::path target = folder() / "shot.p4d.json";
    const std::string clip = (folder() / "shot.####.exr").u8string();
    window.node->set("clipFile", (folder() / "shot.1001.exr").u8string());
    window.push("analyse");
    CHECK(window.node->text("sidecar") == target.u8string());
    CHECK(soon([&] { return window.says("analysing " + clip + ": structure search: 3 of 40"); }));
    CHECK(text_of(folder() / "started")
              .find("palette4d\nanalyze\n" + clip + "\n-o\n" + target.u8string() +
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
    write("go", "done\n");
    CHECK(soon([&] { return window.status().find("box: frames 10-20") == 0; }));
    CHECK(window.node->render(4, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(layout.bounds) != source.pixels(layout.bounds));
    CHECK(window.node->effect().persistent_message.empty());
    CHECK(::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD);
}

TEST(a_second_push_stops_the_analysis) {
    Window window(kAnalyse);
    const fs::path target = folder() / "mine.p4d.json";
    window.node->set("clipFile", (folder() / "shot.mov").u8string());
    window.node->set("sidecar", target.u8string());
    window.push("analyse");
    CHECK(window.node->text("sidecar") == target.u8string());
    CHECK(soon([&] { return window.says("3 of 40"); }));
    window.push("analyse");
    EXPECT(window.node->text("status").find("cancelled the analysis") == 0,
           window.node->text("status"));
    CHECK(soon([] { return ::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD; }));
    write("go", "done\n");
    CHECK(!window.says("analysing"));
    CHECK(!fs::exists(target));
}

TEST(an_analysis_that_fails_says_why) {
    Window window(kAnalyse);
    const std::string kept = sidecar("mine.p4d.json");
    window.node->set("clipFile", (folder() / "shot.mov").u8string());
    window.node->set("sidecar", kept);
    write("go", "error: it has edits; keep them with --keep-edits\n");
    window.push("analyse");
    CHECK(soon([&] { return window.says("failed: it has edits; keep them with --keep-edits"); }));
    // The sidecar that is there still serves.
    window.expect("3 edits");
    CHECK(text_of(kept) == sidecar_text());
    CHECK(window.node->changed("reload") == kOfxStatOK);
    CHECK(!window.says("failed"));
    // One that dies.
    write("go", "killed\n");
    window.push("analyse");
    CHECK(soon([&] { return window.says("run 'palette4d analyze' in a terminal"); }));
}

TEST(analyse_needs_to_know_the_clip) {
    Window window(kAnalyse);
    window.push("analyse");
    EXPECT(window.node->text("status").find("choose it as Clip's file") != std::string::npos,
           window.node->text("status"));
    CHECK(!fs::exists(folder() / "started"));
    // Resolve tells, and then finds the sidecar by the clip's name.
    window.node->effect().properties.put("OfxImageEffectPropSrcFilePath",
                                         (folder() / "shot.[1001-1003].exr").u8string());
    write("box.json", sidecar_text());
    write("go", "done\n");
    window.push("analyse");
    CHECK(soon([&] { return window.says("time 0 is frame 10"); }));
    CHECK(window.node->text("sidecar").empty());
    CHECK(text_of(folder() / "started").find((folder() / "shot.####.exr").u8string()) !=
          std::string::npos);
    CHECK(fs::exists(folder() / "shot.p4d.json"));
}
#endif
