// Hosts that lack suites, functions and properties, or refuse any one call.
#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

const Layout& layout() {
    static const Layout value = [] {
        Layout l;
        l.bounds = rect(2, 3, 21, 40);
        return l;
    }();
    return value;
}

struct Pictures {
    std::string path = sidecar();
    Picture source{layout()};
    std::vector<unsigned char> edited, unchanged, black, untouched;
    Pictures() {
        fill(source);
        edited = recoloured(palette4d::read_sidecar(path), 13, source, layout().bounds);
        unchanged = source.pixels(layout().bounds);
        black = Picture(layout(), 0).pixels(layout().bounds);
        untouched = Picture(layout()).pixels(layout().bounds);
    }
};

/// The whole life of a node in the configured host. The pixels of its render; empty when the plugin
/// did not come as far. Status of the render in `status`.
std::vector<unsigned char> live(Plugin& plugin, const Pictures& pictures, OfxStatus& status,
                                std::vector<std::string>* messages = nullptr) {
    status = kOfxStatFailed;
    if (plugin.load() != kOfxStatOK) return {};
    const auto descriptor = plugin.describe(kOfxImageEffectContextFilter);
    if (!descriptor) return {};
    Instance instance(plugin, *descriptor, kOfxImageEffectContextFilter);
    if (instance.create() != kOfxStatOK) return {};
    instance.set("sidecar", pictures.path);
    instance.changed("sidecar");
    bool varying = false;
    instance.clip_preferences(varying);
    std::string clip;
    double time = 0;
    const OfxStatus identity = instance.is_identity(3, clip, time);
    CHECK(identity == kOfxStatOK || identity == kOfxStatReplyDefault);
    Picture output(layout());
    status = instance.render(3, &pictures.source, output, layout().bounds);
    instance.sync();
    if (messages) *messages = instance.effect().messages;
    const OfxStatus destroyed = instance.destroy();
    CHECK(destroyed == kOfxStatOK);
    CHECK(plugin.unload() == kOfxStatOK);
    return output.pixels(layout().bounds);
}

/// Says what is wrong with a picture that came out of a host that refused something.
std::string complaint(const Pictures& p, const std::vector<unsigned char>& pixels,
                      OfxStatus status) {
    if (pixels.empty()) return "";  // the host was told, and has no node
    if (pixels == p.edited || pixels == p.unchanged) return "";
    if (pixels == p.black) return "";  // no source was to be had
    if (pixels == p.untouched && status != kOfxStatOK) return "";
    return "the picture is neither edited, nor the source, nor black (status " +
           std::to_string(status) + ")";
}

}  // namespace

TEST(required_suites) {
    const Pictures pictures;
    for (const char* name : {kOfxPropertySuite, kOfxParameterSuite, kOfxImageEffectSuite}) {
        Config config;
        config.missing_suites = {std::string(name) + "/1"};
        Host::get().configure(config);
        Plugin plugin(bundle());
        CHECK(plugin.load() == kOfxStatErrMissingHostFeature);
    }
}

TEST(optional_suites) {
    const Pictures pictures;
    Plugin plugin(bundle());
    const std::string v1 = std::string(kOfxMessageSuite) + "/1";
    const std::string v2 = std::string(kOfxMessageSuite) + "/2";
    const std::string threads = std::string(kOfxMultiThreadSuite) + "/1";
    const std::string memory = std::string(kOfxMemorySuite) + "/1";
    for (const std::set<std::string>& missing : std::vector<std::set<std::string>>{
             {v1}, {v2}, {v1, v2}, {threads}, {v1, v2, threads, memory}}) {
        Config config;
        config.missing_suites = missing;
        Host::get().configure(config);
        OfxStatus status = kOfxStatFailed;
        CHECK(live(plugin, pictures, status) == pictures.edited);
        CHECK(status == kOfxStatOK);
    }
}

TEST(messages_find_a_way) {
    Pictures pictures;
    pictures.path = "/nowhere.p4d.json";
    Plugin plugin(bundle());
    const std::string v1 = std::string(kOfxMessageSuite) + "/1";
    const std::string v2 = std::string(kOfxMessageSuite) + "/2";
    struct Way {
        std::set<std::string> suites, functions;
        std::size_t messages;
    };
    for (const Way& way : {Way{{}, {}, 1}, Way{{v2}, {}, 1}, Way{{v1}, {}, 1},
                           Way{{}, {"setPersistentMessage", "clearPersistentMessage"}, 1},
                           Way{{v1}, {"setPersistentMessage"}, 1}, Way{{v1, v2}, {}, 0},
                           Way{{}, {"setPersistentMessage", "message"}, 0}}) {
        Config config;
        config.missing_suites = way.suites;
        config.null_functions = way.functions;
        Host::get().configure(config);
        OfxStatus status = kOfxStatFailed;
        std::vector<std::string> messages;
        CHECK(live(plugin, pictures, status, &messages) == pictures.unchanged);
        CHECK(status == kOfxStatOK);
        CHECK(messages.size() == way.messages);
    }
}

