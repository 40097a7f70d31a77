// What Natron does beyond the standard, as its source has it, and what the node makes of that.
#include <cmath>
#include <cstdlib>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

namespace fs = std::filesystem;
using palette4d::Vec3;

double srgb_of(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}
double linear_of(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// The sidecar, of which a window of Natron with a project hears next.
std::string in_natron(const std::string& chosen, const std::string& project) {
    Config config;
    config.natron = true;
    config.project = project;
    Host::get().configure(config);
    return chosen;
}

struct Window : Shown {
    explicit Window(const std::string& chosen = sidecar(), const std::string& project = "")
        : Shown(in_natron(chosen, project), kOfxImageEffectContextGeneral) {
        change("sidecar", path);
    }
    std::vector<unsigned char> render(double time = 4) const { return Shown::render(time); }
    std::vector<unsigned char> edited(double frame = 14) const { return Shown::edited(frame); }
    int in_use() {
        int count = 0;
        for (const std::string& name : instance->effect().params.order) {
            if (name.rfind("handle", 0) == 0 && name.size() > 2 &&
                name.compare(name.size() - 2, 2, "On") == 0) {
                count += std::get<int>(instance->value(name));
            }
        }
        return count;
    }
    Colour colour(const char* name) { return std::get<Colour>(instance->value(name)); }
};

}  // namespace

TEST(a_window_does_not_hang) {
    // The strict host faults an action that it sends while paramEditEnd holds its lock.
    Window window;
    for (const bool edited : {false, true}) {
        write("clip.p4d.json", sidecar_text(edited));
        CHECK(window.instance->changed("reload") == kOfxStatOK);
    }
    write("clip.p4d.json", sidecar_text(false));
    CHECK(window.instance->changed("", "", kOfxChangeTime) == kOfxStatOK);
    window.change("sidecar", sidecar("other.p4d.json"));
    window.change("handle02", Colour{1, 1, 0});
    CHECK(window.instance->changed("resetHandles") == kOfxStatOK);
    // The colours follow all the same.
    CHECK(window.colour("handle02") == (Colour{0.2, 0.7, 0.1}));
}

TEST(a_message_is_its_text_whatever_is_in_it) {
    Window window;
    window.change("sidecar", std::string("/nowhere/100%s %d.p4d.json"));
    CHECK(window.render() == window.unchanged());
    const std::string& said = window.message();
    EXPECT(said.find("/nowhere/100%s %d.p4d.json: ") == 0, "said '" + said + "'");
}

TEST(a_message_that_the_host_cleared_comes_back) {
    // The strict host clears it before each render.
    Window window;
    const std::string whole = sidecar_text();
    const std::string& said = window.message();
    for (int round = 0; round < 2; ++round) {
        write("clip.p4d.json", "no JSON");
        for (const double time : {4.0, 4.0, 5.0}) {
            CHECK(window.render(time) == window.unchanged());
            EXPECT(said.find(window.path) == 0, "said '" + said + "'");
        }
        write("clip.p4d.json", whole);
        CHECK(window.render() == window.edited());
        CHECK(said.empty());
    }
}

TEST(restored_defaults_leave_no_handle_on) {
    Window window;
    window.change("handle02", Colour{1, 1, 0});
    window.instance->animate("handle03", {{0, Colour{0, 0, 0}}, {9, Colour{1, 1, 1}}});
    CHECK(window.instance->changed("handle03") == kOfxStatOK);
    CHECK(window.in_use() == 2);
    window.instance->restore_defaults();
    CHECK(window.in_use() == 0);
    CHECK(window.instance->text("sidecar").empty());
    CHECK(window.render() == window.unchanged());
    window.change("sidecar", window.path);
    CHECK(window.in_use() == 0);
    CHECK(window.render() == window.edited());
    CHECK(window.colour("handle02") == (Colour{0.2, 0.7, 0.1}));
    // One parameter alone, of a slot in use and of one that is not.
    window.change("handle02", Colour{1, 1, 0});
    window.instance->restore_defaults({"handle02"});
    window.instance->restore_defaults({"handle05"});
    CHECK(window.in_use() == 0);
    CHECK(window.colour("handle02") == (Colour{0.2, 0.7, 0.1}));
    CHECK(window.render() == window.edited());
    // Black is a colour like any other.
    window.change("handle02", Colour{0, 0, 0});
    CHECK(window.in_use() == 1);
}

