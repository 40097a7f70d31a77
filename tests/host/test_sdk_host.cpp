// The node in a host made of the OpenFX project's own host library: another reading of the standard
// than the strict host's. Built where OPENFX_ROOT has that library.
//
//     test_sdk_host SIDECAR       OFX_PLUGIN_PATH: where the bundle is; the sidecar must be edited
#include <filesystem>
#include <memory>

#include "model/handles.hpp"
#include "model/ramps.hpp"
#include "recolour/recolour.hpp"
#include "sdk_host.hpp"
#include "sidecar/sidecar.hpp"

using namespace sdk_host;

namespace {

// ---------------------------------------------------------------- properties that are not there

const OfxPropertySuiteV1* g_properties = nullptr;
const void* (*g_fetch)(OfxPropertySetHandle, const char*, int) = nullptr;
std::set<std::string> g_refused;

OfxStatus noted(const char* name, OfxStatus status) {
    if (status != kOfxStatOK) g_refused.insert(name);
    return status;
}

const void* fetch_suite(OfxPropertySetHandle host, const char* name, int version) {
    static OfxPropertySuiteV1 watched;
    const void* suite = g_fetch(host, name, version);
    if (!suite || std::strcmp(name, kOfxPropertySuite) != 0) return suite;
    g_properties = static_cast<const OfxPropertySuiteV1*>(suite);
    watched = *g_properties;
    watched.propSetInt = [](OfxPropertySetHandle s, const char* n, int i, int v) {
        return noted(n, g_properties->propSetInt(s, n, i, v));
    };
    watched.propSetDouble = [](OfxPropertySetHandle s, const char* n, int i, double v) {
        return noted(n, g_properties->propSetDouble(s, n, i, v));
    };
    watched.propSetString = [](OfxPropertySetHandle s, const char* n, int i, const char* v) {
        return noted(n, g_properties->propSetString(s, n, i, v));
    };
    return &watched;
}

// ---------------------------------------------------------------- what the node should do

std::vector<float> recoloured(const palette4d::Sidecar& sidecar, const palette4d::Edits& edits,
                              double frame) {
    palette4d::Slice slice = palette4d::slice_at(sidecar.polytope, frame);
    const auto edited = palette4d::edited_colours(sidecar.polytope, edits, slice);
    const palette4d::Recolourer recolourer(slice.rgb, edited, slice.faces,
                                           palette4d::picks_at(edits, slice.frame));
    std::vector<float> pixels = source_pixels();
    recolourer.apply({pixels.data(), kWidth, kHeight, 4, kWidth * 16},
                     {pixels.data(), kWidth, kHeight, 4, kWidth * 16}, {});
    return pixels;
}

void live(sdk::ImageEffect::ImageEffectPlugin& plugin, const std::string& context,
          const std::filesystem::path& given) {
    const std::unique_ptr<Effect> node(
        dynamic_cast<Effect*>(plugin.createInstance(context, nullptr)));
    EXPECT(node && node->createInstanceAction() == kOfxStatOK && node->getClipPreferences());
    if (!node) return;
    EXPECT(node->isFrameVarying() && node->identity(3) && node->rendered(3) == source_pixels());

    // A file of its own, which will go.
    const std::filesystem::path path = std::filesystem::absolute("test_sdk_host.p4d.json");
    std::filesystem::copy_file(given, path, std::filesystem::copy_options::overwrite_existing);
    const palette4d::Sidecar sidecar = palette4d::read_sidecar(path.string());
    EXPECT(node->change<Text>("sidecar", path.string()));
    EXPECT(node->steps == 1);  // all colours of its handles
    const auto status = [&] { return node->param<Text>("status").value; };
    EXPECT(status().find("time 0 is frame 0") != std::string::npos);
    const auto handles = palette4d::handles_of(sidecar.polytope, sidecar.edits);
    EXPECT(node->getParam("handle01")
               ->getProperties()
               .getStringProperty(kOfxPropLabel)
               .rfind(handles[0].id, 0) == 0);
    EXPECT(node->getParam("handle32")->getProperties().getIntProperty(kOfxParamPropSecret) == 1);
    for (const double time : {0.0, 4.5, 12.0, 20.0}) {
        const auto wanted = recoloured(sidecar, sidecar.edits, time);
        EXPECT(node->rendered(time) == wanted && node->rendered(time, 16) == wanted);
    }
    EXPECT(recoloured(sidecar, sidecar.edits, 4.5) != source_pixels() && !node->identity(4.5));

    EXPECT(!node->change<Number>("strength", 0.0) && node->identity(4.5));
    node->change<Number>("strength", 1.0);
    EXPECT(node->steps == 1);
    // A colour of the host's own switches its handle on.
    node->param<Colour>("handle02").rgb = {0.2, 0.9, 0.6};
    EXPECT(!node->changed("handle02") && node->param<Flag>("handle02On").value);
    EXPECT(node->steps == 2);
    const palette4d::Edits graded =
        palette4d::with_colours(sidecar.polytope, sidecar.edits, true, {{1, {0.2, 0.9, 0.6}}});
    EXPECT(node->rendered(3) == recoloured(sidecar, graded, 3));
    EXPECT(node->rendered(3) != recoloured(sidecar, sidecar.edits, 3));

    // A matte in alpha, which the opaque clip's output would not show.
    EXPECT(node->getOutputPreMultiplication() == kOfxImageOpaque);
    EXPECT(node->change<Choice>("output", 1) && node->change<Choice>("matteIn", 1));
    EXPECT(node->getOutputPreMultiplication() == kOfxImageUnPreMultiplied);
    const std::vector<float> matte = node->rendered(3);
    float least = 1, most = 0;
    for (std::size_t i = 3; i < matte.size(); i += 4) {
        least = std::min(least, matte[i]);
        most = std::max(most, matte[i]);
    }
    EXPECT(least == 0 && most > 0.5f && most <= 1);
    node->change<Choice>("output", 0);
    EXPECT(node->getOutputPreMultiplication() == kOfxImageOpaque);

    // The file goes; then the project's copy is there.
    node->change<Flag>("embed", true);
    std::filesystem::remove(path);
    EXPECT(node->rendered(3) == recoloured(sidecar, graded, 3) && node->message.empty());
    node->change<Flag>("embed", false);
    EXPECT(node->rendered(3) == source_pixels());
    EXPECT(node->message.find("does not exist") != std::string::npos);
    EXPECT(status().find("does not exist") != std::string::npos);
}

}  // namespace

