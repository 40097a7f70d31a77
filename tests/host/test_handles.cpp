// The palette's handles as parameters of the host.
#include <limits>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

struct Graded : Shown {
    Graded() { change("sidecar", path); }
    /// What the core makes of the sidecar with these edits.
    std::vector<unsigned char> expected(const palette4d::Edits& edits, double time) const {
        return edited(edits, 10 + time);
    }
    void use(const std::string& slot, const Colour& colour) {
        set(slot, colour);
        set(slot + "On", 1);
    }
};

bool secret(Instance& node, const std::string& param) {
    return node.properties(param).number(kOfxParamPropSecret) != 0;
}

}  // namespace

TEST(unused_handles_leave_the_sidecars_edits_alone) {
    Graded graded;
    // Whatever colour a host thinks up for a parameter that nobody set.
    for (const double level : {0.0, 1.0, 0.5, -7.0, std::numeric_limits<double>::quiet_NaN()}) {
        for (int slot = 1; slot <= 32; ++slot) {
            const std::string name = "handle" + std::string(slot < 10 ? "0" : "");
            graded.instance->set(name + std::to_string(slot), Colour{level, level, level});
        }
        CHECK(graded.render(3) == graded.expected(graded.parsed.edits, 3));
    }
}

TEST(a_handle_of_the_host_overrides_the_sidecars_edit) {
    Graded graded;
    palette4d::Edits edits = graded.parsed.edits;
    graded.use("handle02", {0.9, 0.1, 0.4});  // v1, which the sidecar edits too
    edits.vertex_rgb[1] = palette4d::Vec3{0.9, 0.1, 0.4};
    graded.use("handle17", {0.1, 0.2, 0.3});  // the sidecar's stop, after its 16 vertices
    edits.stops[0].rgb = {0.1, 0.2, 0.3};
    graded.use("handle05", {-0.5, 1.75, 0.25});
    edits.vertex_rgb[4] = palette4d::Vec3{-0.5, 1.75, 0.25};
    for (const double time : {0.0, 2.5, 5.0, 9.0}) {
        CHECK(graded.render(time) == graded.expected(edits, time));
        CHECK(graded.render(time) != graded.expected(graded.parsed.edits, time));
    }
    // Sidecar: as if nothing were set here.
    graded.instance->set("editsFrom", 0);
    CHECK(graded.render(5) == graded.expected(graded.parsed.edits, 5));
    // Host: what is set here alone; a stop that is not has gone.
    graded.instance->set("editsFrom", 1);
    palette4d::Edits alone;
    alone.vertex_rgb.resize(16);
    alone.vertex_rgb[1] = edits.vertex_rgb[1];
    alone.vertex_rgb[4] = edits.vertex_rgb[4];
    alone.stops = edits.stops;
    CHECK(graded.render(5) == graded.expected(alone, 5));
    graded.instance->set("handle17On", 0);
    alone.stops.clear();
    CHECK(graded.render(5) == graded.expected(alone, 5));
    // And with none in use there is nothing to do, and the host hears so.
    graded.instance->set("handle02On", 0);
    graded.instance->set("handle05On", 0);
    std::string clip;
    double time = 0;
    CHECK(graded.instance->is_identity(5, clip, time) == kOfxStatOK);
    CHECK(graded.render(5) == graded.unchanged());
}

TEST(keyframes_of_a_handle_are_read_at_the_time_of_the_render) {
    Graded graded;
    graded.use("handle01", {0, 0, 0});
    graded.instance->animate("handle01", {{0, Colour{0.1, 0.1, 0.1}}, {8, Colour{0.9, 0.5, 0.1}}});
    std::vector<unsigned char> before;
    for (const double time : {0.0, 2.0, 4.0, 6.5, 8.0, 9.0}) {
        const double w = std::min(time / 8, 1.0);
        palette4d::Edits edits = graded.parsed.edits;
        edits.vertex_rgb[0] = palette4d::Vec3{(1 - w) * 0.1 + w * 0.9, (1 - w) * 0.1 + w * 0.5,
                                              (1 - w) * 0.1 + w * 0.1};
        CHECK(graded.render(time) == graded.expected(edits, time));
        // Nothing that was prepared for another time or another colour is shown.
        CHECK(graded.render(time) != before);
        before = graded.render(time);
    }
}

