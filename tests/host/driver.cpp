// strict_host render BUNDLE SIDECAR --frame T --width W --height H [options] IN.raw OUT.raw
// One picture through the node, for tests in other languages. Raw files hold rows of interleaved
// pixels without gaps: float32 of this machine or bytes.
// strict_host describe BUNDLE
// The node's parameters as it describes them, a JSON object of names.
// strict_host push BUNDLE BUTTON [--effect N] [--set NAME=VALUE] [--width W --height H FRAMES.raw]
// Pushes a button and waits, as long as the status speaks of an analysis, or until Studio fails.
// The frames, RGBA in float32, are the clip's from time 1 on.
#include <chrono>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>
#include <thread>

#include "describe_json.hpp"
#include "sidecar/sidecar.hpp"
#include "strict_host.hpp"

namespace {

constexpr const char* kUsage =
    "usage: strict_host describe BUNDLE\n"
    "       strict_host push BUNDLE BUTTON [--set NAME=VALUE] [--effect N]\n"
    "                        [--width W --height H FRAMES.raw]\n"
    "       strict_host render BUNDLE SIDECAR [options] IN.raw OUT.raw\n"
    "  --width W --height H     size of the picture\n"
    "  --frame T                frame of the sidecar (or --time T: the host's, 0 at the clip's "
    "first)\n"
    "  --components RGBA|RGB    (RGBA)\n"
    "  --depth float|byte       (float)\n"
    "  --strength S             (1)\n"
    "  --offset F               parameter frameOffset (0)\n"
    "  --set NAME=VALUE         any parameter, as often as wanted: a number, a text, or R,G,B\n"
    "  --premultiplied 0|1      (0)\n"
    "  --padding BYTES          after each row (0)\n"
    "  --upside-down 0|1        negative rowBytes (0)\n"
    "  --origin X,Y             of the picture (0,0)\n"
    "  --tile N                 render in tiles of N x N pixels (the whole picture at once)\n"
    "  --processors N           of the host (4)\n"
    "  --context Filter|General (Filter)\n"
    "describe prints the parameters as JSON; render prints the status line, and the persistent\n"
    "message if there is one; exit status 3: faults\n";

using Options = std::map<std::string, std::string>;
using Settings = std::vector<std::string>;

std::vector<char> read(const std::string& path) {
    std::ifstream file(std::filesystem::u8path(path), std::ios::binary);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Sets a parameter from NAME=VALUE, as its type has it.
void set(strict::Instance& instance, const std::string& setting) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
        throw std::runtime_error("--set: found " + setting + ", expected NAME=VALUE");
    }
    const std::string name = setting.substr(0, equals), value = setting.substr(equals + 1);
    const strict::Value& now = instance.value(name);
    if (std::holds_alternative<int>(now)) {
        instance.set(name, std::stoi(value));
    } else if (std::holds_alternative<double>(now)) {
        instance.set(name, std::stod(value));
    } else if (std::holds_alternative<strict::Colour>(now)) {
        strict::Colour colour{};
        if (std::sscanf(value.c_str(), "%lf,%lf,%lf", &colour[0], &colour[1], &colour[2]) != 3) {
            throw std::runtime_error("--set: found " + value + ", expected R,G,B");
        }
        instance.set(name, colour);
    } else {
        instance.set(name, value);
    }
}

/// Says what the plugin has done wrong; whether it has.
bool faulty() {
    const std::vector<std::string> faults = strict::Host::get().take_faults();
    for (const std::string& fault : faults) std::cerr << "fault: " << fault << "\n";
    return !faults.empty();
}

int describe(const std::string& bundle) {
    strict::Host::get().configure({});
    strict::Plugin plugin(bundle);
    plugin.load();
    const auto descriptor = plugin.describe(kOfxImageEffectContextFilter);
    plugin.unload();
    if (!descriptor) throw std::runtime_error(bundle + ": the plugin does not describe itself");
    std::cout << strict::described_json(*descriptor) << "\n";
    return faulty() ? 3 : 0;
}

int push(const std::vector<std::string>& names, const Options& options, const Settings& settings) {
    const auto number = [&](const char* name) {
        const auto found = options.find(name);
        return found == options.end() ? 0 : std::stoi(found->second);
    };
    strict::Layout layout;
    layout.bounds = {0, 0, number("width"), number("height")};
    std::vector<strict::Picture> pictures;
    if (names.size() > 2) {
        const std::vector<char> pixels = read(names[2]);
        const auto row = static_cast<std::size_t>(layout.width() * layout.pixel_bytes());
        const std::size_t size = row * static_cast<std::size_t>(layout.height());
        for (std::size_t at = 0; size > 0 && at + size <= pixels.size(); at += size) {
            strict::Picture& picture = pictures.emplace_back(layout);
            for (int y = 0; y < layout.height(); ++y) {
                std::memcpy(picture.at(0, y), &pixels[at + row * static_cast<std::size_t>(y)], row);
            }
        }
    }
    strict::Config config;
    if (!pictures.empty()) config.frame_range = {1, static_cast<double>(pictures.size())};
    strict::Host::get().configure(config);
    {
        strict::Plugin plugin(names[0], number("effect"));
        const auto instance = plugin.create();
        if (!pictures.empty()) {
            instance->frames = [&](double time) {
                return &pictures.at(static_cast<std::size_t>(time) - 1);
            };
        }
        for (const std::string& setting : settings) set(*instance, setting);
        instance->changed(names[1]);
        const auto waits = [&] {
            const std::string said = instance->text("status");
            return names[1] == "openInStudio" ? said.find(" ended: ") == std::string::npos
                                              : said.rfind("analysing ", 0) == 0;
        };
        while (waits()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
            instance->changed("", "", kOfxChangeTime);
        }
        std::cout << instance->text("status") << "\n";
    }
    return faulty() ? 3 : 0;
}

