// Palette4D Analyse, the bundle's second effect: it fetches the clip's frames from the host.
#include "harness.hpp"
#include "stand_in.hpp"

using namespace strict;
using namespace test;

namespace {

namespace fs = std::filesystem;

struct Effect {
    Plugin plugin;
    std::unique_ptr<Instance> node;
    Layout layout;
    std::vector<Picture> pictures;
    std::vector<double> asked;
    fs::path target = folder() / "shot.p4d.json";

    explicit Effect(Config config = {}) : plugin(installed(), 1) {
        if (config.frame_range.empty()) config.frame_range = {-1, 2};
        Host::get().configure(config);
        node = plugin.create(kOfxImageEffectContextGeneral);
        for (unsigned i = 0; i < 4; ++i) fill(pictures.emplace_back(layout), i, false);
        node->frames = [this](double time) -> const Picture* {
            asked.push_back(time);
            const auto at = static_cast<std::size_t>(time + 1);
            return at < pictures.size() ? &pictures[at] : nullptr;
        };
        node->set("sidecar", target.u8string());
    }
    void push() { CHECK(node->changed("analyse") == kOfxStatOK); }
    std::string status() {
        CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
        return node->text("status");
    }
    std::size_t files() const {
        std::error_code error;
        const fs::directory_iterator all(folder() / "shot.frames", error);
        return error ? 0 : static_cast<std::size_t>(std::distance(all, fs::directory_iterator()));
    }
    bool started() const { return fs::exists(folder() / "started"); }
};

}  // namespace

TEST(the_grading_node_asks_for_no_other_frame) {
    Plugin grade(bundle(), 0), analyse(bundle(), 1);
    CHECK(grade.load() == kOfxStatOK);
    const char* const temporal = kOfxImageEffectPropTemporalClipAccess;
    for (const bool second : {false, true}) {
        const auto effect = (second ? analyse : grade).describe(kOfxImageEffectContextFilter);
        CHECK(effect->properties.number(temporal) == second);
        CHECK(effect->clips.at("Source")->properties.number(temporal) == second);
        CHECK(effect->clips.at("Output")->properties.number(temporal) == 0);
    }
    CHECK(std::string(analyse.ofx().pluginIdentifier) == "org.palette4d.Analyse");
}

