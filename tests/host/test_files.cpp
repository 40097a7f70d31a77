// Sidecars that are missing, broken, replaced, truncated and rewritten.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

/// Moves the file's time out of the span in which a second change could hide.
void age(const std::string& path, int seconds) {
    namespace fs = std::filesystem;
    fs::last_write_time(fs::u8path(path),
                        fs::file_time_type::clock::now() - std::chrono::seconds(seconds));
}

}  // namespace

TEST(unusable_sidecars_pass_the_picture_through) {
    Shown scene;
    const std::string whole = sidecar_text();
    std::vector<std::pair<std::string, std::string>> bad = {
        {(folder() / "missing.p4d.json").u8string(), "does not exist"},
        {folder().u8string(), "not a file"},
        {write("empty.p4d.json", ""), "empty.p4d.json"},
        {write("binary.p4d.json", std::string("\0\xff\xfe\x01", 4)), "binary.p4d.json"},
        {write("other.p4d.json", "[1, 2, 3]"), "other.p4d.json"},
        {write("percent.p4d.json", "{\"schema\": \"%s%n%d\"}"), "percent.p4d.json"},
        {(folder() / "a\nb%s%n.json").u8string(), "%s%n"},
        {(folder() / "a\x1b[2J.json").u8string(), "a\\u001b[2J.json"},
        {std::string("\xff\xfe/not utf-8"), ""},
        {std::string(5000, 'x'), ""},
        {"/" + std::string(10 << 20, 'x'), "at most 32768"},
    };
    std::string many = "a";  // to look at each folder of these took hours
    while (many.size() < 10u << 20) many += "/$a" + many;
    bad.emplace_back(many, "at most 32768");
    bad.emplace_back(std::string(10 << 20, '/'), "at most 32768");
    std::string newer = whole;
    newer.replace(newer.find("\"version\": 1"), 12, "\"version\": 9");
    bad.emplace_back(write("newer.p4d.json", newer), "/version");
    for (std::size_t cut : {1u, 100u, 700u, 1500u}) {
        bad.emplace_back(write("cut" + std::to_string(cut) + ".p4d.json", whole.substr(0, cut)),
                         "");
    }
    for (const auto& [path, word] : bad) {
        scene.change("sidecar", path);  // the status, too, looks at it
        CHECK(scene.render() == scene.unchanged());
        EXPECT(!scene.message().empty(), "no message for " + path);
        EXPECT(scene.message().find(word) != std::string::npos,
               "no '" + word + "' in: " + scene.message());
    }
    // And all is well again with a good one.
    scene.instance->set("sidecar", sidecar());
    CHECK(scene.render() != scene.unchanged());
    CHECK(scene.message().empty());
}

TEST(a_message_stays_until_its_cause_goes) {
    Shown scene;
    scene.instance->set("sidecar", std::string("/nowhere.p4d.json"));
    for (int i = 0; i < 5; ++i) {
        scene.render(i);
        CHECK(scene.message().find("/nowhere.p4d.json") != std::string::npos);
        // Hosts clear messages on their own, Natron when any path changes.
        scene.instance->effect().persistent_message.clear();
    }
    scene.instance->set("sidecar", std::string());
    scene.render();
    CHECK(scene.message().empty());
    CHECK(scene.instance->effect().messages.size() == 5);
    // An instance of its own has its own message.
    const auto other = scene.plugin.create();
    CHECK(other->effect().messages.empty());
}

TEST(a_changed_sidecar_is_read_again) {
    Shown scene;
    const std::string path = sidecar();
    const palette4d::Sidecar edited = palette4d::read_sidecar(path);
    scene.instance->set("sidecar", path);
    const auto first = scene.render();
    CHECK(first == scene.edited());
    age(path, 100);
    CHECK(scene.render() == first);
    // Another size, within the same second.
    write("clip.p4d.json", sidecar_text(false));
    CHECK(scene.render() == scene.unchanged());
    // The same size and the same time, within a clock tick: the content tells.
    std::string other = sidecar_text();
    const std::size_t at = other.find("[0.2, 0.7, 0.1]");
    CHECK(at != std::string::npos);
    write("clip.p4d.json", other);
    const auto stamp = std::filesystem::last_write_time(std::filesystem::u8path(path));
    CHECK(scene.render() == first);
    other.replace(at, 15, "[0.2, 0.1, 0.7]");
    write("clip.p4d.json", other);
    std::filesystem::last_write_time(std::filesystem::u8path(path), stamp);
    const auto second = scene.render();
    CHECK(second != first);
    CHECK(second ==
          recoloured(palette4d::read_sidecar(path), 12, scene.source, scene.layout.bounds));
    // Replaced by renaming, as the one writer does, with a time in the past.
    write("new.p4d.json", sidecar_text());
    age((folder() / "new.p4d.json").u8string(), 1000);
    std::filesystem::rename(folder() / "new.p4d.json", folder() / "clip.p4d.json");
    CHECK(scene.render() == first);
    // Removed, and back.
    std::filesystem::remove(std::filesystem::u8path(path));
    CHECK(scene.render() == scene.unchanged());
    CHECK(scene.message().find("does not exist") != std::string::npos);
    sidecar();
    CHECK(scene.render() == first);
    CHECK(scene.message().empty());
}