TEST(one_sidecar_two_instances_two_grades) {
    Graded graded;
    const auto other = graded.plugin.create();
    other->set("sidecar", graded.path);
    other->set("handle03", Colour{1, 0, 1});
    other->set("handle03On", 1);
    palette4d::Edits edits = graded.parsed.edits;
    edits.vertex_rgb[2] = palette4d::Vec3{1, 0, 1};
    for (int round = 0; round < 3; ++round) {
        CHECK(graded.render(*other) == graded.expected(edits, 2));
        CHECK(graded.render(2) == graded.expected(graded.parsed.edits, 2));
    }
}

TEST(handles_show_what_the_sidecar_holds) {
    Graded graded;
    Instance& node = *graded.instance;
    CHECK(node.properties("handle01").text(kOfxPropLabel) == "v0, frame 10");
    CHECK(node.properties("handle16").text(kOfxPropLabel) == "v15, frame 20");
    CHECK(node.properties("handle17").text(kOfxPropLabel) == "s1, stop at 15");
    for (const char* name : {"handle01", "handle17On", "handle09Id"}) CHECK(!secret(node, name));
    for (const char* name : {"handle18", "handle18On", "handle32Id"}) CHECK(secret(node, name));
    // They begin from the colours that they have: the palette's, or the sidecar's edit.
    CHECK(std::get<Colour>(node.value("handle01")) == (Colour{0.1, 0.1, 0.1}));
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.2, 0.7, 0.1}));
    CHECK(std::get<Colour>(node.value("handle17")) == (Colour{0.5, 0.5, 0.9}));
    CHECK(std::get<int>(node.value("handle02On")) == 0);
    // An edit on the command line moves those that are not in use.
    graded.use("handle01", {0.3, 0.3, 0.3});
    write("clip.p4d.json", sidecar_text(false));
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(std::get<Colour>(node.value("handle01")) == (Colour{0.3, 0.3, 0.3}));
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.9, 0.1, 0.1}));
    CHECK(secret(node, "handle17"));
    CHECK(node.text("status").find("0 edits, 1 handle in use here") != std::string::npos);
    // Again, nothing is new: nothing is set.
    const int before = node.settings("handle02");
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.settings("handle02") == before);
    // Without a sidecar nothing is lost.
    graded.change("sidecar", std::string());
    CHECK(std::get<int>(node.value("handle01On")) == 1);
}

TEST(labels_have_the_names_of_the_colours_where_the_sidecar_has_them) {
    Graded graded;
    std::string text = sidecar_text(true);
    const std::string id = "\"id\": \"v0\"";
    const std::size_t at = text.find(id);
    CHECK(at != std::string::npos);
    text.replace(at, id.size(), id + ", \"name\": \"deep grey\"");
    graded.change("sidecar", write("named.p4d.json", text));
    Instance& node = *graded.instance;
    CHECK(node.properties("handle01").text(kOfxPropLabel) == "v0: deep grey, 10");
    CHECK(node.properties("handle16").text(kOfxPropLabel) == "v15, frame 20");
}

TEST(without_a_sidecar_the_slots_are_as_they_were_described) {
    Graded graded;
    Instance& node = *graded.instance;
    const auto shows_handles = [&] {
        return secret(node, "handle18") &&
               node.properties("handle01").text(kOfxPropLabel) == "v0, frame 10";
    };
    const std::string path = node.text("sidecar");
    // One that cannot be read leaves all as it is: it may come back.
    graded.change("sidecar", std::string("/nowhere/at.all"));
    CHECK(shows_handles());
    graded.change("sidecar", std::string());
    CHECK(node.properties("handle01").text(kOfxPropLabel) == "Handle 1");
    for (const char* name : {"handle01", "handle18", "handle32On"}) CHECK(!secret(node, name));
    graded.change("sidecar", path);
    CHECK(shows_handles());
}

