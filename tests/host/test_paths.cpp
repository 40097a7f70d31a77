// Where a sidecar is: ~, variables, relative and moved files.
#include <cstdlib>
#include <fstream>

#include "../../ofx_plugin/node/paths.hpp"
#include "harness.hpp"

#if !defined(_WIN32)
#include <sys/stat.h>
#endif

using namespace strict;
using namespace test;
using palette4d::bytes_of;
using palette4d::reachable;
using palette4d::node::clip_folder;
using palette4d::node::clip_spec;
using palette4d::node::expanded;
using palette4d::node::sidecar_beside;
using palette4d::node::words_of_missing;

namespace {

namespace fs = std::filesystem;

/// A variable of the environment for as long as it lives.
class Variable {
public:
    Variable(const char* name, const std::string& value) : name_(name) {
        const char* before = std::getenv(name);
        if (before) before_ = before;
        set_variable(name, value);
    }
    ~Variable() { set_variable(name_, before_); }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

private:
    const char* name_;
    std::optional<std::string> before_;
};

#if defined(_WIN32)
const std::string kSeparator = ";", kDrive = "C:";
#else
const std::string kSeparator = ":", kDrive = "";
#endif

/// As the system writes it.
std::string preferred(const std::string& path) {
    return fs::u8path(path).make_preferred().u8string();
}
std::string in_folder(const std::string& name) {
    return preferred((folder() / fs::u8path(name)).u8string());
}

std::optional<std::string> find_file(const std::string& path, const std::string& in) {
    const std::optional<std::string> found = palette4d::node::find_file(path, in);
    return found ? std::optional<std::string>(preferred(*found)) : std::nullopt;
}

}  // namespace

TEST(home_and_variables_expand) {
    const Variable home("HOME", "/home/grete"), profile("USERPROFILE", "/home/grete");
    const Variable show("P4D_SHOW", "/shows/öl"), empty("P4D_EMPTY", "");
    CHECK(expanded("~") == "/home/grete");
    CHECK(expanded("~/a.json") == "/home/grete/a.json");
    CHECK(expanded("$P4D_SHOW/x") == "/shows/öl/x");
    CHECK(expanded("${P4D_SHOW}x%P4D_SHOW%") == "/shows/ölx/shows/öl");
    CHECK(expanded("a$P4D_EMPTY/b") == "a/b");
    // What is no variable stands for itself.
    for (const char* same :
         {"", "a~b", "~grete/x", "/a/~/b", "$", "100%", "%", "%%", "a$/b", "${}", "${P4D_SHOW",
          "$P4D_NONE/x", "${P4D_NONE}", "%P4D_NONE%", "50% of %P"}) {
        EXPECT(expanded(same) == same, std::string(same) + " became " + expanded(same));
    }
}

TEST(files_are_found_where_they_are_and_where_they_went) {
    const Variable search("PALETTE4D_PATH", "");
    fs::create_directories(folder() / "clip" / "sub");
    fs::create_directories(folder() / "other");
    const std::string beside = preferred(write("clip/a.p4d.json", "x")),
                      deep = preferred(write("clip/sub/b.p4d.json", ""));
    CHECK(find_file(beside, "") == beside);
    CHECK(find_file(beside, in_folder("other")) == beside);
    CHECK(find_file("sub/b.p4d.json", in_folder("clip")) == deep);
    // As people paste them.
    const std::string spaced = preferred(write("clip/c d%20.p4d.json", "x"));
    const std::string clip = in_folder("clip");
    for (const std::string& pasted : {beside + "\n", " " + beside + "\t", '"' + beside + '"',
                                      "'" + beside + "' ", "file://" + beside}) {
        EXPECT(find_file(pasted, "") == beside, pasted);
    }
    CHECK(find_file("\"sub/b.p4d.json\"", "'" + clip + "'\n") == deep);
    CHECK(find_file("file://" + clip + "/c%20d%2520.p4d.json", "") == spaced);
    CHECK(find_file("file://localhost" + clip + "/c%20d%2520.p4d.json", "") == spaced);
    CHECK(!find_file("file://server" + clip + "/c%20d%2520.p4d.json", ""));
    CHECK(find_file(spaced, "") == spaced);  // no URL
    CHECK(!find_file("'", "") && !find_file("file://", "") && !find_file(" \n", clip));
    CHECK(find_file("a.p4d.json", in_folder("clip")) == beside);
    // Moved: a file of its name beside the clip.
    CHECK(find_file("/old/place/a.p4d.json", in_folder("clip")) == beside);
    CHECK(find_file("gone/a.p4d.json", in_folder("clip")) == beside);
    CHECK(!find_file("/old/place/c.p4d.json", in_folder("clip")));
    CHECK(!find_file("/old/place/a.p4d.json", in_folder("other")));
    CHECK(!find_file("", in_folder("clip")));
    CHECK(!find_file(in_folder("clip"), ""));  // a folder is no file
    const Variable show("P4D_SHOW", folder().u8string());
    CHECK(find_file("$P4D_SHOW/clip/a.p4d.json", "") == beside);
    CHECK(find_file("a.p4d.json", "${P4D_SHOW}/clip") == beside);
    CHECK(!find_file("b.p4d.json", ""));
    const Variable two("PALETTE4D_PATH",
                       in_folder("other") + kSeparator + in_folder("clip/sub") + kSeparator);
    CHECK(find_file("b.p4d.json", "") == deep);
    CHECK(find_file("/old/b.p4d.json", "") == deep);
}

