#include "exr.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace palette4d::node {
namespace {

/// Appends numbers in little-endian order, as EXR has them.
class Bytes {
public:
    template <typename Number>
    Bytes& number(Number value) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof value);
        for (std::size_t i = 0; i < sizeof value; ++i) text += static_cast<char>(bits >> 8 * i);
        return *this;
    }
    Bytes& word(const char* value) {
        text.append(value, std::strlen(value) + 1);
        return *this;
    }
    Bytes& attribute(const char* name, const char* type, int size) {
        return word(name).word(type).number(size);
    }
    std::string text;
};

}  // namespace

bool write_exr(const std::filesystem::path& path, const Image& image) {
    const int width = image.bounds.x2 - image.bounds.x1, height = image.bounds.y2 - image.bounds.y1;
    const bool alpha = image.channels == 4 && image.premultiplied;
    // By their names' order, with their places in a pixel.
    const std::vector<std::pair<const char*, std::size_t>> channels =
        alpha ? std::vector<std::pair<const char*, std::size_t>>{{"A", 3},
                                                                 {"B", 2},
                                                                 {"G", 1},
                                                                 {"R", 0}}
              : std::vector<std::pair<const char*, std::size_t>>{{"B", 2}, {"G", 1}, {"R", 0}};
    constexpr int kHalf = 1;
    Bytes head;
    head.number(20000630).number(2);
    head.attribute("channels", "chlist", static_cast<int>(channels.size()) * 18 + 1);
    for (const auto& [name, place] : channels) {
        head.word(name).number(kHalf).number(0).number(1).number(1);
    }
    head.number('\0');
    head.attribute("compression", "compression", 1).number('\0');
    for (const char* window : {"dataWindow", "displayWindow"}) {
        head.attribute(window, "box2i", 16)
            .number(0)
            .number(0)
            .number(width - 1)
            .number(height - 1);
    }
    head.attribute("lineOrder", "lineOrder", 1).number('\0');
    head.attribute("pixelAspectRatio", "float", 4).number(1.0f);
    head.attribute("screenWindowCenter", "v2f", 8).number(0.0f).number(0.0f);
    head.attribute("screenWindowWidth", "float", 4).number(1.0f).number('\0');

    const int line = width * static_cast<int>(channels.size()) * 2;
    const std::size_t table = head.text.size();
    for (int y = 0; y < height; ++y) {
        head.number(static_cast<std::uint64_t>(table + static_cast<std::size_t>(height) * 8) +
                    static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(line + 8));
    }
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(head.text.data(), static_cast<std::streamsize>(head.text.size()));

    const auto count = static_cast<std::size_t>(image.channels);
    std::vector<float> row(static_cast<std::size_t>(width) * count);
    std::vector<std::uint16_t> halves(row.size());
    Image half = image;
    half.data = reinterpret_cast<char*>(halves.data());
    half.bounds = {0, 0, width, 1};
    half.depth = Depth::kHalf;
    half.pixel_bytes = image.channels * 2;
    half.row_bytes = static_cast<std::ptrdiff_t>(width) * half.pixel_bytes;
    for (int y = 0; y < height && file; ++y) {
        // The host's rows count upwards, a file's downwards.
        const int from = image.bounds.y2 - 1 - y;
        read_floats(image, {image.bounds.x1, from, image.bounds.x2, from + 1}, row.data());
        write_floats(row.data(), half, half.bounds);
        Bytes scanline;
        scanline.text.reserve(static_cast<std::size_t>(line) + 8);
        scanline.number(y).number(line);
        for (const auto& [name, place] : channels) {
            for (std::size_t x = place; x < halves.size(); x += count) scanline.number(halves[x]);
        }
        file.write(scanline.text.data(), static_cast<std::streamsize>(scanline.text.size()));
    }
    file.flush();
    return file.good();
}

}  // namespace palette4d::node