TEST(the_frames_of_the_host_are_analysed) {
    Effect effect;
    write("box.json", sidecar_text());
    effect.push();
    CHECK(effect.asked == (std::vector<double>{-1, 0, 1, 2}));
    CHECK(effect.node->effect().progress == (std::vector<double>{0, 0.25, 0.5, 0.75}));
    // Names hold no negative numbers.
    CHECK(effect.files() == 4 && fs::exists(folder() / "shot.frames" / "shot.000003.exr"));
    CHECK(soon(
        [&] { return effect.status().find("structure search: 3 of 40") != std::string::npos; }));
    CHECK(text_of(folder() / "started")
              .find("analyze\n" + (folder() / "shot.frames" / "shot.######.exr").u8string() +
                    "\n-o\n" + effect.target.u8string() + "\n") != std::string::npos);
    effect.push();
    CHECK(effect.node->text("status").find("cancelled") == 0);
    // Again, over the frames of the first time.
    write("go", kFinished);
    effect.push();
    CHECK(soon([&] {
        return effect.status().find("choose it in the node Palette4D") != std::string::npos;
    }));
    CHECK(effect.files() == 4);
    // The picture passes.
    Picture output(effect.layout);
    effect.node->twice = true;
    CHECK(effect.node->render(0, &effect.pictures[1], output, effect.layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(effect.layout.bounds) == effect.pictures[1].pixels(effect.layout.bounds));
    std::string clip;
    double time = 0;
    CHECK(effect.node->is_identity(1, clip, time) == kOfxStatOK && clip == "Source" && time == 1);
}

TEST(studio_opens_the_sidecar_or_the_frames) {
    Effect effect;
    const auto open = [&] {
        CHECK(effect.node->changed("openInStudio") == kOfxStatOK);
        return effect.node->text("status");
    };
    CHECK(open().find("shot.p4d.json is not there yet; push Analyse first") != std::string::npos);
    CHECK(!effect.started());
    write("go", R"({"error": ["it has cuts"]})"
                "\n");
    effect.push();
    CHECK(soon([&] { return effect.status().find("failed: it has cuts") != std::string::npos; }));
    const std::string frames = (folder() / "shot.frames" / "shot.######.exr").u8string();
    CHECK(open().find("opening " + frames + " in Studio; ") == 0);
    CHECK(soon([&] {
        return text_of(folder() / "started").find("studio\n" + frames) != std::string::npos;
    }));
    write("fails", "found no screen\n");
    write("shot.p4d.json", sidecar_text());
    CHECK(open().find("opening " + effect.target.u8string() + " in Studio; ") == 0);
    CHECK(
        soon([&] { return effect.status().find("ended: found no screen") != std::string::npos; }));
    effect.node->set("sidecar", std::string());
    CHECK(open() == "Open in Studio: enter the sidecar's path");
}

TEST(a_cancelled_fetch_leaves_nothing) {
    Config config;
    config.cancel_after = 2;
    Effect effect(config);
    effect.push();
    CHECK(effect.asked.size() == 2);
    CHECK(effect.node->text("status") == "cancelled");
    CHECK(!fs::exists(folder() / "shot.frames") && !effect.started());
}

TEST(a_fetch_that_fails_leaves_the_earlier_frames) {
    Effect effect;
    write("go", R"({"error": ["it has cuts"]})"
                "\n");
    effect.push();
    CHECK(soon([&] { return effect.status().find("failed: it has cuts") != std::string::npos; }));
    fill(effect.pictures[3], 9, false);
    const auto frame = [&] { return text_of(folder() / "shot.frames" / "shot.000003.exr"); };
    const std::string before = frame();
    const Picture last = effect.pictures.back();
    effect.pictures.pop_back();
    effect.push();
    EXPECT(effect.node->text("status").find("no picture at time 2") != std::string::npos,
           effect.node->text("status"));
    CHECK(effect.files() == 4 && frame() == before);
    CHECK(!fs::exists(folder() / "shot.frames.new"));
    // Of a host that ended meanwhile.
    fs::create_directories(folder() / "shot.frames.new");
    write("shot.frames.new/shot.000009.exr", "half of it");
    effect.pictures.push_back(last);
    effect.push();
    CHECK(effect.files() == 4 && frame() != before && !frame().empty());
    CHECK(!fs::exists(folder() / "shot.frames.new"));
    CHECK(soon([&] { return effect.status().find("failed: it has cuts") != std::string::npos; }));
}

TEST(a_fetch_without_the_progress_suite) {
    Config config;
    config.missing_suites = {std::string(kOfxProgressSuite) + "/1"};
    Effect effect(config);
    effect.push();
    CHECK(effect.asked.size() == 4 && effect.files() == 4);
    effect.push();
}

TEST(a_fetch_that_cannot_be_says_why) {
    Effect effect;
    const auto refused = [&](const char* words) {
        effect.push();
        EXPECT(effect.node->text("status").find(words) != std::string::npos,
               effect.node->text("status"));
        CHECK(!effect.started());
    };
    effect.node->set("sidecar", std::string());
    refused("enter the path of the new sidecar");
    effect.node->set("sidecar", std::string("relative.p4d.json"));
    refused("found no such folder");
    effect.node->set("sidecar", (folder() / "\x1b[2J" / "shot.p4d.json").u8string());
    refused("\\u001b[2J");
    effect.node->set("sidecar", (folder() / ".bash_profile").u8string());
    refused("expected a name such as shot.p4d.json");
    fs::create_directories(folder() / ".config" / "below");
    effect.node->set("sidecar", (folder() / ".config" / "below" / "shot.p4d.json").u8string());
    refused("in a folder that is not hidden");
    CHECK(effect.asked.empty());
    effect.node->set("sidecar", effect.target.u8string());
    effect.pictures.pop_back();
    refused("no picture at time 2");
    CHECK(!fs::exists(folder() / "shot.frames"));
    // Nor a sidecar with edits, nor what is none; the frames of an earlier time stay.
    write("shot.p4d.json", sidecar_text());
    refused("found edits, which are never replaced");
    write("shot.p4d.json", "{}");
    refused("found a file that is no sidecar");
    fs::remove(effect.target);
    // What is not ours stays.
    fs::create_directories(folder() / "shot.frames");
    write("shot.frames/holiday.exr", "mine");
    refused("found other files there");
    CHECK(effect.files() == 1);
    fs::remove_all(folder() / "shot.frames");
    effect.pictures.emplace_back(effect.layout);
    const auto alone = effect.plugin.create();  // its clip reports no range
    Host::get().configure({});
    const auto other = effect.plugin.create();
    other->set("sidecar", effect.target.u8string());
    CHECK(other->changed("analyse") == kOfxStatOK);
    CHECK(other->text("status").find("does not report the frames") != std::string::npos);
}
