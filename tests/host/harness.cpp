#include "harness.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>
#include <thread>

namespace test {
namespace {

std::string g_bundle;
std::filesystem::path g_folder, g_own_file;
int g_failures = 0;

}  // namespace

std::vector<Case>& cases() {
    static std::vector<Case> all;
    return all;
}

void failed(const char* file, int line, const std::string& what) {
    ++g_failures;
    std::cerr << file << ":" << line << ": " << what << "\n";
}

long every(long step) {
    if (std::getenv("PALETTE4D_EVERY_CALL")) return 1;
    return std::getenv("PALETTE4D_FEW_ROUNDS") ? 2 * step + 1 : step;
}

/// Scene-linear light with other primaries to a log in which the palette's box lies.
constexpr const char* kConversion = R"("encoding": "ACEScct", "conversion": {
  "input_space": "ACEScg", "config": "test.ocio", "error": 0, "steps": [
    {"kind": "matrix", "matrix": [[0.9, 0.1, 0], [0.05, 0.9, 0.05], [0, 0.1, 0.9]],
     "offset": [0, 0, 0]},
    {"kind": "log", "direction": "forward", "base": 2,
     "log_slope": [0.0570776, 0.0570776, 0.0570776],
     "log_offset": [0.5547945, 0.5547945, 0.5547945], "linear_slope": [1, 1, 1],
     "linear_offset": [0, 0, 0], "start": [0.0078125, 0.0078125, 0.0078125],
     "below": [10.5402, 10.5402, 10.5402]}]})";

void figure(const std::string& what) { std::cout << "      " << what << std::endl; }

const std::string& bundle() { return g_bundle; }
std::filesystem::path folder() { return g_folder; }
std::filesystem::path own_file() { return g_own_file; }

std::string write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = g_folder / name;
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
    return path.u8string();
}

std::string sidecar_text(bool edited) {
    std::ostringstream json;
    json << R"({"schema": "palette4d.sidecar", "version": 1, "generator": "palette4d tests",
  "clip": {"name": "box", "source": "box.####.exr",
           "frames": {"first": 10, "last": 20, "step": 1, "skipped": []},
           "rate": [24, 1], "size": [64, 48], "encoding": "linear"},
  "polytope": {"vertices": [)";
    for (int end = 0; end < 2; ++end) {
        for (int corner = 0; corner < 8; ++corner) {
            const double high = end ? 0.8 : 0.9, low = end ? 0.2 : 0.1;
            json << (end || corner ? ", " : "") << R"({"id": "v)" << end * 8 + corner
                 << R"(", "frame": )" << (end ? 20 : 10) << R"(, "rgb": [)"
                 << (corner & 1 ? high : low) << ", " << (corner & 2 ? high : low) << ", "
                 << (corner & 4 ? high : low) << "]}";
        }
    }
    json << R"(], "edges": [)";
    for (int corner = 0; corner < 8; ++corner) {
        json << (corner ? ", " : "") << R"({"id": "e)" << corner << R"(", "from": "v)" << corner
             << R"(", "to": "v)" << corner + 8 << R"("})";
    }
    json << R"(], "blocks": [{"first": 10, "last": 20, "tracks": [)";
    for (int corner = 0; corner < 8; ++corner) {
        json << (corner ? ", " : "") << R"(["v)" << corner << R"(", "v)" << corner + 8 << R"("])";
    }
    // Each side of the box as two triangles, anticlockwise from outside.
    json << R"(], "faces": [[0,2,3],[0,3,1],[4,5,7],[4,7,6],[0,1,5],[0,5,4],
                            [2,6,7],[2,7,3],[0,4,6],[0,6,2],[1,3,7],[1,7,5]]}],
                "transitions": []},
  "quality": {"stages": [], "options": {}, "versions": {}},
  "edits": {)";
    if (edited) {
        json << R"("vertices": [{"vertex": "v1", "rgb": [0.2, 0.7, 0.1]},
                                {"vertex": "v11", "rgb": [1.4, -0.3, 0.25]}],
                   "stops": [{"id": "s1", "edge": "e2", "frame": 15, "rgb": [0.5, 0.5, 0.9]}])";
    } else {
        json << R"("vertices": [], "stops": [])";
    }
    json << R"(}, "extra": {}})";
    return json.str();
}