int main(int count, char** words) {
    if (count != 2) {
        std::cerr << "expected an edited sidecar\n";
        return 2;
    }
    Host host;
    g_fetch = host.getHandle()->fetchSuite;
    host.getHandle()->fetchSuite = &fetch_suite;
    {
        sdk::ImageEffect::PluginCache cache(host);
        cache.registerInCache(*sdk::PluginCache::getPluginCache());
        sdk::PluginCache::getPluginCache()->scanPluginFiles();
        auto* plugin = cache.getPluginById("org.palette4d.Palette4D");
        EXPECT(plugin);
        for (const char* context : {kOfxImageEffectContextFilter, kOfxImageEffectContextGeneral}) {
            if (plugin) live(*plugin, context, words[1]);
        }
        sdk::PluginCache::clearPluginCache();
    }
    // This library knows the standard up to 1.4, and no vendor's additions.
    for (const std::string& name : g_refused) {
        const bool later = name == "OfxImageEffectPropNoSpatialAwareness" ||
                           name == "OfxImageEffectPropCPURenderSupported" ||
                           name == "OfxImageEffectPropColourManagementStyle" ||
                           name == "OfxImageEffectPropColourManagementAvailableConfigs" ||
                           name == "OfxParamPropLayoutHint";
        if (!later) {
            std::cerr << "the host has no property " << name << "\n";
            ++g_failures;
        }
    }
    std::cout << (g_failures ? "failed" : "passed") << "\n";
    return g_failures != 0;
}