TEST(a_cache_keyed_by_the_parameters_is_never_stale) {
    Window window;
    Instance& node = *window.instance;
    const std::string whole = sidecar_text(), plain = sidecar_text(false);
    const std::vector<unsigned char> edited = window.edited(), unchanged = window.unchanged();
    const auto told = [&] { CHECK(node.changed("", "", kOfxChangeTime) == kOfxStatOK); };
    const auto shows = [&](const std::vector<unsigned char>& expected, const char* words) {
        told();
        EXPECT(node.cached(4, window.source) == expected, words);
    };
    shows(edited, "chosen");
    fs::remove(fs::u8path(window.path));
    shows(unchanged, "gone");
    write("clip.p4d.json", whole);
    shows(edited, "back");
    write("clip.p4d.json", "no JSON");
    // Frames that the host renders before it tells of anything.
    CHECK(node.cached(5, window.source) == unchanged);
    shows(unchanged, "broken");
    write("clip.p4d.json", whole);
    shows(edited, "fixed");
    CHECK(node.cached(5, window.source) == window.edited(15));
    write("clip.p4d.json", plain);
    CHECK(node.cached(6, window.source) == unchanged);
    write("clip.p4d.json", whole);
    // Nothing that the node has seen has changed, but the cache is wrong: Reload discards it.
    CHECK(node.changed("reload") == kOfxStatOK);
    CHECK(node.cached(6, window.source) == window.edited(16));
}

TEST(paths_survive_a_project_that_is_saved) {
    const std::string path = sidecar();
    const std::string in = folder().u8string();
    for (const char* name : {"HOME", "USERPROFILE", "P4D_SHOW"}) set_variable(name, in);
    fs::create_directories(folder() / "a project");
    fs::copy_file(fs::u8path(path), folder() / "a project" / "near.p4d.json");
    Window window(path, in + "/a project");
    for (const std::string& given :
         {std::string("~/clip.p4d.json"), std::string("$P4D_SHOW/clip.p4d.json"),
          std::string("${P4D_SHOW}/clip.p4d.json"), std::string("%P4D_SHOW%/clip.p4d.json"),
          "file://" + path, "\"" + path + "\"", "'" + path + "'", std::string("near.p4d.json"),
          std::string("[Project]/near.p4d.json"), path}) {
        window.instance->set("sidecar", given);
        EXPECT(window.render() == window.edited(), given);
    }
    fs::rename(fs::u8path(path), folder() / "moved.p4d.json");
    window.instance->set("sidecar", std::string("/elsewhere/moved.p4d.json"));
    window.instance->set("clipFolder", std::string());
    CHECK(window.render() == window.unchanged());
    window.instance->set("clipFolder", std::string("~"));
    CHECK(window.render() == window.edited());
    window.instance->set("clipFolder", std::string("$P4D_SHOW"));
    CHECK(window.render() == window.edited());
    // What is missing is named without the project's folder.
    window.instance->set("sidecar", std::string("$P4D_SHOW/gone.p4d.json"));
    window.render();
    const std::string& said = window.message();
    EXPECT(said.find(in + "/gone.p4d.json: ") == 0, said);
}

TEST(a_typed_colour_is_undone_in_one_step) {
    Window window;
    const Colour before = window.colour("handle02");
    window.change("handle02", Colour{1, 1, 0});
    CHECK(window.in_use() == 1);
    CHECK(window.instance->undo_steps().empty());
    window.change("handle02", before);  // the host's undo, of what the user typed alone
    CHECK(window.in_use() == 0);
    CHECK(window.instance->text("handle02Id").empty());
    CHECK(window.render() == window.edited());
    window.change("handle02", Colour{1, 1, 0});  // and its redo
    CHECK(window.in_use() == 1);
    // A slot that the user has switched on stays on with the palette's own colour.
    window.change("handle03On", 1);
    window.change("handle03", window.colour("handle03"));
    CHECK(std::get<int>(window.instance->value("handle03On")) == 1);
}

