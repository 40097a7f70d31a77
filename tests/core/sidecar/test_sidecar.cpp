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

/// A repeatable stream of numbers (the constants are those of Knuth's MMIX generator).
class Numbers {
public:
    explicit Numbers(std::uint64_t seed) : state_(seed) {}
    std::size_t below(std::size_t limit) {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return static_cast<std::size_t>(state_ >> 33) % limit;
    }

private:
    std::uint64_t state_;
};

/// Whether the reader returned or threw SidecarError, with a message in one line of valid text.
bool behaves(const std::string& text) {
    try {
        parse_sidecar(text, "name");
    } catch (const SidecarError& problem) {
        return !problem.found().empty() && !problem.expected().empty() &&
               !holds(problem.what(), "\n");
    } catch (...) {
        return false;
    }
    return true;
}

}  // namespace

TEST(every_golden_file_is_read) {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(golden_folder())) {
        if (!holds(entry.path().filename().string(), ".p4d.json")) continue;
        const Sidecar sidecar = read_sidecar(entry.path().u8string());
        CHECK_EQUAL(sidecar.conversion != nullptr, holds(contents(entry.path()), "\"conversion\""));
        CHECK_EQUAL(sidecar.polytope.first_frame(), static_cast<double>(sidecar.clip.first));
        CHECK_EQUAL(sidecar.polytope.last_frame(), static_cast<double>(sidecar.clip.last));
        CHECK_EQUAL(sidecar.edits.vertex_rgb.size(), sidecar.polytope.vertices().size());
        ++count;
    }
    CHECK(count >= 12);
}

TEST(values_arrive_unchanged) {
    const Sidecar sidecar = parse_sidecar(golden("edited"), "edited");
    CHECK_EQUAL(sidecar.clip.name, std::string("golden"));
    CHECK_EQUAL(sidecar.clip.width, 64);
    CHECK_EQUAL(sidecar.polytope.vertices().size(), 18u);
    CHECK_EQUAL(sidecar.polytope.sections().size(), 3u);
    CHECK_EQUAL(sidecar.polytope.sections()[1].first, 9.0);
    CHECK_EQUAL(sidecar.polytope.sections()[1].last, 10.0);
    const int vertex = sidecar.polytope.find_vertex("v17");
    CHECK(sidecar.edits.vertex_rgb[static_cast<std::size_t>(vertex)] == (Vec3{0.25, -0.125, 1.5}));
    CHECK(!sidecar.edits.vertex_rgb[0].has_value());
    CHECK_EQUAL(sidecar.edits.stops.size(), 3u);
    CHECK_EQUAL(sidecar.edits.stops[2].edge, sidecar.polytope.find_edge(std::string("e13")));
    CHECK_EQUAL(sidecar.edits.stops[2].frame, 9.25);

    const Sidecar stepped = parse_sidecar(golden("step_two"), "step_two");
    CHECK_EQUAL(stepped.clip.step, 2);
    CHECK_EQUAL(stepped.clip.rate_num, 24000);
    CHECK_EQUAL(stepped.clip.rate_den, 1001);
}

TEST(numbers_may_have_any_json_form) {
    std::string text = golden("tetrahedron");
    text = replaced(text, "\"size\": [64, 36]", "\"size\": [6.4e1, 36.0]");
    text = replaced(text, "\"version\": 1", "\"version\": 1.0");
    const Sidecar sidecar = parse_sidecar(text, "name");
    CHECK_EQUAL(sidecar.clip.width, 64);
    CHECK_EQUAL(sidecar.clip.height, 36);
}

TEST(an_error_names_file_pointer_found_and_expected) {
    const SidecarError problem = refused(replaced(
        golden("edited"), "\"edge\": \"e13\", \"frame\": 9.25", "\"edge\": \"e13\", \"frame\": 9"));
    CHECK_EQUAL(problem.file(), std::string("clip.p4d.json"));
    CHECK_EQUAL(problem.pointer(), std::string("/edits/stops/2/frame"));
    CHECK_EQUAL(problem.found(), std::string("the number 9"));
    CHECK_EQUAL(std::string(problem.what()), problem.file() + ": " + problem.pointer() +
                                                 ": found " + problem.found() + ", expected " +
                                                 problem.expected());
}