std::string with_conversion(std::string sidecar) {
    const std::string from = R"("encoding": "linear")";
    return sidecar.replace(sidecar.find(from), from.size(), kConversion);
}

std::string text_with_picks(bool edited) {
    std::string text = sidecar_text(edited);
    const std::string picks =
        R"("picks": [{"id": "p1", "kind": "pick", "frame": 12, "rgb": [0.75, 0.25, 0.25],
        "to": [0.25, 0.5, 0.75]},
        {"id": "p3", "kind": "hold", "frame": 12, "rgb": [0.25, 0.75, 0.25]},
        {"id": "p4", "kind": "pick", "frame": 12, "rgb": [0.25, 0.25, 0.75],
        "to": [0.75, 0.75, 0.25], "window": {"feather": 20.37, "keys": [
        {"frame": 10, "box": [8.13, 16.41, 16.2, 24.07]},
        {"frame": 14, "box": [21.3, 12.6, 32.9, 68.7]}]}}], )";
    text.insert(text.find("\"edits\": {") + 10, picks);
    return text;
}

std::string sidecar(const std::string& name, bool edited) {
    return write(name, sidecar_text(edited));
}

void fill(strict::Picture& picture, unsigned seed, bool odd_values) {
    const strict::Layout& layout = picture.layout();
    std::mt19937 random(seed);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const float odd[] = {
        std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, -0.0f, 1e30f,
        std::numeric_limits<float>::denorm_min()};
    for (int y = layout.bounds.y1; y < layout.bounds.y2; ++y) {
        for (int x = layout.bounds.x1; x < layout.bounds.x2; ++x) {
            for (int c = 0; c < layout.channels; ++c) {
                const auto r = static_cast<unsigned>(random());
                unsigned char* to = picture.at(x, y) + layout.number_bytes() * c;
                if (layout.depth == strict::Depth::kByte || layout.depth == strict::Depth::kShort) {
                    std::memcpy(to, reinterpret_cast<const unsigned char*>(&r) + 2,
                                static_cast<std::size_t>(layout.number_bytes()));
                    continue;
                }
                float value = static_cast<float>(r >> 8) / 16777216.0f;
                if (c < 3) value = 1.6f * value - 0.3f;
                if (odd_values && r % 61 == 0) value = odd[(r / 61) % std::size(odd)];
                // Fully transparent pixels, too.
                if (c == 3 && r % 17 == 0) value = 0.0f;
                const std::vector<unsigned char> bytes = stored(layout, {value});
                std::memcpy(to, bytes.data(), bytes.size());
            }
        }
    }
}

std::vector<unsigned char> drawn(palette4d::Drawing drawing, const strict::Picture& picture,
                                 const OfxRectI& area) {
    using namespace palette4d;
    const strict::Layout& layout = picture.layout();
    const int width = layout.width(), height = layout.height();
    const std::vector<float> values = floats(layout, picture.pixels(layout.bounds));
    std::vector<float> result(values.size());
    const auto row = static_cast<std::ptrdiff_t>(width) * layout.channels;
    // The core's pictures begin at the top.
    const std::ptrdiff_t top = row * (height - 1), stride = -row * 4;
    draw_picture({values.data() + top, width, height, layout.channels, stride},
                 {result.data() + top, width, height, layout.channels, stride}, std::move(drawing),
                 layout.premultiplication == std::string(kOfxImagePreMultiplied), 1);
    std::vector<float> part;
    for (int y = area.y1; y < area.y2; ++y) {
        const auto* const from = result.data() + (y - layout.bounds.y1) * row +
                                 (area.x1 - layout.bounds.x1) * layout.channels;
        part.insert(part.end(), from, from + (area.x2 - area.x1) * layout.channels);
    }
    return stored(layout, part);
}