TEST(a_file_of_the_same_size_and_time_is_another_file) {
    Shown scene;
    const std::string path = sidecar();
    const std::string swapped =
        sidecar_text().replace(sidecar_text().find("[0.2, 0.7, 0.1]"), 15, "[0.2, 0.1, 0.7]");
    age(path, 1000);
    const auto stamp = std::filesystem::last_write_time(std::filesystem::u8path(path));
    scene.instance->set("sidecar", path);
    const auto first = scene.render();
    // Renamed over it, as from an archive; then written in place with the time put back.
    write("new.p4d.json", swapped);
    std::filesystem::last_write_time(folder() / "new.p4d.json", stamp);
    std::filesystem::rename(folder() / "new.p4d.json", folder() / "clip.p4d.json");
    const auto second = scene.render();
    CHECK(second ==
          recoloured(palette4d::read_sidecar(path), 12, scene.source, scene.layout.bounds));
    CHECK(second != first);
    sidecar();
    std::filesystem::last_write_time(std::filesystem::u8path(path), stamp);
    CHECK(scene.render() == first);
    CHECK(scene.instance->changed("reload") == kOfxStatOK);
    CHECK(scene.render() == first);
}

TEST(the_status_follows_the_file) {
    Shown scene;
    Instance& node = *scene.instance;
    const std::string path = sidecar(), whole = sidecar_text(), plain = sidecar_text(false);
    const std::string good = "box: frames 10-20 at 24 fps, 16 handles, ";
    node.set("sidecar", path);
    CHECK(node.changed("sidecar") == kOfxStatOK);
    CHECK(node.text("status").find(good + "3 edits\n") == 0);
    struct Way {
        const char* words;
        std::function<OfxStatus()> poke;
    };
    const std::vector<Way> ways = {
        {"sidecar", [&] { return node.changed("sidecar"); }},
        {"strength", [&] { return node.changed("strength"); }},
        {"frameOffset", [&] { return node.changed("frameOffset"); }},
        {"a parameter that follows its keys",
         [&] { return node.changed(kOfxTypeParameter, "strength", kOfxChangeTime); }},
        {"the time", [&] { return node.changed("", "", kOfxChangeTime); }},
        {"the clip", [&] { return node.changed(kOfxTypeClip, "Source", kOfxChangeUserEdited); }},
    };
    for (const Way& way : ways) {
        // Every step changes the text: it is set once, and a second poke leaves it alone.
        const auto expect = [&](const std::string& begin, const std::string& end) {
            const int before = node.settings("status");
            CHECK(way.poke() == kOfxStatOK);
            const std::string text = node.text("status");
            EXPECT(text.find(begin) == 0 && text.find(end) != std::string::npos,
                   std::string(way.words) + ": expected " + begin + " … " + end + ", got " + text);
            CHECK(node.settings("status") == before + 1);
            CHECK(way.poke() == kOfxStatOK);
            CHECK(node.text("status") == text);
            CHECK(node.settings("status") == before + 1);
        };
        write("clip.p4d.json", plain);
        expect(good, "0 edits");
        write("clip.p4d.json", whole.substr(0, whole.size() / 2));
        expect(path, "expected");
        write("clip.p4d.json", plain);
        expect(good, "0 edits");
        std::filesystem::remove(std::filesystem::u8path(path));
        expect(path, "does not exist");
        write("clip.p4d.json", whole);
        expect(good, "3 edits");
    }
}

