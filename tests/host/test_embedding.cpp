// What a project keeps of its sidecar: a copy, the clip's folder, and the revision.
#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

namespace fs = std::filesystem;

}  // namespace

TEST(an_embedded_sidecar_travels_with_the_project) {
    Shown project;
    const std::string path = sidecar();
    project.change("sidecar", path);
    CHECK(project.instance->text("embedded").empty());
    project.change("embed", 1);
    CHECK(project.instance->text("embedded") == sidecar_text());
    CHECK(project.says("a copy is in the project"));
    CHECK(project.render() == project.edited());
    // On another machine: the project's parameters, and no file.
    fs::remove(fs::u8path(path));
    const auto there = project.plugin.create();
    for (const char* name : {"sidecar", "embedded", "embed", "clipFolder"}) {
        there->set(name, project.instance->value(name));
    }
    CHECK(project.render(*there) == project.edited());
    CHECK(there->effect().persistent_message.empty());
    CHECK(there->changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(there->text("status").find("the project's copy") != std::string::npos);
    CHECK(there->text("embedded") == sidecar_text());
    // A file that is there counts, and its copy follows.
    const std::string plain = sidecar_text(false);
    write("clip.p4d.json", plain);
    CHECK(project.render(*there) == project.unchanged());
    CHECK(there->changed("strength") == kOfxStatOK);
    CHECK(there->text("embedded") == plain);
    // Not embedded any more: gone.
    there->set("embed", 0);
    CHECK(there->changed("embed") == kOfxStatOK);
    CHECK(there->text("embedded").empty());
    fs::remove(fs::u8path(path));
    CHECK(project.render(*there) == project.unchanged());
    CHECK(!there->effect().persistent_message.empty());
}

TEST(the_copy_that_goes_last_is_missed_at_once) {
    Shown project;
    const std::string path = sidecar();
    project.change("sidecar", path);
    project.change("embed", 1);
    fs::remove(fs::u8path(path));
    CHECK(project.render() == project.edited());
    project.change("embed", 0);
    CHECK(project.instance->text("status").find("does not exist") != std::string::npos);
}

TEST(the_copy_stands_in_for_a_file_that_cannot_be_read) {
    Shown project;
    const std::string path = sidecar();
    project.change("sidecar", path);
    project.change("embed", 1);
    write("clip.p4d.json", sidecar_text().substr(0, 300));
    CHECK(project.render() == project.edited());
    // The user hears of the file, and the copy is not replaced by what is broken.
    const std::string& said = project.instance->effect().persistent_message;
    EXPECT(said.find(path) != std::string::npos, said);
    CHECK(project.instance->changed("reload") == kOfxStatOK);
    CHECK(project.says("the project's copy, because " + path));
    CHECK(project.instance->text("embedded") == sidecar_text());
    const std::string plain = sidecar_text(false);
    write("clip.p4d.json", plain);
    CHECK(project.render() == project.unchanged());
    CHECK(project.instance->effect().persistent_message.empty());
    // Of two that are broken the file is named.
    write("clip.p4d.json", "no JSON");
    project.instance->set("embedded", std::string("no JSON either"));
    CHECK(project.render() == project.unchanged());
    EXPECT(said.find(path) == 0 && said.find("project") == std::string::npos, said);
}

TEST(the_copy_is_what_was_loaded_while_a_program_writes_the_file) {
    Shown project;
    const std::string path = sidecar(), whole = sidecar_text();
    project.change("sidecar", path);
    project.change("embed", 1);
    std::atomic<bool> done{false};
    std::thread writer([&] {
        while (!done) {
            write("clip.p4d.json", whole.substr(0, whole.size() / 2));
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            write("clip.p4d.json", whole);
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    bool same = true;
    while (same && std::chrono::steady_clock::now() < end) {
        CHECK(project.instance->changed("", "", kOfxChangeTime) == kOfxStatOK);
        same = project.instance->text("embedded") == whole;
    }
    done = true;
    writer.join();
    EXPECT(same, project.instance->text("embedded"));
}

TEST(a_broken_copy_is_said_to_be_one) {
    Shown project;
    project.instance->set("sidecar", std::string("/nowhere/at.all"));
    for (const std::string& text : {std::string("no JSON"), sidecar_text().substr(0, 300)}) {
        project.instance->set("embedded", text);
        CHECK(project.render() == project.unchanged());
        const std::string& said = project.instance->effect().persistent_message;
        EXPECT(said.find("the project's copy") != std::string::npos, said);
    }
    // More copies than are remembered, each its own.
    for (int i = 0; i < 20; ++i) {
        project.instance->set("embedded",
                              sidecar_text() + std::string(static_cast<std::size_t>(i), ' '));
        CHECK(project.render() == project.edited());
    }
}

TEST(the_clips_folder_is_filled_in) {
    Shown project;
    fs::create_directories(folder() / "frames");
    std::string text = sidecar_text();
    const std::string source = "box.####.exr";
    text.replace(text.find(source), source.size(), "../frames/" + source);
    fs::create_directories(folder() / "sidecars");
    const std::string path = write("sidecars/s.p4d.json", text);
    project.change("sidecar", path);
    CHECK(project.instance->text("clipFolder") == (folder() / "frames").u8string());
    // Moved beside the clip: found there.
    fs::rename(folder() / "sidecars" / "s.p4d.json", folder() / "frames" / "s.p4d.json");
    CHECK(project.render() == project.edited());
    // What the user says stays until another sidecar is chosen.
    project.change("clipFolder", std::string("/elsewhere"));
    CHECK(project.instance->text("clipFolder") == "/elsewhere");
}

TEST(the_revision_names_what_is_shown) {
    // A host keeps frames by the parameters: when the content changes, so does one of them.
    Shown project;
    Instance& node = *project.instance;
    const std::string path = sidecar();
    CHECK(node.text("revision").empty());
    project.change("sidecar", path);
    std::set<std::string> seen = {"", node.text("revision")};
    CHECK(seen.size() == 2);
    // The same content, told again: nothing to do.
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.settings("revision") == 1);
    const auto expect_new = [&](const char* words) {
        EXPECT(seen.insert(node.text("revision")).second, words);
    };
    write("clip.p4d.json", sidecar_text(false));
    CHECK(node.changed("strength") == kOfxStatOK);
    expect_new("another content");
    CHECK(project.says("0 edits"));
    write("clip.p4d.json", sidecar_text());
    CHECK(node.changed("strength") == kOfxStatOK);
    expect_new("a content that was there before");
    for (int i = 0; i < 3; ++i) {
        CHECK(node.changed("reload") == kOfxStatOK);
        expect_new("Reload");
    }
    write("clip.p4d.json", "no JSON");
    CHECK(node.changed("strength") == kOfxStatOK);
    expect_new("a file that broke");
    fs::remove(fs::u8path(path));
    CHECK(node.changed("strength") == kOfxStatOK);
    expect_new("a file that went away");
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.settings("revision") == 8);
    sidecar();
    CHECK(node.changed("strength") == kOfxStatOK);
    expect_new("a file that came back");
}