TEST(changing_a_colour_brings_it_into_use) {
    Graded graded;
    Instance& node = *graded.instance;
    node.set("handle02", Colour{1, 1, 0});
    // The host's own interpolation of keys is no edit, nor is the plugin's own setting.
    CHECK(node.changed(kOfxTypeParameter, "handle02", kOfxChangeTime) == kOfxStatOK);
    CHECK(std::get<int>(node.value("handle02On")) == 0);
    graded.change("handle02", Colour{1, 1, 0});
    CHECK(std::get<int>(node.value("handle02On")) == 1);
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{1, 1, 0}));
    // It holds on to its handle from now on.
    CHECK(node.text("handle02Id") == "v1");
    palette4d::Edits edits = graded.parsed.edits;
    edits.vertex_rgb[1] = palette4d::Vec3{1, 1, 0};
    CHECK(graded.render(1) == graded.expected(edits, 1));
    // Out of use it keeps its colour, and is back with it when it is switched on again.
    graded.change("handle02On", 0);
    CHECK(graded.render(1) == graded.expected(graded.parsed.edits, 1));
    graded.change("handle02On", 1);
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{1, 1, 0}));
    CHECK(graded.render(1) == graded.expected(edits, 1));
    // All of them.
    graded.use("handle02", {1, 1, 0});
    graded.use("handle03", {1, 1, 0});
    CHECK(node.changed("resetHandles") == kOfxStatOK);
    CHECK(std::get<int>(node.value("handle03On")) == 0);
    CHECK(node.text("handle02Id").empty());
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.2, 0.7, 0.1}));
    CHECK(graded.render(1) == graded.expected(graded.parsed.edits, 1));
}

TEST(the_same_colour_after_a_reset_is_an_edit_again) {
    Graded graded;
    Instance& node = *graded.instance;
    for (int turn = 0; turn < 3; ++turn) {
        node.set("handle02", Colour{1, 1, 0});
        CHECK(node.changed("handle02") == kOfxStatOK);
        CHECK(std::get<int>(node.value("handle02On")) == 1);
        palette4d::Edits edits = graded.parsed.edits;
        edits.vertex_rgb[1] = palette4d::Vec3{1, 1, 0};
        CHECK(graded.render(1) == graded.expected(edits, 1));
        CHECK(node.changed("resetHandles") == kOfxStatOK);
        CHECK(graded.render(1) == graded.expected(graded.parsed.edits, 1));
    }
}

TEST(colours_that_change_together_are_all_kept) {
    Graded graded;
    Instance& node = *graded.instance;
    // A preset, or several values pasted: all are there before the first is told.
    node.set("handle02", Colour{1, 1, 0});
    node.set("handle03", Colour{0, 1, 1});
    for (const char* name : {"strength", "handle02", "handle03"}) {
        CHECK(node.changed(name) == kOfxStatOK);
    }
    palette4d::Edits edits = graded.parsed.edits;
    edits.vertex_rgb[1] = palette4d::Vec3{1, 1, 0};
    edits.vertex_rgb[2] = palette4d::Vec3{0, 1, 1};
    CHECK(graded.render(1) == graded.expected(edits, 1));
}

TEST(an_edit_that_the_host_undoes_is_undone) {
    Graded graded;
    Instance& node = *graded.instance;
    const Colour before = std::get<Colour>(node.value("handle02"));
    graded.change("handle02", Colour{1, 1, 0});
    // With it what the node has set, as hosts keep them together.
    node.set("handle02", before);
    node.set("handle02On", 0);
    node.set("handle02Id", std::string());
    for (const char* name : {"handle02Id", "handle02On", "handle02"}) {
        CHECK(node.changed(name) == kOfxStatOK);
    }
    CHECK(std::get<int>(node.value("handle02On")) == 0);
    CHECK(graded.render(1) == graded.expected(graded.parsed.edits, 1));
}