TEST(long_texts_of_a_file_are_cut_in_the_status) {
    std::string text = sidecar_text();
    text.replace(text.find("\"box\""), 5, '"' + std::string(3 << 20, 'x') + '"');
    std::string versions;
    for (int i = 0; i < 300; ++i) {
        versions += (i ? ", " : "") + std::string("{\"name\": \"") + std::string(90, 'y') +
                    std::to_string(i) + "\", \"edits\": {\"vertices\": [], \"stops\": []}}";
    }
    text.insert(text.find("\"edits\": {"), "\"versions\": [" + versions + "], ");
    Ready scene;
    scene.change("sidecar", write("long.p4d.json", text));
    CHECK(scene.instance->text("status").size() < 20'000);
    CHECK(scene.says("xxx...: frames 10-20 at 24 fps"));
    CHECK(scene.says("yyy0', 'yyy"));
}

#if defined(__linux__)
TEST(a_sidecar_of_a_time_to_come_is_not_read_at_each_frame) {
    /// Bytes that this process has read from files.
    const auto bytes_read = [] {
        std::ifstream counts("/proc/self/io");
        std::string name;
        std::size_t bytes = 0;
        counts >> name >> bytes;
        return name == "rchar:" ? bytes : 0;
    };
    if (bytes_read() == 0) return;  // a container that hides it
    const std::string text = sidecar_text() + std::string(1 << 20, ' ');
    const std::string path = write("later.p4d.json", text);
    age(path, -86400);
    const Shown scene(path);
    const std::vector<unsigned char> before = scene.render();
    std::this_thread::sleep_for(std::chrono::milliseconds(3200));
    scene.render();  // read once more: a second change in one tick of the clock is seen
    const std::size_t start = bytes_read();
    for (int i = 0; i < 10; ++i) CHECK(scene.render() == before);
    EXPECT(bytes_read() - start < text.size(),
           std::to_string(bytes_read() - start) + " bytes were read");
    // A change is seen all the same.
    write("later.p4d.json", sidecar_text(false) + std::string(1 << 20, ' '));
    age(path, -86400);
    CHECK(scene.render() != before);
}
#endif

TEST(the_status_is_set_only_where_it_may_be) {
    // The strict host takes a setting anywhere else, and one in answer to a setting, for a fault.
    Shown scene;
    Instance& node = *scene.instance;
    node.set("sidecar", sidecar());
    CHECK(node.changed("sidecar") == kOfxStatOK);
    const std::string old = node.text("status");
    const int before = node.settings("status");
    write("clip.p4d.json", sidecar_text(false));
    scene.render();
    std::string clip;
    double time = 0;
    bool varying = false;
    CHECK(node.is_identity(2, clip, time) == kOfxStatOK);
    CHECK(node.clip_preferences(varying) == kOfxStatOK);
    for (const char* action :
         {kOfxActionPurgeCaches, kOfxImageEffectActionBeginSequenceRender,
          kOfxImageEffectActionEndSequenceRender, "OfxActionBeginInstanceEdit"}) {
        const OfxStatus status = scene.plugin.call(action, &node.effect(), nullptr, nullptr);
        CHECK(status == kOfxStatOK || status == kOfxStatReplyDefault);
    }
    // What has changed is not told yet, or is over.
    for (const char* action : {kOfxActionBeginInstanceChanged, kOfxActionEndInstanceChanged}) {
        node.bracket(action, kOfxChangeUserEdited);
    }
    node.sync();
    // The plugin's own setting, told later instead of at once.
    CHECK(node.changed(kOfxTypeParameter, "status", kOfxChangePluginEdited) == kOfxStatOK);
    CHECK(node.changed(kOfxTypeParameter, "status", kOfxChangeUserEdited) == kOfxStatOK);
    CHECK(node.text("status") == old);
    CHECK(node.settings("status") == before);
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.text("status").find("0 edits") != std::string::npos);
    CHECK(node.settings("status") == before + 1);
}

TEST(a_host_that_says_nothing_of_a_change_is_answered_once) {
    // It tells of the plugin's own setting without name and reason, and gives no text back: only
    // the plugin can know that it is being told of itself.
    Config config;
    config.missing_properties = {kOfxPropName, kOfxPropChangeReason};
    config.null_functions = {"paramGetValue"};
    Host::get().configure(config);
    Shown scene;
    for (int i = 0; i < 3; ++i) {
        const int before = scene.instance->settings("status");
        CHECK(scene.instance->changed(kOfxTypeParameter, "strength", kOfxChangeUserEdited) ==
              kOfxStatOK);
        CHECK(scene.instance->settings("status") == before + 1);
    }
}