TEST(reset_removes_keyframes) {
    for (const bool natron : {false, true}) {
        Window window;
        Config config;
        config.natron = natron;
        Host::get().configure(config);
        CHECK(window.plugin.load() == kOfxStatOK);
        const std::map<double, Value> keys = {{0, Colour{0, 0, 0}}, {9, Colour{1, 1, 1}}};
        window.instance->animate("handle02", keys);
        CHECK(window.instance->changed("handle02") == kOfxStatOK);
        CHECK(window.in_use() == 1);
        CHECK(window.render() != window.edited());
        CHECK(window.instance->changed("resetHandles") == kOfxStatOK);
        CHECK(window.in_use() == 0);
        CHECK(window.instance->effect().params.params.at("handle02")->keys.empty());
        CHECK(window.colour("handle02") == (Colour{0.2, 0.7, 0.1}));
        CHECK(window.render() == window.edited());
        if (natron) continue;
        window.instance->undo();
        CHECK(window.in_use() == 1);
        CHECK(window.instance->effect().params.params.at("handle02")->keys == keys);
    }
}

TEST(a_display_palette_on_a_linear_graph) {
    std::string text = sidecar_text();
    text.replace(text.find("\"encoding\": \"linear\""), 20, "\"encoding\": \"sRGB\"");
    Window window(write("srgb.p4d.json", text));
    Instance& node = *window.instance;
    CHECK(node.text("status").find("expects the picture in sRGB\n") != std::string::npos);
    window.change("pictureIn", 2);
    CHECK(node.text("status").find("the picture in scene-linear light; the palette is in sRGB") !=
          std::string::npos);
    // The swatches show the palette's own colours.
    for (const auto& [name, own] :
         {std::pair("handle02", Vec3{0.2, 0.7, 0.1}), std::pair("handle17", Vec3{0.5, 0.5, 0.9})}) {
        for (std::size_t c = 0; c < 3; ++c) {
            CHECK(std::abs(node.swatch(name)[c] - own[c]) < 1e-12);
        }
    }
    // The picture is what the palette makes of it in sRGB.
    palette4d::Sidecar other = window.parsed;
    const auto compare = [&](const char* words) {
        Picture encoded(window.layout), output(window.layout);
        const OfxRectI& b = window.layout.bounds;
        for (int y = b.y1; y < b.y2; ++y) {
            for (int x = b.x1; x < b.x2; ++x) {
                for (int c = 0; c < 4; ++c) {
                    float& value = window.source.floats(x, y)[c];
                    value = 0.03f * static_cast<float>((3 * x + 7 * y + 5 * c) % 29) + 0.01f;
                    encoded.floats(x, y)[c] =
                        c < 3 ? static_cast<float>(srgb_of(static_cast<double>(value))) : value;
                }
            }
        }
        const auto expected = floats(window.layout, recoloured(other, 14, encoded, b));
        const auto found = floats(window.layout, window.render());
        double worst = 0;
        for (std::size_t i = 0; i < found.size(); ++i) {
            const double wanted = i % 4 < 3 ? linear_of(static_cast<double>(expected[i]))
                                            : static_cast<double>(expected[i]);
            worst = std::max(worst, std::abs(static_cast<double>(found[i]) - wanted));
        }
        EXPECT(worst < 1e-5, std::string(words) + ": off by " + std::to_string(worst));
    };
    compare("the sidecar's edit");
    CHECK(node.pick("handle03", {0.8, 0.3, 0.2}) == kOfxStatOK);
    other.edits.vertex_rgb[2] = Vec3{0.8, 0.3, 0.2};
    compare("a handle");
    // Of a log there is no such curve, and the user hears of it.
    text.replace(text.find("\"encoding\": \"sRGB\""), 18, "\"encoding\": \"ACEScct\"");
    node.set("sidecar", write("log.p4d.json", text));
    CHECK(window.render() == window.unchanged());
    const std::string& said = node.effect().persistent_message;
    EXPECT(said.find("found a palette in 'ACEScct'") != std::string::npos, said);
}

TEST(a_switch_and_its_colour_share_a_row) {
    Window window;
    for (const char* name : {"handle01On", "handle32On"}) {
        CHECK(window.instance->properties(name).number("OfxParamPropLayoutHint") == 2);
    }
    CHECK(window.instance->properties("handle01").number("OfxParamPropLayoutHint") == 0);
}