TEST(a_variable_inside_a_path_names_a_folder) {
    const std::string file = sidecar();
    const Variable shot("P4D_SHOT", "sh01"), search("PALETTE4D_PATH", in_folder("decoy"));
    for (const char* name : {"sh01", "decoy"}) {
        fs::create_directories(folder() / name);
        fs::copy_file(fs::u8path(file), folder() / name / "g.p4d.json",
                      fs::copy_options::overwrite_existing);
    }
    fs::copy_file(fs::u8path(file), folder() / "sh01" / "h.p4d.json",
                  fs::copy_options::overwrite_existing);
    CHECK(find_file(in_folder("$P4D_SHOT/g.p4d.json"), "") == in_folder("sh01/g.p4d.json"));
    CHECK(find_file("h.p4d.json", in_folder("$P4D_SHOT")) == in_folder("sh01/h.p4d.json"));
    CHECK(palette4d::node::meant(in_folder("$P4D_SHOT/none.json")) ==
          in_folder("$P4D_SHOT/none.json"));
    CHECK(palette4d::node::meant(in_folder("'gone'/none.json")) == in_folder("'gone'/none.json"));
}

TEST(the_folder_of_a_clip) {
    fs::create_directories(folder() / "frames");
    const std::string path = in_folder("s.p4d.json");
    const std::string frames = in_folder("frames");
    CHECK(clip_folder(path, "frames/f.####.exr") == frames);
    CHECK(clip_folder(path, frames + "/f.####.exr") == frames);
    CHECK(clip_folder(in_folder("frames/s.p4d.json"), "f.####.exr") == frames);
    CHECK(clip_folder(in_folder("frames/s.p4d.json"), "../f.####.exr") == folder().u8string());
    CHECK(clip_folder(path, "nowhere/f.####.exr").empty());
    CHECK(clip_folder(path, "").empty());
}