TEST(one_file_by_several_names) {
    Shown scene;
    const std::string path = sidecar();
    std::filesystem::create_directories(folder() / "deep");
    scene.instance->set("sidecar", path);
    const auto expected = scene.render();
    CHECK(expected != scene.unchanged());
    scene.instance->set("sidecar", (folder() / "deep" / ".." / "clip.p4d.json").u8string());
    CHECK(scene.render() == expected);
#if defined(_WIN32)  // where no name has quotes
    const std::string spaced = sidecar("ein schöner Pfad 'mit' allem.p4d.json");
#else
    const std::string spaced = sidecar("ein schöner Pfad 'mit' \"allem\".p4d.json");
#endif
    scene.instance->set("sidecar", spaced);
    CHECK(scene.render() == expected);
    std::error_code error;
    const std::filesystem::path link = folder() / "link.p4d.json";
    std::filesystem::create_symlink(std::filesystem::u8path(path), link, error);
    if (!error && std::filesystem::is_regular_file(link, error)) {
        scene.instance->set("sidecar", link.u8string());
        CHECK(scene.render() == expected);
    }
}

TEST(more_sidecars_than_the_cache_holds) {
    Shown scene;
    const std::string text = sidecar_text();
    std::vector<unsigned char> expected;
    for (int i = 0; i < 80; ++i) {
        scene.instance->set("sidecar", write("clip" + std::to_string(i) + ".p4d.json", text));
        const auto picture = scene.render();
        if (i) CHECK(picture == expected);
        expected = picture;
    }
    CHECK(expected != scene.unchanged());
}