int render(const std::vector<std::string>& names, const Options& options,
           const Settings& settings) {
    const auto get = [&](const char* name, const char* initial) {
        const auto found = options.find(name);
        return found == options.end() ? std::string(initial) : found->second;
    };
    strict::Layout layout;
    int x = 0, y = 0;
    char comma = 0;
    const std::string origin = get("origin", "0,0");
    if (std::sscanf(origin.c_str(), "%d%c%d", &x, &comma, &y) != 3) {
        throw std::runtime_error("--origin: found " + origin + ", expected X,Y");
    }
    layout.bounds = {x, y, x + std::stoi(get("width", "0")), y + std::stoi(get("height", "0"))};
    layout.channels = get("components", "RGBA") == "RGB" ? 3 : 4;
    layout.depth = get("depth", "float") == "byte" ? strict::Depth::kByte : strict::Depth::kFloat;
    layout.padding = std::stoi(get("padding", "0"));
    layout.upside_down = get("upside-down", "0") == "1";
    if (get("premultiplied", "0") == "1") layout.premultiplication = kOfxImagePreMultiplied;

    double time = std::stod(get("time", "0"));
    if (options.count("frame")) {
        const palette4d::Sidecar sidecar = palette4d::read_sidecar(names[1]);
        time = std::stod(options.at("frame")) - static_cast<double>(sidecar.clip.first);
    }

    strict::Config config;
    config.processors = static_cast<unsigned>(std::stoul(get("processors", "4")));
    strict::Host::get().configure(config);
    const std::string context = "OfxImageEffectContext" + get("context", "Filter");
    const std::size_t row = static_cast<std::size_t>(layout.width()) * layout.pixel_bytes();
    const std::vector<char> pixels = read(names[2]);
    if (layout.width() <= 0 || layout.height() <= 0 || pixels.size() != row * layout.height()) {
        throw std::runtime_error(names[2] + ": found " + std::to_string(pixels.size()) +
                                 " bytes, expected width x height x pixel");
    }
    strict::Picture source(layout), output(layout);
    for (int r = 0; r < layout.height(); ++r) {
        std::memcpy(source.at(x, y + r), pixels.data() + row * r, row);
    }
    int failed = 0;
    {
        strict::Plugin plugin(names[0]);
        const auto instance = plugin.create(context);
        instance->set("sidecar", names[1]);
        instance->set("strength", std::stod(get("strength", "1")));
        instance->set("frameOffset", std::stod(get("offset", "0")));
        for (const std::string& setting : settings) set(*instance, setting);
        instance->changed("sidecar");
        const int tile = std::max(1, std::stoi(get("tile", "1000000000")));
        for (long ty = y; ty < layout.bounds.y2; ty += tile) {
            for (long tx = x; tx < layout.bounds.x2; tx += tile) {
                const OfxRectI window = {
                    static_cast<int>(tx), static_cast<int>(ty),
                    static_cast<int>(std::min<long>(tx + tile, layout.bounds.x2)),
                    static_cast<int>(std::min<long>(ty + tile, layout.bounds.y2))};
                failed |= instance->render(time, &source, output, window) != kOfxStatOK;
            }
        }
        std::cout << "status: " << instance->text("status") << "\n";
        if (!instance->effect().persistent_message.empty()) {
            std::cout << "message: " << instance->effect().persistent_message << "\n";
        }
    }
    std::ofstream file(std::filesystem::u8path(names[3]), std::ios::binary);
    const auto result = output.pixels(layout.bounds);
    file.write(reinterpret_cast<const char*>(result.data()),
               static_cast<std::streamsize>(result.size()));
    if (!file.flush()) throw std::runtime_error(names[3] + ": cannot be written");
    if (failed) std::cerr << "the render failed\n";
    return faulty() ? 3 : failed;
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<std::string> names;
    Options options;
    Settings settings;
    const std::vector<std::string> words = strict::arguments(argc, argv);
    for (std::size_t i = 2; i < words.size(); ++i) {
        const bool more = i + 1 < words.size();
        if (words[i] == "--set" && more) {
            settings.push_back(words[++i]);
        } else if (words[i].rfind("--", 0) == 0 && more) {
            options[words[i].substr(2)] = words[i + 1];
            ++i;
        } else {
            names.push_back(words[i]);
        }
    }
    const std::string verb = words.size() < 2 ? "" : words[1];
    if (!(verb == "render" && names.size() == 4) &&
        !(verb == "push" && (names.size() == 2 || names.size() == 3)) &&
        !(verb == "describe" && names.size() == 1)) {
        std::cerr << kUsage;
        return 2;
    }
    try {
        if (verb == "describe") return describe(names[0]);
        if (verb == "push") return push(names, options, settings);
        return render(names, options, settings);
    } catch (const std::exception& error) {
        std::cerr << "strict_host: " << error.what() << "\n";
        return 1;
    }
}