TEST(broken_documents_are_refused_where_they_are_broken) {
    struct Case {
        const char *from, *to, *pointer;
    };
    const std::vector<Case> cases = {
        {"palette4d.sidecar", "something.else", "/schema"},
        {"\"version\": 1", "\"version\": 3", "/version"},
        {"\"version\": 1", "\"version\": 1.5", "/version"},
        {"\"version\": 1", "\"version\": true", "/version"},
        {"\"version\": 1", "\"versions\": 1", "/version"},
        {"\"extra\": {", "\"a/b~c\": 0, \"extra\": {", "/a~1b~0c"},
        {"\"name\": \"golden\"", "\"name\": \"golden\", \"name\": \"again\"", "/clip/name"},
        {"\"last\": 20, \"step\": 1", "\"last\": 20, \"step\": 3", "/clip/frames/step"},
        {"\"step\": 1", "\"step\": 1.5", "/clip/frames/step"},
        {"\"step\": 1", "\"step\": 18446744073709551615", "/clip/frames/step"},
        {"[24, 1]", "[24, 0]", "/clip/rate/1"},
        {"[24, 1]", "[24, 1, 1]", "/clip/rate"},
        {"[64, 36]", "[64, -36]", "/clip/size/1"},
        {"\"skipped\": []", "\"skipped\": [21]", "/clip/frames/skipped/0"},
        {"\"id\": \"v1\"", "\"id\": \"\"", "/polytope/vertices/0/id"},
        {"\"id\": \"v2\"", "\"id\": \"v1\"", "/polytope/vertices/1/id"},
        {"\"id\": \"e1\"", "\"id\": \"v1\"", "/polytope/edges/0/id"},
        {"\"from\": \"v1\"", "\"from\": \"nobody\"", "/polytope/edges/0/from"},
        {"[0.1, 0.1, 0.1]", "[0.1, 0.1]", "/polytope/vertices/0/rgb"},
        {"[0.1, 0.1, 0.1]", "[0.1, 1e7, 0.1]", "/polytope/vertices/0/rgb/1"},
        {"[0.1, 0.1, 0.1]", "[0.1, 1e999, 0.1]", "/polytope/vertices/0/rgb/1"},
        {"[0.1, 0.1, 0.1]", "[0.1, NaN, 0.1]", "/polytope/vertices/0/rgb/1"},
        {"[[0, 2, 1], ", "[[0, 2, 4], ", "/polytope/blocks/0/faces/0/2"},
        {"[[0, 2, 1], ", "[[0, 2, -1], ", "/polytope/blocks/0/faces/0/2"},
        {"[[0, 2, 1], ", "[[0, 1, 2], ", "/polytope/blocks/0/faces/1"},  // two sides run alike
        {"\"first\": 0,\n        \"last\": 9", "\"first\": 1,\n        \"last\": 9",
         "/polytope/blocks/0/first"},
        {"[\"v1\", \"v5\"]", "[\"v1\", \"v6\"]", "/polytope/blocks/0/tracks/0/1"},
        {"\"stage\": \"frame_hulls\"", "\"stage\": 1", "/quality/stages/0/stage"},
        {"\"R\": 0.001", "\"R\": [0.001]", "/quality/stages/0/R"},
        {"\"vertex\": \"v17\"", "\"vertex\": \"v4\"", "/edits/vertices/1/vertex"},
        {"\"vertex\": \"v17\"", "\"vertex\": \"e1\"", "/edits/vertices/1/vertex"},
        {"\"id\": \"s3\"", "\"id\": \"s1\"", "/edits/stops/1/id"},
        {"\"frame\": 7, ", "\"frame\": 4.5, ", "/edits/stops/1/frame"},
        {"\"edge\": \"e13\"", "\"edge\": \"v8\"", "/edits/stops/2/edge"},
    };
    for (const Case& broken : cases) {
        const SidecarError problem = refused(replaced(golden("edited"), broken.from, broken.to));
        CHECK_EQUAL(problem.pointer(), std::string(broken.pointer));
        CHECK_EQUAL(problem.file(), std::string("clip.p4d.json"));
    }
    const std::vector<Case> picks = {
        {"\"ramp\": \"smooth\",\n", "\"ramp\": \"slow\",\n", "/edits/ramp"},
        {"\"ramp\": \"hold\"}", "\"ramp\": 1}", "/edits/vertices/0/ramp"},
        {"\"ramp\": \"linear\"", "\"ramp\": null", "/edits/stops/1/ramp"},
        {"\"kind\": \"pick\"", "\"kind\": \"want\"", "/edits/picks/0/kind"},
        {"\"id\": \"p2\"", "\"id\": \"p1\"", "/edits/picks/1/id"},
        {"\"enabled\": false", "\"enabled\": 0", "/edits/picks/1/enabled"},
        {"\"enabled\": false", "\"on\": false", "/edits/picks/1/on"},
        {"\"pixel\": [10, 7]", "\"pixel\": [10, -7]", "/edits/picks/0/pixel/1"},
        {"\"there\": 0.5", "\"there\": 1.5", "/edits/picks/0/path/0/there"},
        {"[[0.06, 0.05, 0.04]", "[[0.06, 0.05]", "/edits/picks/0/spread/0"},
        {"\"worst\": 0.004", "\"worst\": -1", "/edits/picks/0/worst"},
        {"{\"frame\": 12, \"rgb\": [0.3, 0.35, 0.3]}]", "{\"frame\": 0, \"rgb\": [0, 0, 0]}]",
         "/edits/picks/0/path/1/frame"},
        {"[\"v8\", \"s1\"]", "[\"v8\", 1]", "/edits/locks/1"},
        {"{\"vertex\": \"v8\"", "{\"vertex\": \"v2\"", "/edits/solution/vertices/1/vertex"},
        {"{\"vertex\": \"v8\"", "{\"vertex\": \"v99\"", "/edits/solution/vertices/1/vertex"},
        {"\"frame\": 2.5, \"by\"", "\"frame\": 6, \"by\"", "/edits/solution/keys/1/frame"},
        {"\"frame\": 2.5, \"by\"", "\"frame\": 9, \"by\"", "/edits/solution/keys/1/frame"},
        {"{\"radius\": 0.3,", "{\"radius\": 0,", "/edits/solution/bumps/1/radius"},
        {"{\"radius\": 0.3,", "{\"radius\": 0.3, \"x\": 1,", "/edits/solution/bumps/1/x"},
        {"{\"radius\": 0.3, \"keys\": [{\"frame\": 5, \"rgb\": [0.5, 0.35, 0.2], \"by\": "
         "[-0.03, 0.08, 0.04]}]}",
         "{\"radius\": 0.3, \"keys\": []}", "/edits/solution/bumps/1/keys"},
        {"{\"frame\": 14, \"rgb\"", "{\"frame\": 12, \"rgb\"",
         "/edits/solution/bumps/0/keys/3/frame"},
        {"[0.4, 0.3, 0.25, 0.5]", "[0.4, 0.3, 0.25, 1.5]", "/colours/0/rgbw/0/3"},
        {"{\"frame\": 20, \"rgbw\"", "{\"frame\": 0, \"rgbw\"", "/colours/1/frame"},
        {"\"name\": \"none\"", "\"name\": \"warm Gr\u00fcn\"", "/versions/1/name"},
        {"\"name\": \"none\"", "\"name\": \"\"", "/versions/1/name"},
        {"\"name\": \"none\"", "\"name\": \"a\\nb\"", "/versions/1/name"},
        {"\"edge\": \"e5\", \"frame\": 12", "\"edge\": \"e5\", \"frame\": 21",
         "/versions/0/edits/stops/0/frame"},
        {"\"history\": {", "\"history\": [], \"extra\": {", "/extra"},
    };
    for (const Case& broken : picks) {
        const SidecarError problem = refused(replaced(golden("picks"), broken.from, broken.to));
        CHECK_EQUAL(problem.pointer(), std::string(broken.pointer));
    }
}

