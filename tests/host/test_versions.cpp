// Picks and the versions of a sidecar's edits, in the node.
#include <cstring>

#include "harness.hpp"
#include "model/handles.hpp"

using namespace strict;
using namespace test;
using palette4d::Vec3;

namespace {

/// A pick that moves with the clip and a hold.
const std::string kPicks =
    R"("picks": [{"id": "p1", "kind": "pick", "frame": 12, "rgb": [0.75, 0.25, 0.25],
    "to": [0.25, 0.5, 0.75], "path": [{"frame": 11, "rgb": [0.75, 0.25, 0.25]},
    {"frame": 19, "rgb": [0.5, 0.25, 0.75]}]},
    {"id": "p2", "kind": "hold", "frame": 9, "rgb": [0.5, 0.75, 0.25]}])";

std::string text_with(const std::string& picks, const std::string& versions) {
    std::string text = sidecar_text();
    const std::size_t edits = text.find("\"edits\": {") + 10;
    text.insert(edits, picks + ", ");
    return text.insert(text.find("\"edits\""), "\"versions\": [" + versions + "], ");
}

const std::string kVersions = R"({"name": "warm 'Gr\u00fcn", "edits": {"vertices": [],
    "stops": [], )" + kPicks + R"(}}, {"name": "plain", "edits": {"vertices": [], "stops": []}})";

struct Scene : Shown {
    explicit Scene(const std::string& text) : Shown(test::write("clip.p4d.json", text)) {}
    std::vector<unsigned char> expected(const palette4d::Edits& edits, double frame = 12) const {
        return edited(edits, frame);
    }
};

}  // namespace

TEST(the_status_says_how_an_edit_plays_the_shot) {
    const auto status = [](const std::string& extra) {
        std::string text = sidecar_text();
        const std::string empty = R"("extra": {})";
        Scene scene(text.replace(text.find(empty), empty.size(), R"("extra": )" + extra));
        CHECK(scene.instance->changed("reload") == kOfxStatOK);
        return scene.instance->text("status");
    };
    const auto has = [&](const std::string& edit, const std::string& words) {
        const std::string text = status(R"({"edit": )" + edit + "}");
        EXPECT((text.find("the edit") != std::string::npos) == !words.empty(), text);
        EXPECT(text.find(words) != std::string::npos, text);
    };
    has(R"({"speed": 1.5, "reverse": true, "inPoint": 8})",
        "\nthe edit plays it with Speed 1.5, Reverse on, In-point 8\n");
    has(R"({"speed": 0.333333333, "reverse": false, "inPoint": 0, "cdl": {}})",
        "\nthe edit plays it with Speed 0.333333333, In-point 0\n");
    has(R"({"speed": 0, "reverse": false, "inPoint": 0})", "\nthe edit shows a freeze frame\n");
    // Other programs may have written anything there.
    for (const char* other : {"{}", "3", "null", "[1]", R"({"speed": "x"})",
                              R"({"speed": 2, "inPoint": {}, "reverse": true})"}) {
        has(other, "");
    }
    EXPECT(status("{}").find("the edit") == std::string::npos, status("{}"));
}

TEST(the_node_applies_the_picks) {
    Scene scene(text_with(kPicks, ""));
    palette4d::Edits without = scene.parsed.edits;
    without.picks.clear();
    for (const double time : {0.0, 2.0, 5.5, 10.0}) {
        const auto found = scene.render(time);
        CHECK(found == scene.expected(scene.parsed.edits, 10 + time));
        CHECK(found != scene.expected(without, 10 + time));
    }
    CHECK(scene.instance->changed("reload") == kOfxStatOK);
    CHECK(scene.says("3 edits, 2 picks and holds\n"));
    // Rewritten with another pick.
    std::string other = kPicks;
    other.replace(other.find("0.25, 0.5, 0.75"), 15, "0.25, 0.5, 0.50");
    write("clip.p4d.json", text_with(other, ""));
    const auto found = scene.render();
    CHECK(found != scene.expected(scene.parsed.edits));
    CHECK(found == scene.expected(palette4d::read_sidecar(scene.path).edits));
}

TEST(colours_from_the_host_keep_the_picks) {
    Scene scene(text_with(kPicks, ""));
    scene.set("handle02On", 1);
    scene.set("handle02", std::array<double, 3>{0.75, 0.25, 0.5});
    const auto with = [&](bool keep) {
        return palette4d::with_colours(scene.parsed.polytope, scene.parsed.edits, keep,
                                       {{1, {0.75, 0.25, 0.5}}});
    };
    CHECK(!with(true).picks.empty() && with(false).picks.empty());
    CHECK(scene.render() == scene.expected(with(true)));
    // The host's edits alone: the picks are the sidecar's.
    scene.set("editsFrom", 1);
    CHECK(scene.render() == scene.expected(with(false)));
    CHECK(scene.expected(with(false)) != scene.expected(with(true)));
}

TEST(mattes_are_of_the_palette_alone) {
    Scene plain(sidecar_text()), solved(text_with(kPicks, ""));
    for (const int output : {1, 3}) {  // the weight of a handle, and what lies outside
        std::vector<unsigned char> found[2];
        for (Scene* scene : {&plain, &solved}) {
            scene->set("output", output);
            scene->set("weightOf", 2);
            found[scene == &solved] = scene->render();
        }
        CHECK(found[0] == found[1]);
        CHECK(found[0] != plain.unchanged());
    }
}

TEST(the_user_chooses_a_version) {
    Scene scene(text_with(kPicks, kVersions));
    const auto active = scene.render();
    CHECK(active == scene.expected(scene.parsed.edits));
    scene.set("version", std::string("warm 'Gr\u00fcn"));
    CHECK(scene.render() == scene.expected(scene.parsed.versions[0].edits));
    CHECK(scene.render() != active);
    scene.set("version", std::string("plain"));
    CHECK(scene.render() == scene.unchanged());
    CHECK(scene.message().empty());
    // The status counts the version's edits and names the version.
    CHECK(scene.instance->changed("version") == kOfxStatOK);
    CHECK(scene.says("0 edits"));
    CHECK(scene.says(" in version 'plain'\n"));
    scene.change("version", std::string());
    CHECK(scene.render() == active);
    CHECK(!scene.says("in version"));
    CHECK(scene.instance->text("status").find("\nversions 'warm 'Gr\u00fcn', 'plain'\n") !=
          std::string::npos);
}

TEST(a_version_that_is_not_there_is_said) {
    Scene scene(text_with(kPicks, kVersions));
    scene.set("version", std::string("warn"));
    CHECK(scene.render() == scene.unchanged());
    for (const char* word : {"'warn'", "'warm 'Gr\u00fcn'", "'plain'"}) {
        EXPECT(scene.message().find(word) != std::string::npos, scene.message());
    }
    CHECK(scene.instance->changed("version") == kOfxStatOK);
    CHECK(scene.instance->text("status") == scene.message());
    // It comes back with the file.
    std::string text = text_with(kPicks, kVersions);
    text.replace(text.find("\"plain\""), 7, "\"warn\"");
    write("clip.p4d.json", text);
    CHECK(scene.render() == scene.unchanged() && scene.message().empty());
    write("clip.p4d.json", text_with(kPicks, ""));
    CHECK(scene.render() == scene.unchanged());
    EXPECT(scene.message().find("no versions") != std::string::npos, scene.message());
    scene.set("version", std::string());
    CHECK(scene.render() != scene.unchanged() && scene.message().empty());
}