TEST(the_node_finds_its_sidecar) {
    const Variable search("PALETTE4D_PATH", "");
    Plugin plugin(bundle());
    const auto node = plugin.create();
    const Layout layout;
    Picture source(layout);
    fill(source);
    fs::create_directories(folder() / "clip");
    const palette4d::Sidecar parsed = palette4d::parse_sidecar(sidecar_text(), "");
    write("clip/clip.p4d.json", sidecar_text());
    const auto check = [&] {
        Picture output(layout);
        CHECK(node->render(3, &source, output, layout.bounds) == kOfxStatOK);
        CHECK(output.pixels(layout.bounds) == recoloured(parsed, 13, source, layout.bounds));
    };
    node->set("clipFolder", in_folder("clip"));
    for (const char* path :
         {"clip.p4d.json", "/moved/away/clip.p4d.json", "../clip/clip.p4d.json"}) {
        node->set("sidecar", std::string(path));
        check();
    }
    const Variable show("P4D_SHOW", folder().u8string());
    node->set("clipFolder", std::string());
    node->set("sidecar", std::string("$P4D_SHOW/clip/clip.p4d.json"));
    check();
    // A missing one is named as it was looked for.
    node->set("sidecar", std::string("$P4D_SHOW/none.p4d.json"));
    Picture output(layout);
    CHECK(node->render(3, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(node->effect().persistent_message.find(folder().u8string() + "/none.p4d.json") !=
          std::string::npos);
}

TEST(paths_longer_than_260_characters) {
    fs::path deep = folder();
    while (deep.u8string().size() < 400) deep /= fs::u8path("Einstellung öäü 色");
    fs::create_directories(reachable(deep));
    const std::string path = (deep / "clip.p4d.json").u8string();
    std::ofstream(reachable(fs::u8path(path))) << sidecar_text();
    CHECK(find_file(path, "") == path);
    CHECK(find_file("/moved/clip.p4d.json", deep.u8string()) == path);
    CHECK(clip_folder(path, "../" + deep.filename().u8string() + "/f.####.exr") == deep.u8string());
    Ready scene(path);
    CHECK(scene.instance->changed("sidecar") == kOfxStatOK);
    const std::string status = scene.instance->text("status");
    EXPECT(status.find("\nfile " + path + "\n") != std::string::npos, status);
    const Layout layout;
    Picture source(layout), output(layout);
    fill(source);
    CHECK(scene.instance->render(3, &source, output, layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(layout.bounds) == recoloured(scene.parsed, 13, source, layout.bounds));
}

#if defined(_WIN32)
TEST(the_long_form_of_windows_paths) {
    const std::string tail(300, 'x');
    const auto form = [&](const std::string& start) {
        const std::string text = reachable(palette4d::node::native(start + tail)).u8string();
        return text.substr(0, text.size() - tail.size());
    };
    CHECK(form("C:\\a\\") == "\\\\?\\C:\\a\\");
    CHECK(form("c:/a/../b/./") == "\\\\?\\c:\\b\\");
    CHECK(form("\\\\server\\share\\a\\") == "\\\\?\\UNC\\server\\share\\a\\");
    CHECK(form("//server/share/") == "\\\\?\\UNC\\server\\share\\");
    CHECK(form("\\\\?\\C:\\a\\") == "\\\\?\\C:\\a\\");
    CHECK(reachable("C:/a/b") == "C:/a/b");
    // A server's folder is no relative path, and a drive's own folder is one.
    CHECK(palette4d::node::meant("\"\\\\server\\share\\a b.json\"") ==
          "\\\\server\\share\\a b.json");
    CHECK(fs::path("\\\\server\\share\\a").is_absolute() && fs::path("C:a").is_relative());
    CHECK(clip_spec("\\\\server\\share\\shot.1001.exr") == "\\\\server\\share\\shot.####.exr");
}
#endif

#if !defined(_WIN32)
TEST(a_pipe_is_no_file_and_nobody_waits_for_it) {
    const fs::path pipe = folder() / "pipe";
    CHECK(::mkfifo(pipe.c_str(), 0600) == 0);
    CHECK(!bytes_of(pipe, 10));
    CHECK(!bytes_of(folder(), 10));
    CHECK(bytes_of(write("four", "four"), 3) == "fou");
}
#endif

TEST(a_still_stands_for_its_sequence) {
    const std::pair<const char*, const char*> names[] = {
        {"/a/shot.1001.exr", "/a/shot.####.exr"},
        {"/a/shot_01.PNG", "/a/shot_##.PNG"},
        {"/a/shot.[1001-1100].exr", "/a/shot.####.exr"},
        {"/a/shot.####.exr", "/a/shot.####.exr"},
        {"/a/shot.%04d.exr", "/a/shot.%04d.exr"},
        {"/a/shot-0010.exr", "/a/shot-####.exr"},
        {"/a/shot.-0003.exr", "/a/shot.####.exr"},
        {"/a/shot.1001-1100#.exr", "/a/shot.1001-1100#.exr"},
        {"/a/world0001.exr", "/a/world####.exr"},
        {"/a/sh_010-1001.exr", "/a/sh_010-####.exr"},
        {"/a/sh_010-####.exr", "/a/sh_010-####.exr"},
        {"/a/shot.$F4.exr", "/a/shot.$F4.exr"},
        {"/a/v2/plate.exr", "/a/v2/plate.exr"},
        {"/a/take3.mov", "/a/take3.mov"},
    };
    for (const auto& [media, spec] : names) {
        EXPECT(preferred(clip_spec(media)) == preferred(spec), clip_spec(media));
    }
    CHECK(preferred(sidecar_beside("/a/shot.####.exr")) == preferred("/a/shot.p4d.json"));
    CHECK(preferred(sidecar_beside(clip_spec("/a/sh_010-1001.exr"))) ==
          preferred("/a/sh_010.p4d.json"));
    CHECK(preferred(sidecar_beside("/a/take3.mov")) == preferred("/a/take3.p4d.json"));
    CHECK(preferred(sidecar_beside("/a/A001C001.mov")) == preferred("/a/A001C001.p4d.json"));
    CHECK(preferred(sidecar_beside("/a/plate_v2.png")) == preferred("/a/plate_v2.p4d.json"));
}

TEST(a_missing_file_is_said_with_where_it_was_looked_for) {
    const Variable set("P4D_SHOW", folder().u8string());
    const auto says = [](const std::string& path, const std::string& words) {
        const std::string said = words_of_missing(path);
        EXPECT(said.find(words) != std::string::npos, path + ": " + said);
    };
    says(kDrive + "/nowhere/a.p4d.json",
         "does not exist, and no file with its name is in Clip's folder");
    says("$P4D_SHOW/a.p4d.json", "does not exist, and no file with its name");
    says("a.p4d.json", "PALETTE4D_PATH or " + fs::current_path().u8string());
    for (const char* path : {"$P4D_NONE/a.json", "$P4D_SHOW/${P4D_NONE}.json", "%P4D_NONE%/100%"}) {
        says(path, "no variable P4D_NONE");
    }
    for (const char* path : {"$/a.json", "100%/%", "${/a.json"}) says(path, "does not exist");
    says("file:///nowhere/a%20b%20c.json", "does not exist");  // no variable is called 20b
    // A folder is there, and says itself what is wrong with it.
    CHECK(words_of_missing("$P4D_SHOW").empty());
}
