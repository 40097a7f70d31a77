// DaVinci Resolve tells the media's file and frame: which sidecar and which frame, without a path.
// Each test answers a complaint that users have about nodes that read a file for a clip.
#include <map>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "OfxImageEffectPropSrcFilePath";
constexpr const char* kFrame = "OfxImageEffectPropSrcFrame";

/// A sidecar of frames 10 to 20 of `source`, as the analysis writes it.
std::string text_of(const std::string& source, bool edited = true) {
    std::string text = sidecar_text(edited);
    const std::string own = "box.####.exr";
    return text.replace(text.find(own), own.size(), source);
}

struct Page : Shown {
    std::unique_ptr<Instance> clip(const std::string& media) {
        auto node = plugin.create();
        node->effect().properties.put(kFile, media);
        return node;
    }
    std::vector<unsigned char> render(Instance& node, double time, Value frame) {
        node.extra_arguments = {{kFrame, frame}};
        return Shown::render(node, time);
    }
    std::vector<unsigned char> at(double frame, bool edited = true) const {
        palette4d::Sidecar other = palette4d::parse_sidecar(sidecar_text(edited), "");
        return recoloured(other, frame, source, layout.bounds);
    }
};

}  // namespace

TEST(one_node_copied_to_fifty_clips_finds_fifty_sidecars) {
    Page page;
    const auto first = page.clip((folder() / "shot00.mov").u8string());
    for (int i = 0; i < 50; ++i) {
        const std::string name = "shot" + std::string(i < 10 ? "0" : "") + std::to_string(i);
        write(name + ".p4d.json", text_of(name + ".mov", i % 2 == 0));
        // The copy has the first node's parameters and its own clip.
        const auto copy = page.clip((folder() / (name + ".mov")).u8string());
        for (const std::string& param : first->effect().params.order) {
            copy->set(param, first->value(param));
        }
        EXPECT(page.render(*copy, 12, 12) == page.at(12, i % 2 == 0), name);
        CHECK(copy->changed("", "", kOfxChangeTime) == kOfxStatOK);
        EXPECT(copy->text("status").find(i % 2 ? "0 edits" : "3 edits") != std::string::npos,
               copy->text("status"));
        CHECK(copy->text("sidecar").empty());
    }
}

TEST(where_a_sidecar_of_the_clips_name_is_searched) {
    Page page;
    fs::create_directories(folder() / "media");
    const auto node = page.clip((folder() / "media" / "box.1010.exr").u8string());
    CHECK(page.render(*node, 0, 2) == page.unchanged());
    CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(node->text("status").find("box.1010.exr") != std::string::npos);
    // A sequence's number is no part of its name; in Clip's folder; then beside the media.
    fs::create_directories(folder() / "sidecars");
    write("sidecars/box.p4d.json", text_of("box.####.exr", false));
    node->set("clipFolder", (folder() / "sidecars").u8string());
    CHECK(node->changed("clipFolder") == kOfxStatOK);
    CHECK(node->text("status").find("0 edits") != std::string::npos);
    write("media/box.p4d.json", text_of("box.####.exr"));
    CHECK(node->changed("reload") == kOfxStatOK);
    CHECK(node->text("status").find("3 edits") != std::string::npos);
    // The user's choice wins, and may be not to search.
    node->set("sidecar", (folder() / "sidecars" / "box.p4d.json").u8string());
    CHECK(page.render(*node, 0, 2) == page.unchanged());
    node->set("sidecar", std::string());
    CHECK(page.render(*node, 0, 2) != page.unchanged());
    node->set("findByName", 0);
    CHECK(page.render(*node, 0, 2) == page.unchanged());
    // A movie's number is part of its name.
    write("media/take.p4d.json", text_of("take.mov"));
    const auto movie = page.clip((folder() / "media" / "take.001.mov").u8string());
    CHECK(page.render(*movie, 12, 12) == page.unchanged());
}

TEST(shots_are_found_by_the_names_that_the_analysis_gives_them) {
    Page page;
    for (const auto& [clip, shot] : {std::pair("sh 010.mov", "sh_010"),
                                     {"Gr\u00fcn + Rot.mov", "Gr\u00fcn_Rot"},
                                     {"\u65e5\u672c.1001.exr", "\u65e5\u672c"}}) {
        const auto node = page.clip((folder() / fs::u8path(clip)).u8string());
        CHECK(page.render(*node, 12, 12) == page.unchanged());
        write(std::string(shot) + ".p4d.json", text_of(clip));
        CHECK(node->changed("reload") == kOfxStatOK);
        EXPECT(node->text("status").find("3 edits") != std::string::npos, node->text("status"));
    }
}

