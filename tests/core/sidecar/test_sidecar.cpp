// Values, errors and paths: tests/bindings/test_sidecar.py. Any damage: tests/fuzz/.
#include "sidecar/sidecar.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "check.hpp"

using namespace palette4d;

namespace {

std::filesystem::path golden_folder() {
    return std::filesystem::path(PALETTE4D_TESTS) / "golden" / "sidecars";
}

std::string contents(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

std::string golden(const std::string& name) {
    return contents(golden_folder() / ("v1_" + name + ".p4d.json"));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    CHECK(at != std::string::npos);
    if (at != std::string::npos) text.replace(at, from.size(), to);
    return text;
}

/// The error of a text that must be refused; an error of its own when it is not.
SidecarError refused(const std::string& text) {
    try {
        parse_sidecar(text, "clip.p4d.json");
    } catch (const SidecarError& problem) {
        return problem;
    }
    return {"", "(accepted)", "", ""};
}

bool holds(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST(numbers_may_have_any_json_form) {
    std::string text = golden("tetrahedron");
    text = replaced(text, "\"size\": [64, 36]", "\"size\": [6.4e1, 36.0]");
    text = replaced(text, "\"version\": 1", "\"version\": 1.0");
    const Sidecar sidecar = parse_sidecar(text, "name");
    CHECK_EQUAL(sidecar.clip.width, 64);
    CHECK_EQUAL(sidecar.clip.height, 36);
}

TEST(picks_ramps_and_versions_arrive) {
    const Sidecar sidecar = parse_sidecar(golden("picks"), "picks");
    const Edits& edits = sidecar.edits;
    CHECK(edits.default_ramp == Ramp::kSmooth);
    CHECK(edits.vertex_ramp[3] == Ramp::kHold && !edits.vertex_ramp[4]);
    CHECK(!edits.stops[0].ramp && edits.stops[1].ramp == Ramp::kLinear);
    CHECK_EQUAL(edits.picks.size(), 2u);
    const Pick &pick = edits.picks[0], &hold = edits.picks[1];
    CHECK(pick.id == "p1" && !pick.hold && pick.enabled && pick.toward_colour);
    CHECK(pick.frame == 3 && pick.from == 2.0 && pick.until == 12.0 && pick.fade == 2);
    CHECK(pick.rgb == (Vec3{0.4, 0.3, 0.25}) && pick.to == (Vec3{0.5, 0.25, 0.2}));
    CHECK(pick.path.size() >= 2 && pick.path[0].there == 0.5);
    CHECK(hold.hold && !hold.enabled && hold.to == hold.rgb);
    // Version 1 knows no mattes: all of the hue.
    CHECK(!pick.matte && pick.taken().odds == hue_matte(pick.rgb).odds);
    CHECK(pick.reach == 0 && pick.softness == 0.5 && pick.darkest == 0 && pick.lightest == 1);
    CHECK_EQUAL(sidecar.versions.size(), 2u);
    CHECK_EQUAL(sidecar.versions[0].name, std::string("warm Gr\u00fcn"));
    CHECK(sidecar.versions[0].edits.default_ramp == Ramp::kHold);
    CHECK_EQUAL(sidecar.versions[0].edits.stops[0].id, std::string("s1"));
    CHECK(sidecar.versions[1].edits.stops.empty());
    // A name counts characters, not bytes.
    std::string name;
    for (int i = 0; i < 100; ++i) name += "\u7d75";
    const auto named = [&](const std::string& text) {
        return replaced(golden("picks"), "\"name\": \"none\"", "\"name\": \"" + text + '"');
    };
    CHECK_EQUAL(parse_sidecar(named(name), "name").versions[1].name, name);
    CHECK_EQUAL(refused(named(name + "x")).pointer(), std::string("/versions/1/name"));
}

namespace {

/// Mattes as Python writes them: zlib streams of differences, as base64. All nodes of these have
/// log odds 126; then 127, one node less, and 100 at the first node, 3 at all others.
const std::string kSure =
    "eNrtwSEBAAAAAiCXu90bBqABAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAF4M0LMAfw==";
const std::string kTooSure =
    "eNrtwSEBAAAAAiCfe90bBqABAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAF4MEOAAgA==";
const std::string kShort =
    "eNrtwTEBAAAAwqD1T20ND6AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAgBMDQB0AAQ==";
const std::string kWrapped =
    "eNrtwTEBAAAMAqCFtdeqWsMDyB8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAMKIhqAEE";

/// A file of version 2 with one pick that has a learned matte, and one that has none.
std::string version_2() {
    std::string text = golden("tetrahedron");
    text = replaced(text, "\"version\": 1", "\"version\": 2");
    text = replaced(
        text, "\"extra\": {",
        "\"mattes\": {\"display\": {\"from\": -0.5, \"to\": 1.5, \"values\": [0, 0.25, 1]},"
        "\"grids\": {\"m1\": \"" +
            kSure + "\", \"m2\": \"" + kWrapped + "\"}}, \"extra\": {");
    return replaced(
        text, "\"stops\": []",
        "\"stops\": [], \"picks\": ["
        "{\"id\": \"p1\", \"kind\": \"pick\", \"frame\": 3, \"rgb\": [0.4, 0.3, 0.25],"
        " \"to\": [0.5, 0.2, 0.2], \"pixel\": [10, 7], \"box\": 3, \"matte\": \"m2\","
        " \"areas\": [{\"frame\": 3, \"points\": [[1, 2], [3, 4.5]], \"radius\": 2}],"
        " \"whole_hue\": false, \"reach\": -1.5, \"softness\": 0.25, \"lightness\": [0.125, 0.75],"
        " \"window\": {\"feather\": 20, \"keys\": [{\"frame\": 3, \"box\": [-5, 0, 10, 7.5], "
        "\"given\": true}, {\"frame\": 5, \"box\": [5, 2, 30, 11.5]}]}},"
        "{\"id\": \"p2\", \"kind\": \"hold\", \"frame\": 0, \"rgb\": [0.4, 0.3, 0.25]}]");
}

}  // namespace

TEST(version_2_has_mattes) {
    const Sidecar sidecar = parse_sidecar(version_2(), "two");
    const Edits& edits = sidecar.edits;
    CHECK(edits.display && edits.display->from == -0.5 && edits.display->to == 1.5);
    CHECK(edits.display->values == (std::vector<double>{0, 0.25, 1}));
    const Pick &pick = edits.picks[0], &hold = edits.picks[1];
    CHECK_EQUAL(pick.taken().odds.size(), MatteGrid::kSize);
    CHECK(pick.taken().odds[0] == 100 && pick.taken().odds[1] == 3 &&
          pick.taken().odds.back() == 3);
    CHECK(pick.reach == -1.5 && pick.softness == 0.25);
    CHECK(pick.darkest == 0.125 && pick.lightest == 0.75);
    CHECK(pick.window && !hold.window && pick.window->feather == 20);
    CHECK(pick.window->box_at(4) == (PickWindow::Box{0, 1, 20, 9.5}));
    CHECK(edits.width == static_cast<double>(sidecar.clip.width) &&
          edits.height == static_cast<double>(sidecar.clip.height));
    CHECK(!hold.matte &&
          hold.taken().odds == hue_matte(displayed(hold.rgb, edits.display.get())).odds);
    const std::string other = replaced(version_2(), "\"matte\": \"m2\"", "\"matte\": \"m1\"");
    const Matte sure = parse_sidecar(other, "other").edits.picks[0].taken();
    CHECK(sure.odds == std::vector<std::uint8_t>(MatteGrid::kSize, 126));
}

TEST(versions_share_mattes) {
    const std::string text = version_2();
    const std::size_t at = text.find("\"edits\": ") + 9;
    // The text of the edits, up to the member behind it.
    int depth = 0;
    std::size_t end = at;
    do {
        depth += (text[end] == '{') - (text[end] == '}');
        ++end;
    } while (depth > 0 || text[end - 1] != '}');
    const std::string edits = text.substr(at, end - at);
    const Sidecar sidecar = parse_sidecar(
        replaced(text, "\"extra\": {",
                 "\"versions\": [{\"name\": \"a\", \"edits\": " + edits + "}], \"extra\": {"),
        "versions");
    CHECK(sidecar.versions[0].edits.picks[0].matte == sidecar.edits.picks[0].matte);
    CHECK(sidecar.versions[0].edits.display == sidecar.edits.display);
}

TEST(broken_mattes_and_picks_are_refused_where_they_are_broken) {
    struct Case {
        std::string from, to, pointer;
    };
    const std::string sure = kSure;
    std::string damaged = sure;
    std::swap(damaged[20], damaged[21]);
    const std::vector<Case> cases = {
        {sure, kTooSure, "/mattes/grids/m1"},
        {sure, kShort, "/mattes/grids/m1"},
        {sure, damaged.substr(1), "/mattes/grids/m1"},
        {sure, "!" + sure.substr(1), "/mattes/grids/m1"},
        {sure, sure.substr(0, sure.size() - 4), "/mattes/grids/m1"},
        {sure, sure + "AAAA", "/mattes/grids/m1"},
        {sure, "", "/mattes/grids/m1"},
        {"\"m1\":", "\"m 1\":", "/mattes/grids"},
        {"\"m1\":", "\"m1\\u0000\":", "/mattes/grids"},
        {"\"m1\":", "\"\":", "/mattes/grids"},
        {"\"m1\":", "\"m2\":", "/mattes/grids/m2"},
        {"\"from\": -0.5", "\"from\": 1.5", "/mattes/display/to"},
        {"\"matte\": \"m2\"", "\"matte\": \"m3\"", "/edits/picks/0/matte"},
        {"[0.125, 0.75]", "[0.75, 0.75]", "/edits/picks/0/lightness"},
        {"\"box\": 3", "\"spread\": []", "/edits/picks/0/spread"},  // of version 1
        {"[-5, 0, 10, 7.5]", "[-5, 0, -5, 7.5]", "/edits/picks/0/window/keys/0/box"},
        {"[-5, 0, 10, 7.5]", "[-5, 8, 10, 7.5]", "/edits/picks/0/window/keys/0/box"},
        {"[-5, 0, 10, 7.5]", "[-5, 0, 10]", "/edits/picks/0/window/keys/0/box"},
        {"[-5, 0, 10, 7.5]", "[-5, 0, 1e7, 7.5]", "/edits/picks/0/window/keys/0/box/2"},
        {"{\"frame\": 5, \"box\"", "{\"frame\": 3, \"box\"", "/edits/picks/0/window/keys/1/frame"},
        {"\"feather\": 20", "\"feather\": -1", "/edits/picks/0/window/feather"},
        {"\"feather\": 20, ", "", "/edits/picks/0/window/feather"},
        {"\"kind\": \"hold\"",
         "\"window\": {\"feather\": 1, \"keys\": [{\"frame\": 1, \"box\": [0, 0, 1, 1]}]}, "
         "\"kind\": \"hold\"",
         "/edits/picks/1/window"},
        {"\"picks\": [", "\"solution\": {}, \"picks\": [", "/edits/solution"},
    };
    for (const Case& broken : cases) {
        const SidecarError problem = refused(replaced(version_2(), broken.from, broken.to));
        CHECK_EQUAL(problem.pointer(), broken.pointer);
    }
    const std::vector<Case> picks = {
        {"\"id\": \"p2\"", "\"id\": \"p1\"", "/edits/picks/1/id"},
        {"{\"frame\": 12, \"rgb\": [0.3, 0.35, 0.3]}]", "{\"frame\": 0, \"rgb\": [0, 0, 0]}]",
         "/edits/picks/0/path/1/frame"},
        {"{\"frame\": 20, \"rgbw\"", "{\"frame\": 0, \"rgbw\"", "/colours/1/frame"},
        {"\"name\": \"none\"", "\"name\": \"warm Gr\u00fcn\"", "/versions/1/name"},
        {"\"name\": \"none\"", "\"name\": \"a\\nb\"", "/versions/1/name"},
        {"\"edge\": \"e5\", \"frame\": 12", "\"edge\": \"e5\", \"frame\": 21",
         "/versions/0/edits/stops/0/frame"},
    };
    for (const Case& broken : picks) {
        const SidecarError problem = refused(replaced(golden("picks"), broken.from, broken.to));
        CHECK_EQUAL(problem.pointer(), broken.pointer);
    }
}

TEST(version_1_ignores_what_picks_were_solved_to) {
    const std::string text = golden("picks");
    const Sidecar as_it_was = parse_sidecar(text, "one");
    const std::string other =
        replaced(replaced(text, "\"radius\": 0.125, \"path\"", "\"radius\": null, \"path\""),
                 "\"vertices\": [\n        {\"vertex\": \"v2\", \"by\"",
                 "\"vertices\": [\n        {\"vertex\": \"nobody\", \"by\"");
    const Sidecar changed = parse_sidecar(other, "one");
    CHECK_EQUAL(changed.edits.picks.size(), as_it_was.edits.picks.size());
    CHECK_EQUAL(refused(replaced(text, "\"version\": 1", "\"version\": 2")).pointer(),
                std::string("/edits/picks/0/radius"));
}

TEST(picks_and_mattes_are_bounded) {
    const auto listed = [](int count, const auto& one) {
        std::string list;
        for (int i = 0; i < count; ++i) list += (i ? "," : "") + one(std::to_string(i));
        return list;
    };
    const std::string text = golden("tetrahedron");
    const auto with_grids = [&](int count) {
        return replaced(replaced(text, "\"version\": 1", "\"version\": 2"), "\"extra\": {",
                        "\"mattes\": {\"grids\": {" + listed(count, [](const std::string& i) {
                            return "\"m" + i + "\": \"" + kSure + '"';
                        }) + "}}, \"extra\": {");
    };
    CHECK(parse_sidecar(with_grids(100), "many").edits.picks.empty());
    CHECK_EQUAL(refused(with_grids(1001)).pointer(), std::string("/mattes/grids"));
    const std::string points =
        listed(60'000, [](const std::string&) { return std::string("[1,2]"); });
    CHECK_EQUAL(
        parse_sidecar(replaced(version_2(), "[[1, 2], [3, 4.5]]", '[' + points + ']'), "many")
            .edits.picks.size(),
        2u);
    CHECK_EQUAL(
        refused(replaced(version_2(), "[[1, 2], [3, 4.5]]", '[' + points + ',' + points + ']'))
            .pointer(),
        std::string("/edits/picks/0/areas/0/points"));
    const auto with_areas = [&](int count) {
        const std::string area = "{\"frame\": 3, \"points\": [[1, 2], [3, 4.5]], \"radius\": 2}";
        return replaced(version_2(), area, listed(count, [&](const std::string&) { return area; }));
    };
    CHECK_EQUAL(parse_sidecar(with_areas(200), "many").edits.picks.size(), 2u);
    CHECK_EQUAL(refused(with_areas(201)).pointer(), std::string("/edits/picks/0/areas"));
}

TEST(picks_that_are_drawn_are_bounded) {
    const auto picks = [](int enabled, int disabled) {
        std::string list;
        for (int i = 0; i < enabled + disabled; ++i) {
            list += std::string(i ? "," : "") + "{\"id\": \"q" + std::to_string(i) +
                    "\", \"kind\": \"hold\", \"frame\": 3, \"rgb\": [0.4, 0.3, 0.25]" +
                    (i < enabled ? "}" : ", \"enabled\": false}");
        }
        return "\"stops\": [], \"picks\": [" + list + "]";
    };
    const std::string text = replaced(golden("tetrahedron"), "\"version\": 1", "\"version\": 2");
    const auto with = [&](const std::string& list) {
        return replaced(text, "\"stops\": []", list);
    };
    const auto version = [&](const std::string& list) {
        return replaced(text, "\"extra\": {",
                        "\"versions\": [{\"name\": \"one\", \"edits\": {\"vertices\": [], " + list +
                            "}}], \"extra\": {");
    };
    // What is not drawn may be kept.
    CHECK_EQUAL(parse_sidecar(with(picks(100, 30)), "many").edits.picks.size(), 130u);
    CHECK_EQUAL(parse_sidecar(version(picks(100, 30)), "many").versions[0].edits.picks.size(),
                130u);
    const SidecarError problem = refused(with(picks(101, 30)));
    CHECK_EQUAL(problem.pointer(), std::string("/edits/picks"));
    CHECK(holds(problem.what(),
                "found 101 enabled picks and holds, expected at most 100 enabled picks and holds"));
    // A host may show any version.
    CHECK_EQUAL(refused(version(picks(101, 0))).pointer(), std::string("/versions/0/edits/picks"));
}

TEST(size_is_bounded) {
    std::string many = "[";
    for (int i = 0; i < 4'000'001; ++i) many += "0,";
    CHECK(holds(refused(many + "0]").what(), "more than 4000000 values"));
    CHECK(holds(refused(std::string(kMaxSidecarBytes + 1, ' ')).what(), "bytes"));
    const auto path = std::filesystem::temp_directory_path() / "palette4d_test_large.p4d.json";
    {
        std::ofstream stream(path, std::ios::binary);
        stream.seekp(static_cast<std::streamoff>(kMaxSidecarBytes));
        stream.put(' ');
    }
    CHECK_THROWS(SidecarError, read_sidecar(path.u8string()));
    std::filesystem::remove(path);
}

TEST(every_truncation_is_refused) {
    const std::string text = golden("edited");
    for (std::size_t length = 0; length + 2 < text.size(); ++length) {
        CHECK(refused(text.substr(0, length)).pointer() != "(accepted)");
    }
}