TEST(picks_ramps_and_versions_arrive) {
    const Sidecar sidecar = parse_sidecar(golden("picks"), "picks");
    const Edits& edits = sidecar.edits;
    CHECK(edits.default_ramp == Ramp::kSmooth);
    CHECK(edits.vertex_ramp[3] == Ramp::kHold && !edits.vertex_ramp[4]);
    CHECK(!edits.stops[0].ramp && edits.stops[1].ramp == Ramp::kLinear);
    CHECK(edits.solution.vertex_by[7] == (Vec3{-0.04, 0.015, 0.03}));
    CHECK(edits.solution.vertex_by[0] == (Vec3{0, 0, 0}));
    CHECK_EQUAL(edits.solution.keys.size(), 3u);
    CHECK_EQUAL(edits.solution.keys[1].frame, 6.0);  // by edge and frame; the file has it first
    CHECK_EQUAL(edits.solution.bumps.size(), 2u);
    CHECK_EQUAL(edits.solution.bumps[0].keys.size(), 4u);
    CHECK(edits.solution.bumps[0].keys[2].by == (Vec3{0.06, -0.04, 0.02}));
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

TEST(a_newer_version_asks_for_an_update) {
    const SidecarError problem =
        refused(replaced(golden("tetrahedron"), "\"version\": 1", "\"version\": 3, \"new\": {}"));
    CHECK(holds(problem.what(), "written by a newer palette4d"));
    CHECK(holds(problem.what(), "update"));
}

TEST(text_that_is_no_json_is_refused) {
    const std::string text = golden("tetrahedron");
    CHECK(holds(refused("").what(), "empty"));
    CHECK(holds(refused("\xef\xbb\xbf" + text).what(), "byte order mark"));
    CHECK(holds(refused(std::string("\xff\xfe{\0", 4)).what(), "byte order mark"));
    CHECK(holds(refused(replaced(text, "golden", "g\xff")).what(), "line 6"));
    CHECK(holds(refused(replaced(text, "golden", "g\xed\xa0\x80")).what(), "no JSON"));
    CHECK_EQUAL(refused(replaced(text, "golden", "g\xff")).pointer(), std::string("/clip/name"));
    CHECK(holds(refused(text + "{}").what(), "no JSON"));
    CHECK(holds(refused("[]").what(), "a list of 0"));
    CHECK(holds(refused("null").what(), "null"));
    CHECK(holds(refused(std::string(1 << 20, '[')).what(), "nesting"));
    std::string objects;
    for (int i = 0; i < 100; ++i) objects += "{\"a\":";
    CHECK(holds(refused(objects).what(), "nesting"));
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

TEST(paths_that_are_no_files_are_refused) {
    for (const std::string& path :
         {golden_folder().u8string(), (golden_folder() / "missing.json").u8string(), std::string(),
          std::string("\xff\xfe"), std::string(100'000, 'x')}) {
        try {
            read_sidecar(path);
            CHECK(false);
        } catch (const SidecarError& problem) {
            CHECK_EQUAL(problem.file(), path);
            CHECK_EQUAL(problem.pointer(), std::string());
        }
    }
}

TEST(every_truncation_is_refused) {
    const std::string text = golden("edited");
    for (std::size_t length = 0; length + 2 < text.size(); ++length) {
        CHECK(refused(text.substr(0, length)).pointer() != "(accepted)");
    }
}

TEST(random_damage_never_does_more_than_throw) {
    static const char kBytes[] = "\"{}[],:0123456789.-+eEvsntfu\\ \n\x00\x7f\x80\xc3\xff";
    Numbers numbers(20211);
    for (const char* name : {"edited", "edge_through_boundary", "step_two", "flat"}) {
        const std::string text = golden(name);
        for (int round = 0; round < 1500; ++round) {
            std::string damaged = text;
            for (std::size_t hits = 1 + numbers.below(3); hits > 0; --hits) {
                const std::size_t at = numbers.below(damaged.size());
                const char byte = kBytes[numbers.below(sizeof kBytes - 1)];
                switch (numbers.below(4)) {
                    case 0:
                        damaged[at] = byte;
                        break;
                    case 1:
                        damaged.insert(at, 1, byte);
                        break;
                    case 2:
                        damaged.erase(at, 1 + numbers.below(8));
                        break;
                    default:
                        damaged.insert(at, damaged.substr(numbers.below(damaged.size()), 24));
                }
            }
            CHECK(behaves(damaged));
        }
    }
}
