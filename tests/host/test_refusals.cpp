// A colourist's day in a host that refuses one call in it: every call of every action, in turn.
#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

struct Day {
    Plugin plugin{bundle()};
    Layout layout = [] {
        Layout l;
        l.bounds = rect(-3, 2, 9, 12);
        l.premultiplication = kOfxImagePreMultiplied;
        return l;
    }();
    Picture source{layout};
    std::string path = sidecar(), other = sidecar("other.p4d.json", false);
    std::vector<unsigned char> edited;
    std::unique_ptr<OfxImageEffectStruct> descriptor;
    std::unique_ptr<Instance> node;

    Day() {
        fill(source);
        edited = recoloured(palette4d::read_sidecar(path), 13, source, layout.bounds);
        CHECK(plugin.load() == kOfxStatOK);
        descriptor = plugin.describe(kOfxImageEffectContextFilter);
        CHECK(descriptor != nullptr);
    }

    /// A node whose making the host does not disturb.
    void open() {
        Host::get().configure({});
        node = std::make_unique<Instance>(plugin, *descriptor, kOfxImageEffectContextFilter);
        CHECK(node->create() == kOfxStatOK);
    }

    void change(const char* name, Value value) {
        node->set(name, std::move(value));
        CHECK(node->changed(name) == kOfxStatOK);
    }

    /// What a render puts out; whatever is refused, it fails with a picture or does not fail.
    std::vector<unsigned char> render() {
        Picture output(layout);
        const OfxStatus status = node->render(3, &source, output, layout.bounds);
        CHECK(status == kOfxStatOK || status == kOfxStatFailed);
        return output.pixels(layout.bounds);
    }

    void look() {
        bool varying = false;
        node->clip_preferences(varying);
        std::string clip;
        double time = 0;
        node->is_identity(3, clip, time);
        render();
    }

    /// Sidecar, handles, outputs, modes, embedding, another file, none at all.
    void live() {
        change("sidecar", path);
        node->shown_time = 3;
        CHECK(node->changed("", "", kOfxChangeTime) == kOfxStatOK);
        change("handle03", Colour{0.9, 0.2, 0.4});
        change("handle20Id", std::string("v3"));
        for (const int output : {1, 2, 3, 0}) {
            change("output", output);
            look();
        }
        node->set("matteIn", 1);
        node->set("output", 3);
        look();
        node->set("output", 0);
        node->set("keepLightness", 0.5);
        look();
        change("embed", 1);
        change("sidecar", other);
        CHECK(node->changed("reload") == kOfxStatOK);
        node->animate("handle03", {{0, Colour{0, 0, 0}}, {9, Colour{1, 1, 1}}});
        CHECK(node->changed("resetHandles") == kOfxStatOK);
        change("sidecar", std::string("/nowhere.p4d.json"));
        look();
        std::string space;
        node->output_colourspace(space);
    }

    /// The host sets all back, and refuses nothing any more: nothing may have stayed behind.
    std::vector<unsigned char> after() {
        Host::get().configure({});
        for (const char* name : {"matteIn", "output", "embed", "handle03On"}) {
            node->set(name, 0);
        }
        node->set("keepLightness", 0.0);
        node->set("sidecar", path);
        return render();
    }
};

}  // namespace

TEST(every_call_of_a_day_refused_in_turn) {
    Day day;
    day.open();
    Host::get().configure({});
    day.live();
    const long calls = Host::get().calls();
    CHECK(day.after() == day.edited);
    // Labelling 32 slots alike is most of it: steps of a prime meet every kind of call.
    CHECK(calls > 1000);
    long refused = 0;
    for (long n = 0; n < calls; n += every(37)) {
        day.open();
        Config config;
        config.refused_call = n;
        Host::get().configure(config);
        day.live();
        refused += Host::get().refused();
        EXPECT(day.after() == day.edited, "call " + std::to_string(n) + " refused, and then");
        CHECK(day.node->destroy() == kOfxStatOK);
    }
    figure(std::to_string(refused) + " of " + std::to_string(calls) +
           " calls of a day refused, one a day");
    CHECK(refused > calls / (every(37) + 1));
}