TEST(what_the_node_sets_is_undone_in_one_step) {
    Graded graded;
    Instance& node = *graded.instance;
    // Choosing the sidecar has given colours to its 17 handles, and the clip's folder.
    CHECK(node.undo_steps().size() == 1 && node.undo_steps()[0].before.size() == 18);
    // What is as it should be already is no step.
    const int folders = node.settings("clipFolder");
    graded.change("sidecar", graded.path);
    CHECK(node.settings("clipFolder") == folders && node.undo_steps().size() == 1);
    // To say which frame is shown is no step.
    node.shown_time = 3;
    CHECK(node.changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.undo_steps().size() == 1);
    const palette4d::Edits before = graded.parsed.edits;
    graded.change("handle02", Colour{1, 1, 0});
    graded.change("handle03", Colour{1, 0, 1});
    CHECK(node.undo_steps().size() == 3 && node.undo_steps()[2].before.size() == 2);
    CHECK(node.changed("resetHandles") == kOfxStatOK);
    CHECK(node.undo_steps().size() == 4);
    CHECK(graded.render(1) == graded.expected(before, 1));
    const auto again = node.undo();
    palette4d::Edits edits = before;
    edits.vertex_rgb[1] = palette4d::Vec3{1, 1, 0};
    edits.vertex_rgb[2] = palette4d::Vec3{1, 0, 1};
    CHECK(graded.render(1) == graded.expected(edits, 1));
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{1, 1, 0}));
    node.put_back(again);
    CHECK(graded.render(1) == graded.expected(before, 1));
    for (const UndoStep& step : node.undo_steps()) CHECK(!step.label.empty());
}

TEST(colours_that_the_host_takes_back_are_no_edits) {
    Graded graded;
    Instance& node = *graded.instance;
    const Colour begun = std::get<Colour>(node.value("handle02"));
    const auto none_in_use = [&] {
        for (const char* use : {"handle01On", "handle02On", "handle17On"}) {
            CHECK(std::get<int>(node.value(use)) == 0);
        }
        return graded.render(3) == graded.expected(graded.parsed.edits, 3);
    };
    const auto again = node.undo();
    CHECK(none_in_use());
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.5, 0.5, 0.501}));
    // They are not set again, which would be a step that nobody could get behind.
    CHECK(node.changed("strength") == kOfxStatOK);
    CHECK(node.undo_steps().empty());
    // Done again, and undone again.
    const auto undone = node.put_back(again);
    CHECK(none_in_use());
    CHECK(std::get<Colour>(node.value("handle02")) == begun);
    node.put_back(undone);
    CHECK(none_in_use());
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.5, 0.5, 0.501}));
    CHECK(node.undo_steps().empty());
    // Another sidecar is followed as ever.
    write("clip.p4d.json", sidecar_text(false));
    CHECK(node.changed("reload") == kOfxStatOK);
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.9, 0.1, 0.1}));
    CHECK(node.undo_steps().size() == 1);
    // One of them alone is an edit, of the colour that it had before, too.
    graded.change("handle03", Colour{0, 0, 0});
    CHECK(std::get<int>(node.value("handle03On")) == 1);
}

TEST(colours_that_were_given_later_are_taken_back_by_themselves) {
    Graded graded;
    Instance& node = *graded.instance;
    write("clip.p4d.json", sidecar_text(false));
    CHECK(node.changed("reload") == kOfxStatOK);
    CHECK(node.undo_steps().size() == 2);
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.9, 0.1, 0.1}));
    node.undo();
    CHECK(std::get<Colour>(node.value("handle02")) == (Colour{0.2, 0.7, 0.1}));
    for (const char* use : {"handle01On", "handle02On"}) {
        CHECK(std::get<int>(node.value(use)) == 0);
    }
}

TEST(keyframes_that_begin_with_the_colour_shown_are_an_edit) {
    Graded graded;
    Instance& node = *graded.instance;
    node.animate("handle02", {{0.0, Colour{0.2, 0.7, 0.1}}, {8.0, Colour{1, 1, 1}}});
    CHECK(node.changed("handle02") == kOfxStatOK);
    CHECK(std::get<int>(node.value("handle02On")) == 1);
}