std::vector<unsigned char> recoloured(const palette4d::Sidecar& sidecar, double frame,
                                      const strict::Picture& picture, const OfxRectI& area,
                                      double strength, double clean_up) {
    using namespace palette4d;
    const Slice slice = slice_at(sidecar.polytope, frame);
    Drawing drawing;
    drawing.edit = std::make_shared<const Recolourer>(
        slice.rgb, edited_colours(sidecar.polytope, sidecar.edits, slice), slice.faces,
        picks_at(sidecar.edits, slice.frame));
    drawing.options.strength = strength;
    drawing.options.clean_up = clean_up;
    if (sidecar.conversion) {
        drawing.conversion = {sidecar.conversion, &sidecar.conversion->steps};
    }
    return drawn(std::move(drawing), picture, area);
}

namespace {

std::vector<unsigned char> rendered(strict::Instance& node, const strict::Picture& picture,
                                    double time) {
    strict::Picture output(picture.layout());
    const OfxRectI& bounds = picture.layout().bounds;
    CHECK(node.render(time, &picture, output, bounds) == kOfxStatOK);
    return output.pixels(bounds);
}

}  // namespace

Ready::Ready(std::string chosen, const std::string& context)
    : path(std::move(chosen)), instance(plugin.create(context)) {
    set("sidecar", path);
}

void Ready::change(const std::string& name, strict::Value value) {
    set(name, std::move(value));
    CHECK(instance->changed(name) == kOfxStatOK);
}

std::vector<unsigned char> Ready::render(const strict::Picture& picture, double time) const {
    return rendered(*instance, picture, time);
}

bool Ready::says(const std::string& words) const {
    return instance->text("status").find(words) != std::string::npos;
}

std::vector<unsigned char> Shown::render(strict::Instance& other, double time) const {
    return rendered(other, source, time);
}

std::vector<unsigned char> Shown::edited(double frame) const {
    return recoloured(parsed, frame, source, layout.bounds);
}

std::vector<unsigned char> Shown::edited(const palette4d::Edits& edits, double frame) const {
    palette4d::Sidecar sidecar = parsed;
    sidecar.edits = edits;
    return recoloured(sidecar, frame, source, layout.bounds);
}

OfxRectI rect(int x1, int y1, int x2, int y2) { return {x1, y1, x2, y2}; }

std::vector<strict::Layout> layouts() {
    std::vector<strict::Layout> all;
    for (const strict::Depth depth : strict::kDepths) {
        for (const int channels : {3, 4}) {
            for (const char* alpha :
                 {kOfxImageUnPreMultiplied, kOfxImagePreMultiplied, kOfxImageOpaque}) {
                if (channels == 3 && alpha != std::string(kOfxImageUnPreMultiplied)) continue;
                strict::Layout layout;
                layout.bounds = rect(-9, 4, 22, 31);
                layout.depth = depth;
                layout.channels = channels;
                layout.premultiplication = alpha;
                layout.padding = 12;
                layout.upside_down = channels == 4;
                all.push_back(layout);
            }
        }
    }
    return all;
}

strict::Picture source_of(const strict::Layout& layout) {
    strict::Picture source(layout, 0x22);
    fill(source, 3);
    if (layout.premultiplication != kOfxImagePreMultiplied) return source;
    for (int y = layout.bounds.y1; y < layout.bounds.y2; ++y) {
        for (int x = layout.bounds.x1; x < layout.bounds.x2; ++x) {
            std::vector<float> pixel = floats(layout, source.pixels({x, y, x + 1, y + 1}));
            for (std::size_t c = 0; c < 3; ++c) pixel[c] *= pixel[3];
            const std::vector<unsigned char> bytes = stored(layout, pixel);
            std::memcpy(source.at(x, y), bytes.data(), bytes.size());
        }
    }
    return source;
}