TEST(a_sidecar_rewritten_while_rendering) {
    // Whole, truncated, gone and other files come and go under the renders: each picture is one of
    // the honest three (edited so, otherwise, or not), never a mixture.
    Shown scene;
    const std::string path = sidecar();
    const std::string whole = sidecar_text(), plain = sidecar_text(false);
    const auto edited =
        recoloured(palette4d::read_sidecar(path), 12, scene.source, scene.layout.bounds);
    std::string other = whole;
    other.replace(other.find("[0.2, 0.7, 0.1]"), 15, "[0.2, 0.1, 0.7]");
    const auto swapped =
        recoloured(palette4d::parse_sidecar(other, ""), 12, scene.source, scene.layout.bounds);
    const auto unchanged = scene.unchanged();
    CHECK(edited != unchanged && swapped != unchanged && swapped != edited);
    std::atomic<bool> done{false};
    std::atomic<int> wrong{0}, seen_edited{0}, seen_swapped{0}, seen_unchanged{0}, seen_told{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&] {
            const auto instance = scene.plugin.create();
            instance->set("sidecar", path);
            Picture output(scene.layout);
            while (!done) {
                wrong +=
                    instance->render(2, &scene.source, output, scene.layout.bounds) != kOfxStatOK;
                const auto pixels = output.pixels(scene.layout.bounds);
                if (pixels == edited) {
                    ++seen_edited;
                } else if (pixels == swapped) {
                    ++seen_swapped;
                } else if (pixels == unchanged) {
                    ++seen_unchanged;
                } else {
                    ++wrong;
                }
            }
        });
    }
    // Others are told of changes: handles, status and the copy follow too.
    for (int t = 0; t < 2; ++t) {
        threads.emplace_back([&, t] {
            const auto instance = scene.plugin.create();
            instance->set("sidecar", path);
            instance->set("embed", t);
            Picture output(scene.layout);
            const char* const changes[] = {"reload", "handle02", "resetHandles"};
            for (int round = 0; !done; ++round) {
                instance->set("handle02", Colour{0.1 * (round % 10), 0.5, 0.5});
                wrong += instance->changed(changes[round % 3]) != kOfxStatOK;
                wrong +=
                    instance->render(2, &scene.source, output, scene.layout.bounds) != kOfxStatOK;
                std::string clip;
                double time = 0;
                instance->is_identity(2, clip, time);
                ++seen_told;
            }
            wrong += instance->settings("status") == 0;
        });
    }
    const auto replace = [](const std::string& text) {
        write("next.p4d.json", text);
        std::error_code refused;  // by Windows, while somebody reads the old file
        std::filesystem::rename(folder() / "next.p4d.json", folder() / "clip.p4d.json", refused);
        if (refused) write("clip.p4d.json", text);
    };
    // Sanitizers make renders slow, and the file changes no slower.
    const auto enough = [&] {
        return seen_edited > 0 && seen_swapped > 0 && seen_unchanged > 0 && seen_told > 10 &&
               seen_edited + seen_swapped + seen_unchanged > 100;
    };
    // Windows lets nobody remove a file that others have opened without allowing it.
    int refusals = 0, round = 0;
    for (; round < 240 || (!enough() && round < 10000); ++round) {
        switch (round % 6) {
            case 0:
                write("clip.p4d.json", whole);
                break;
            case 1:
                write("clip.p4d.json", whole.substr(0, whole.size() / 2));
                break;
            case 2:
                replace(whole);
                break;
            case 3:
                write("clip.p4d.json", plain);
                break;
            case 4:
                replace(other);
                break;
            case 5:
                std::error_code refused;
                std::filesystem::remove(std::filesystem::u8path(path), refused);
                refusals += bool(refused);
                break;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    done = true;
    for (std::thread& thread : threads) thread.join();
    figure(std::to_string(seen_edited + seen_swapped + seen_unchanged) +
           " pictures of a file that changed " + std::to_string(round) + " times, " +
           std::to_string(wrong) + " wrong");
    CHECK(wrong == 0);
    CHECK(refusals == 0);
    CHECK(seen_edited > 0);
    CHECK(seen_swapped > 0);
    CHECK(seen_unchanged > 0);
    CHECK(seen_told > 0);
}

// Bytes of memory that this process uses; 0 where the system does not tell, or with a sanitizer,
// which keeps what was freed.
std::size_t used_memory() {
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    std::size_t all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return resident * 4096;
#else
    return 0;
#endif
}

TEST(sixteen_instances_in_eight_threads_while_the_sidecar_is_swapped) {
    // For PALETTE4D_LOAD_SECONDS (2) the file changes 100 times a second.
    const char* const given = std::getenv("PALETTE4D_LOAD_SECONDS");
    const auto length = std::chrono::seconds(given ? std::atoi(given) : 2);
    Shown scene;
    const std::string path = sidecar();
    const std::string texts[] = {sidecar_text(), sidecar_text(false)};
    const auto edited =
        recoloured(palette4d::read_sidecar(path), 12, scene.source, scene.layout.bounds);
    const auto unchanged = scene.unchanged();
    CHECK(edited != unchanged);
    std::vector<std::unique_ptr<Instance>> instances;
    for (int i = 0; i < 16; ++i) {
        instances.push_back(scene.plugin.create());
        instances.back()->set("sidecar", path);
    }
    std::atomic<bool> done{false};
    std::atomic<int> wrong{0}, seen_edited{0}, seen_unchanged{0};
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < 8; ++t) {
        threads.emplace_back([&, t] {
            Picture output(scene.layout);
            for (std::size_t round = t; !done; round += 3) {
                Instance& instance = *instances[round % instances.size()];
                wrong +=
                    instance.render(2, &scene.source, output, scene.layout.bounds) != kOfxStatOK;
                const auto pixels = output.pixels(scene.layout.bounds);
                ++(pixels == edited ? seen_edited : pixels == unchanged ? seen_unchanged : wrong);
            }
        });
    }
    const auto started = std::chrono::steady_clock::now();
    std::size_t early = 0;
    int swaps = 0;
    const auto elapsed = [&] { return std::chrono::steady_clock::now() - started; };
    // Sanitizers make renders slow.
    const auto enough = [&] { return seen_edited > 0 && seen_unchanged > 0; };
    for (; elapsed() < length || (!enough() && swaps < 10000); ++swaps) {
        write("next.p4d.json", texts[swaps % 2]);
        std::error_code refused;  // by Windows, while somebody reads the old file
        std::filesystem::rename(folder() / "next.p4d.json", folder() / "clip.p4d.json", refused);
        if (!early && elapsed() > length / 4) early = used_memory();
        std::this_thread::sleep_until(started + (swaps + 1) * std::chrono::milliseconds(10));
    }
    const std::size_t late = used_memory();
    done = true;
    for (std::thread& thread : threads) thread.join();
    figure(std::to_string(seen_edited + seen_unchanged) + " pictures, " + std::to_string(swaps) +
           " swaps in " + std::to_string(length.count()) + " s, " + std::to_string(wrong) +
           " wrong, memory " + std::to_string(early >> 20) + " to " + std::to_string(late >> 20) +
           " MB");
    CHECK(wrong == 0);
    CHECK(enough());
    CHECK(late < early + (32u << 20));
}