TEST(a_grade_that_was_copied_to_another_clip_says_so) {
    Page page;
    const std::string path = write("a.p4d.json", text_of("a.mov"));
    const auto node = page.clip("/media/b.mov");
    node->set("sidecar", path);
    CHECK(node->changed("sidecar") == kOfxStatOK);
    CHECK(page.render(*node, 12, 12) == page.at(12));
    const std::string status = node->text("status");
    EXPECT(status.find("this sidecar is of a.mov, and the host's clip is /media/b.mov") !=
               std::string::npos,
           status);
    node->effect().properties.put(kFile, std::string("/elsewhere/a.mxf"));
    CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
    CHECK(node->text("status").find("this sidecar is of") == std::string::npos);
}

TEST(an_embedded_copy_outlives_a_restart_and_stays_with_its_clip) {
    Page page;
    const std::string media = (folder() / "a.mov").u8string();
    const std::string path = write("a.p4d.json", text_of("a.mov"));
    const auto node = page.clip(media);
    node->set("embed", 1);
    CHECK(node->changed("embed") == kOfxStatOK);
    CHECK(node->text("embedded") == text_of("a.mov"));
    std::map<std::string, Value> saved;
    for (const std::string& param : node->effect().params.order) saved[param] = node->value(param);
    node->destroy();
    fs::remove(fs::u8path(path));
    CHECK(page.plugin.unload() == kOfxStatOK);
    CHECK(page.plugin.load() == kOfxStatOK);
    for (const bool same : {true, false}) {
        const auto again = page.clip(same ? media : (folder() / "b.mov").u8string());
        for (const auto& [param, value] : saved) again->set(param, value);
        CHECK(page.render(*again, 12, 12) == (same ? page.at(12) : page.unchanged()));
        CHECK(again->changed("", "", kOfxChangeTime) == kOfxStatOK);
        CHECK(again->text("embedded") == text_of("a.mov"));
    }
}

TEST(trims_compounds_and_retimes_show_the_medias_frame) {
    Page page;
    // On the Edit and Color pages the time is the media's frame, whatever the trim; in a compound
    // clip, or retimed, it is not.
    for (const double time : {2.0, 86400.0, -7.5}) {
        write("box.p4d.json", text_of("box.####.exr"));
        const auto sequence = page.clip((folder() / "box.0005.exr").u8string());
        sequence->effect().clips.at("Source")->properties.put_all(kOfxImageEffectPropFrameRange,
                                                                  {0.0, 500.0});
        CHECK(page.render(*sequence, time, 7) == page.at(12));
        sequence->shown_time = time;
        CHECK(sequence->changed("", "", kOfxChangeTime) == kOfxStatOK);
        CHECK(sequence->text("status").find("is frame 12") != std::string::npos);
        // Resolve's own way to name all of a sequence.
        sequence->effect().properties.put(kFile, (folder() / "box.[0005-0100].exr").u8string());
        CHECK(page.render(*sequence, time, 9) == page.at(14));
        write("take.p4d.json", text_of("take.mov"));
        const auto movie = page.clip((folder() / "take.mov").u8string());
        CHECK(page.render(*movie, time, 13) == page.at(13));
        // What the user sets goes on top, and Manual goes by the host's time.
        movie->set("inPoint", 2.0);
        CHECK(page.render(*movie, time, 13) == page.at(15));
        movie->set("inPoint", 0.0);
        movie->set("timing", 1);
        movie->set("firstFrame", time);
        CHECK(page.render(*movie, time + 4, 13) == page.at(14));
        std::string clip;
        double at = 0;
        CHECK(movie->is_identity(time, clip, at) == kOfxStatReplyDefault);
    }
}

TEST(the_status_has_the_frame_of_a_host_that_tells_the_file_alone) {
    Page page;
    write("box.p4d.json", text_of("box.####.exr"));
    const auto node = page.clip((folder() / "box.0005.exr").u8string());
    node->effect().clips.at("Source")->properties.put_all(kOfxImageEffectPropFrameRange,
                                                          {0.0, 500.0});
    Picture output(page.layout);
    CHECK(node->render(2, &page.source, output, page.layout.bounds) == kOfxStatOK);
    CHECK(output.pixels(page.layout.bounds) == page.at(12));
    node->shown_time = 2;
    CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
    EXPECT(node->text("status").find("is frame 12") != std::string::npos, node->text("status"));
}

TEST(properties_that_are_absent_or_wrong_are_ignored) {
    Page page;
    write("box.p4d.json", text_of("box.####.exr"));
    const std::string path = (folder() / "box.p4d.json").u8string();
    const Value files[] = {
        std::string(), std::string("/"), std::string("nowhere"), std::string("\xff\xfe"), 7, 0.5};
    for (const Value& file : files) {
        const auto node = page.plugin.create();
        node->effect().properties.put(kFile, file);
        CHECK(page.render(*node, 2, 2) == page.unchanged());
        node->set("sidecar", path);
        for (const Value& frame : {Value(-1), Value(std::string("2")), Value(2.0)}) {
            CHECK(page.render(*node, 2, frame) == page.at(12));
        }
        node->extra_arguments.clear();
        Picture output(page.layout);
        CHECK(node->render(2, &page.source, output, page.layout.bounds) == kOfxStatOK);
        CHECK(output.pixels(page.layout.bounds) == page.at(12));
    }
}