TEST(null_functions_one_by_one) {
    const Pictures pictures;
    Plugin plugin(bundle());
    for (const SuiteTable& table : {property_suite(), parameter_suite(), effect_suite(),
                                    thread_suite(), message_suite_v1(), message_suite_v2()}) {
        for (const auto& [function, offset] : table.functions) {
            Config config;
            config.null_functions = {function};
            config.incomplete = true;
            Host::get().configure(config);
            OfxStatus status = kOfxStatFailed;
            // A host without functions to define parameters has none to set: not the node's fault.
            if (function == "paramDefine") continue;
            const auto pixels = live(plugin, pictures, status);
            const std::string words = complaint(pictures, pixels, status);
            EXPECT(words.empty(), function + " is null: " + words);
        }
    }
}

TEST(every_property_refused_in_turn) {
    const Pictures pictures;
    Plugin plugin(bundle());
    OfxStatus status = kOfxStatFailed;
    Host::get().take_asked();
    CHECK(live(plugin, pictures, status) == pictures.edited);
    // All that the node asks for or sets in its life, and not a list that could fall behind.
    const std::set<std::string> names = Host::get().take_asked();
    figure(std::to_string(names.size()) + " properties refused, one a life");
    CHECK(names.size() > 50);
    for (const std::string& name : names) {
        Config config;
        config.missing_properties = {name};
        config.incomplete = true;
        Host::get().configure(config);
        const auto pixels = live(plugin, pictures, status);
        const std::string words = complaint(pictures, pixels, status);
        EXPECT(words.empty(), name + " is refused: " + words);
    }
    // These have a stand-in, or do not matter: the edit comes through.
    for (const char* name : {kOfxImageEffectPropRenderWindow, kOfxImageEffectPropPreMultiplication,
                             kOfxImageEffectPropPixelDepth, kOfxImageEffectPropComponents}) {
        Config config;
        config.missing_properties = {name};
        config.incomplete = true;
        Host::get().configure(config);
        const auto pixels = live(plugin, pictures, status);
        // Without any word on the format, also from the clip, there is nothing to go by.
        const bool format = name == std::string(kOfxImageEffectPropPixelDepth) ||
                            name == std::string(kOfxImageEffectPropComponents);
        CHECK(format ? status == kOfxStatFailed : pixels == pictures.edited);
    }
}

TEST(every_call_refused_in_turn) {
    const Pictures pictures;
    Plugin plugin(bundle());
    // Most of describing is 32 equal handles: steps of a prime meet every kind of call. The test
    // host.every_call refuses each one.
    CHECK(plugin.load() == kOfxStatOK);
    const long loaded = Host::get().calls();
    CHECK(plugin.describe(kOfxImageEffectContextFilter) != nullptr);
    const long described = Host::get().calls();
    long refused = 0, whole = 0;
    for (long n = 0;; n += n >= loaded + 100 && n < described - 100 ? every(29) : every(3)) {
        Config config;
        config.refused_call = n;
        config.processors =
            1 + static_cast<unsigned>(n % 3);  // with threads of the host and without
        Host::get().configure(config);
        OfxStatus status = kOfxStatFailed;
        const auto pixels = live(plugin, pictures, status);
        const std::string words = complaint(pictures, pixels, status);
        EXPECT(words.empty(), "call " + std::to_string(n) + " refused: " + words);
        whole += pixels == pictures.edited;
        if (!Host::get().refused()) break;
        ++refused;
    }
    figure(std::to_string(refused) + " calls refused, one a life; " + std::to_string(whole) +
           " pictures were whole nevertheless");
    // The life of a node takes more calls than this, and most of them are not essential.
    CHECK(refused > 100);
    CHECK(whole > refused / 2);
}

TEST(a_plugin_without_a_host) {
    Plugin plugin(bundle());
    // Before Load, and with a host that is nothing: refused, not a crash.
    CHECK(plugin.call(kOfxActionDescribe, nullptr, nullptr, nullptr) != kOfxStatOK);
    plugin.ofx().setHost(nullptr);
    CHECK(plugin.load() == kOfxStatOK);  // it remembers the real one
    CHECK(plugin.call(kOfxImageEffectActionRender, nullptr, nullptr, nullptr) == kOfxStatFailed);
}