namespace {

/// IEEE 754 binary16, slowly.
float half_value(unsigned half) {
    const int exponent = static_cast<int>(half >> 10 & 31),
              fraction = static_cast<int>(half & 1023);
    const double sign = half & 0x8000 ? -1 : 1;
    if (exponent == 31) {
        return fraction ? std::numeric_limits<float>::quiet_NaN()
                        : static_cast<float>(sign * std::numeric_limits<double>::infinity());
    }
    return static_cast<float>(
        sign * std::ldexp(exponent ? fraction + 1024 : fraction, (exponent ? exponent : 1) - 25));
}

unsigned nearest_half(float value) {
    const unsigned sign = std::signbit(value) ? 0x8000 : 0;
    const double size = std::abs(static_cast<double>(value));
    if (std::isnan(value)) return sign | 0x7e00;
    int exponent = 0;
    std::frexp(size, &exponent);
    // Halves of that size are multiples of this.
    const double step = std::ldexp(1, std::max(exponent, -13) - 11);
    const double rounded = size > 1e6 ? 1e6 : std::nearbyint(size / step) * step;
    if (rounded >= 65536) return sign | 0x7c00;
    if (rounded == 0) return sign;
    std::frexp(rounded, &exponent);
    if (exponent <= -14) return sign | static_cast<unsigned>(std::ldexp(rounded, 24));
    return sign | (static_cast<unsigned>(exponent + 14) << 10) |
           (static_cast<unsigned>(std::ldexp(rounded, 11 - exponent)) & 1023);
}

}  // namespace

std::vector<float> floats(const strict::Layout& layout, const std::vector<unsigned char>& pixels) {
    const auto bytes = static_cast<std::size_t>(layout.number_bytes());
    std::vector<float> values(pixels.size() / bytes);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const unsigned char* at = &pixels[i * bytes];
        std::uint16_t word = 0;
        if (bytes == 2) std::memcpy(&word, at, 2);
        switch (layout.depth) {
            case strict::Depth::kByte:
                values[i] = static_cast<float>(*at) / 255.0f;
                break;
            case strict::Depth::kShort:
                values[i] = static_cast<float>(word) / 65535.0f;
                break;
            case strict::Depth::kHalf:
                values[i] = half_value(word);
                break;
            case strict::Depth::kFloat:
                std::memcpy(&values[i], at, 4);
                break;
        }
    }
    return values;
}

double rounding(strict::Depth depth, double number) {
    switch (depth) {
        case strict::Depth::kByte:
            return 0.505 / 255;
        case strict::Depth::kShort:
            return 0.505 / 65535;
        case strict::Depth::kHalf:
            return std::max(std::abs(number) * 0x1.02p-11, 0x1p-25);
        case strict::Depth::kFloat:
            break;
    }
    return 0;
}

std::vector<unsigned char> stored(const strict::Layout& layout, const std::vector<float>& values) {
    const auto bytes = static_cast<std::size_t>(layout.number_bytes());
    std::vector<unsigned char> pixels(values.size() * bytes);
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (layout.depth == strict::Depth::kFloat) {
            std::memcpy(&pixels[i * bytes], &values[i], bytes);
            continue;
        }
        unsigned word = nearest_half(values[i]);
        if (layout.depth != strict::Depth::kHalf) {
            const float most = bytes == 1 ? 255.0f : 65535.0f;
            word = static_cast<unsigned>(
                std::nearbyint(std::fmin(std::fmax(values[i] * most, 0.0f), most)));
        }
        std::memcpy(&pixels[i * bytes], &word, bytes);  // little-endian, as all that we build for
    }
    return pixels;
}