TEST(a_host_without_undo_steps_has_the_same_node) {
    const OfxStatus answers[] = {kOfxStatErrUnsupported, kOfxStatReplyDefault, kOfxStatFailed,
                                 kOfxStatErrMissingHostFeature};
    std::vector<Config> configs;
    for (const OfxStatus answer : answers) {
        configs.emplace_back();
        configs.back().edit_answer = answer;
    }
    for (const char* function : {"paramEditBegin", "paramEditEnd"}) {
        configs.emplace_back();
        configs.back().null_functions = {function};
    }
    for (const Config& config : configs) {
        Host::get().configure(config);
        Graded graded;
        CHECK(std::get<Colour>(graded.instance->value("handle02")) == (Colour{0.2, 0.7, 0.1}));
        graded.change("handle02", Colour{1, 1, 0});
        CHECK(std::get<int>(graded.instance->value("handle02On")) == 1);
        CHECK(graded.instance->undo_steps().empty());
    }
}

TEST(a_project_that_is_opened_keeps_colours_out_of_use) {
    Graded graded;
    const auto opened = graded.plugin.create();
    opened->set("sidecar", graded.path);
    // As it was saved: one that was in use before, and one that never was.
    opened->set("handle02", Colour{1, 1, 0});
    opened->set("handle02Id", std::string("v1"));
    opened->set("handle03", Colour{0.3, 0.3, 0.3});
    CHECK(opened->changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(std::get<Colour>(opened->value("handle02")) == (Colour{1, 1, 0}));
    CHECK(std::get<Colour>(opened->value("handle03")) != (Colour{0.3, 0.3, 0.3}));
}

TEST(keyframes_of_a_handle_out_of_use_are_kept) {
    Graded graded;
    graded.instance->animate("handle04", {{0, Colour{0, 0, 0}}, {9, Colour{1, 1, 1}}});
    const int before = graded.instance->settings("handle04");
    write("clip.p4d.json", sidecar_text(false));
    CHECK(graded.instance->changed("strength") == kOfxStatOK);
    CHECK(graded.instance->settings("handle04") == before);
}

TEST(a_slot_may_name_any_handle) {
    Graded graded;
    Instance& node = *graded.instance;
    graded.change("handle30Id", std::string("v11"));
    CHECK(node.properties("handle30").text(kOfxPropLabel) == "v11, frame 20");
    CHECK(!secret(node, "handle30"));
    graded.use("handle30", {0.4, 0.5, 0.6});
    palette4d::Edits edits = graded.parsed.edits;
    edits.vertex_rgb[11] = palette4d::Vec3{0.4, 0.5, 0.6};
    CHECK(graded.render(8) == graded.expected(edits, 8));
    // Two slots for one handle: the last counts.
    node.set("handle31Id", std::string("v11"));
    graded.use("handle31", {0.7, 0.1, 0.1});
    edits.vertex_rgb[11] = palette4d::Vec3{0.7, 0.1, 0.1};
    CHECK(graded.render(8) == graded.expected(edits, 8));
    // One that is not there: the rest of the grade holds, and a message says so.
    node.set("handle31Id", std::string("v99"));
    edits.vertex_rgb[11] = palette4d::Vec3{0.4, 0.5, 0.6};
    CHECK(graded.render(8) == graded.expected(edits, 8));
    CHECK(node.effect().persistent_message.find("'v99'") != std::string::npos);
    node.set("handle31On", 0);
    CHECK(graded.render(8) == graded.expected(edits, 8));
    CHECK(node.effect().persistent_message.empty());
}

TEST(colours_that_are_none_are_left_out) {
    Graded graded;
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double odd : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity, 1e30}) {
        graded.use("handle01", {0.5, odd, 0.5});
        CHECK(graded.render(2) == graded.expected(graded.parsed.edits, 2));
    }
}
