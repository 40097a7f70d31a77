// The node's life in hosts as they are published to be.
#include <algorithm>

#include "harness.hpp"
#include "strict_imitations.hpp"

using namespace strict;
using namespace test;

namespace {

/// The host's time at which frame `frame` of the clip is shown.
double time_of(const Imitation& host, double frame) {
    if (host.config.frame_range.empty()) return frame - 10;
    // Times that are the clip's own numbers, or a timeline's.
    return host.config.frame_range[0] == 10 ? frame : host.config.frame_range[0] + frame - 10;
}

/// A picture, rendered as the host does it: in tiles or at once.
std::vector<unsigned char> render(Instance& node, const Imitation& host, double time,
                                  const Picture& source) {
    const Layout& layout = source.layout();
    const OfxRectI& b = layout.bounds;
    Picture output(layout);
    const int step = host.tile ? host.tile : 1 << 20;
    for (int y = b.y1; y < b.y2; y += step) {
        for (int x = b.x1; x < b.x2; x += step) {
            CHECK(node.render(time, &source, output,
                              rect(x, y, std::min(x + step, b.x2), std::min(y + step, b.y2))) ==
                  kOfxStatOK);
        }
    }
    return output.pixels(b);
}

struct Guest {
    Plugin plugin{bundle()};
    std::unique_ptr<Instance> node;
    const Imitation& host;
    std::string path = sidecar();
    palette4d::Sidecar parsed = palette4d::read_sidecar(path);

    explicit Guest(const Imitation& imitated) : host(imitated) { fresh(); }
    void fresh() {
        node = plugin.create(host.context);
        node->twice = true;
        set("sidecar", path);
    }
    void set(const std::string& name, Value value) {
        node->set(name, std::move(value));
        if (host.tells_changes) CHECK(node->changed(name) == kOfxStatOK);
    }
};

void in_every_host(void (*run)(Guest&)) {
    for (const Imitation& host : imitations()) {
        Host::get().configure(host.config);
        Guest guest(host);
        run(guest);
        for (const std::string& fault : Host::get().take_faults()) {
            EXPECT(false, host.name + ": " + fault);
        }
    }
}

}  // namespace

TEST(the_cores_bytes_in_every_host) {
    in_every_host([](Guest& guest) {
        for (const Layout& layout : guest.host.layouts) {
            Picture source(layout, 0x33);
            fill(source, 5);
            for (const double frame : {10.0, 13.0, 15.5, 20.0}) {
                if (guest.host.fresh_instances) guest.fresh();
                const auto found =
                    render(*guest.node, guest.host, time_of(guest.host, frame), source);
                EXPECT(found == recoloured(guest.parsed, frame, source, layout.bounds),
                       guest.host.name + ": frame " + std::to_string(frame));
                EXPECT(found != source.pixels(layout.bounds) || frame == 20.0, guest.host.name);
            }
        }
    });
}

TEST(handles_outputs_and_time_in_every_host) {
    in_every_host([](Guest& guest) {
        const Layout& layout = guest.host.layouts[0];
        Picture source(layout);
        fill(source, 6);
        const double time = time_of(guest.host, 14);
        guest.set("handle03", Colour{0.9, 0.2, 0.4});
        guest.set("handle03On", 1);
        palette4d::Sidecar other = guest.parsed;
        other.edits.vertex_rgb[2] = palette4d::Vec3{0.9, 0.2, 0.4};
        EXPECT(render(*guest.node, guest.host, time, source) ==
                   recoloured(other, 14, source, layout.bounds),
               guest.host.name);
        guest.set("inPoint", 1.5);
        EXPECT(render(*guest.node, guest.host, time, source) ==
                   recoloured(other, 15.5, source, layout.bounds),
               guest.host.name);
        for (const int output : {1, 2, 3}) {
            guest.set("output", output);
            EXPECT(render(*guest.node, guest.host, time, source) !=
                       recoloured(other, 15.5, source, layout.bounds),
                   guest.host.name);
        }
        guest.set("mix", 0.0);
        std::string clip;
        double at = 0;
        EXPECT(guest.node->is_identity(time, clip, at) == kOfxStatOK, guest.host.name);
    });
}

TEST(all_parameters_can_be_seen_where_secret_ones_stay_so) {
    // Nuke never shows what was described as secret: whatever a user needs must not be.
    for (const Imitation& host : imitations()) {
        if (!host.config.secret_stays) continue;
        Host::get().configure(host.config);
        Guest guest(host);
        std::vector<std::string> hidden;
        for (const std::string& name : guest.node->effect().params.order) {
            if (guest.node->properties(name).number(kOfxParamPropSecret) != 0) {
                hidden.push_back(name);
            }
        }
        // Slots without a handle, and what the node keeps for itself.
        CHECK(std::count(hidden.begin(), hidden.end(), "handle18") == 1);
        for (const std::string& name : hidden) {
            const bool surplus = name.substr(0, 6) == "handle" && std::stoi(name.substr(6)) >= 18;
            EXPECT(surplus || name == "embedded" || name == "revision", name + " is hidden");
        }
        // A slot that comes into use is shown again.
        guest.set("handle20Id", std::string("v3"));
        CHECK(guest.node->properties("handle20").number(kOfxParamPropSecret) == 0);
        CHECK(guest.node->properties("handle20").text(kOfxPropLabel) == "v3, frame 10");
    }
}

TEST(what_is_wrong_is_said_in_every_host) {
    in_every_host([](Guest& guest) {
        guest.set("sidecar", std::string("/nowhere/at.all"));
        const Layout& layout = guest.host.layouts[0];
        Picture source(layout);
        fill(source);
        EXPECT(render(*guest.node, guest.host, 3, source) == source.pixels(layout.bounds),
               guest.host.name);
        EXPECT(!guest.node->effect().messages.empty(), guest.host.name + ": no message");
        if (guest.host.tells_changes) {
            EXPECT(guest.node->text("status").find("does not exist") != std::string::npos,
                   guest.host.name);
        }
    });
}