namespace {

/// What a copy of this program does in the place of Python (stand_in.hpp).
int stand_in(const std::vector<std::string>& words) {
    namespace fs = std::filesystem;
    const fs::path here = fs::u8path(words[0]).parent_path();
    const auto note = [&](const std::string& name, const std::string& text) {
        std::ofstream(here / (name + ".new"), std::ios::binary) << text;
        fs::rename(here / (name + ".new"), here / name);
    };
    std::string all;
    for (std::size_t i = 1; i < words.size(); ++i) all += words[i] + "\n";
    note("started", all);
    std::ostringstream fails;
    if (fails << std::ifstream(here / "fails").rdbuf()) {
        std::cerr << fails.str();
        return 1;
    }
    if (words[6] != "analyze") return 0;
    const fs::path sidecar = fs::u8path(words.at(9)), progress = fs::u8path(words.at(12));
    std::ofstream(progress, std::ios::binary)
        << R"({"stage": "structure search", "done": 3, "total": 40})"
           "\n";
    std::string end;
    while (!std::getline(std::ifstream(here / "go"), end)) {
        if (!fs::exists(here)) return 1;  // the test is over
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (end.find("finished") != std::string::npos) {
        fs::copy_file(here / "box.json", sidecar, fs::copy_options::overwrite_existing);
    }
    std::ofstream(progress, std::ios::binary | std::ios::app) << end << "\n";
    return 0;
}

}  // namespace
}  // namespace test

// What LeakSanitizer must not count: OpenCL on a processor keeps its compiler's memory, Objective-C
// its classes.
extern "C" const char* __lsan_default_suppressions();
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libpocl\nleak:libLLVM\nleak:libOpenCL\nleak:libobjc\n";
}

// Thread-local memory of libraries that were loaded late (pocl with LLVM) is found by a guess,
// which now and then points nowhere: "Tracer caught signal 11" after all tests have passed. Without
// it more counts as a leak, not less.
extern "C" const char* __lsan_default_options();
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_options() {
    return "use_tls=0";
}

/// palette4d_host_tests BUNDLE FOLDER [NAME …] [-NAME …] [odd|even]: runs the tests whose names
/// contain one of NAME (all without one), and none of -NAME; with odd or even every second of them.
int main(int argc, char** argv) {
    std::vector<std::string> words = strict::arguments(argc, argv);
    if (words.size() < 3) {
        std::cerr
            << "usage: palette4d_host_tests BUNDLE FOLDER [NAME ...] [-NAME ...] [odd|even]\n";
        return 2;
    }
    // Its last line is what is looked for: no word of LeakSanitizer comes after it.
    if (words[1] == "-E") std::_Exit(test::stand_in(words));
    const bool halved = words.back() == "odd" || words.back() == "even";
    const int half = words.back() == "odd" ? 1 : 0;
    if (halved) words.pop_back();
    test::g_bundle = words[1];
    test::g_own_file = std::filesystem::absolute(std::filesystem::u8path(words[0]));
    int failed_cases = 0, run = 0, number = 0;
    for (const test::Case& test_case : test::cases()) {
        bool any = false, wanted = false, unwanted = false;
        for (std::size_t i = 3; i < words.size(); ++i) {
            const bool minus = words[i][0] == '-';
            const bool holds = std::strstr(test_case.name, words[i].c_str() + minus) != nullptr;
            any |= !minus;
            (minus ? unwanted : wanted) |= holds;
        }
        if (unwanted || (any && !wanted) || (halved && ++number % 2 != half)) continue;
        ++run;
        // Whole: what the node is given and what it says are compared as texts.
        test::g_folder =
            std::filesystem::absolute(std::filesystem::u8path(words[2])) / test_case.name;
        std::filesystem::remove_all(test::g_folder);
        std::filesystem::create_directories(test::g_folder);
        const auto began = std::chrono::steady_clock::now();
        const int before = test::g_failures;
        strict::Host::get().configure({});
        strict::Host::get().take_faults();
        try {
            test_case.run();
        } catch (const std::exception& error) {
            test::failed(test_case.name, 0, std::string("exception: ") + error.what());
        }
        for (const std::string& fault : strict::Host::get().take_faults()) {
            test::failed(test_case.name, 0, "fault: " + fault);
        }
        const bool ok = test::g_failures == before;
        failed_cases += !ok;
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - began;
        std::cout << (ok ? "ok    " : "FAILED ") << test_case.name << "  ("
                  << std::round(10 * taken.count()) / 10 << " s)" << std::endl;
    }
    std::cout << run - failed_cases << " of " << run << " passed" << std::endl;
    return failed_cases || !run ? 1 : 0;
}
