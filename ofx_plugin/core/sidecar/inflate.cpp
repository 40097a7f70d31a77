#include "sidecar/inflate.hpp"

#include <algorithm>
#include <array>

namespace palette4d {
namespace {

constexpr int kMostBits = 15;
/// zlib makes a block for each 128 symbols or more, of a matte 1152 at most. A stream of empty
/// blocks would only cost time.
constexpr int kMostBlocks = 2048;

/// Bits of a stream, the lowest of each byte first. Beyond its end they are 0, and failed() is
/// true.
class Bits {
public:
    Bits(const std::string& stream, std::size_t at) : stream_(stream), at_(at) {}

    unsigned take(int count) {
        while (held_ < count) {
            if (at_ >= stream_.size()) {
                failed_ = true;
                return 0;
            }
            bits_ |= static_cast<std::uint32_t>(static_cast<unsigned char>(stream_[at_++]))
                     << held_;
            held_ += 8;
        }
        const unsigned found = bits_ & ((1u << count) - 1);
        bits_ >>= count;
        held_ -= count;
        return found;
    }
    void to_byte() {
        bits_ = 0;
        held_ = 0;
    }
    bool failed() const { return failed_; }
    std::size_t at() const { return at_; }

private:
    const std::string& stream_;
    std::size_t at_;
    std::uint32_t bits_ = 0;
    int held_ = 0;
    bool failed_ = false;
};

/// A canonical Huffman code (RFC 1951, 3.2.2).
class Code {
public:
    /// The length of each symbol's code; 0: the symbol is not used.
    Code(const std::uint8_t* lengths, int count) {
        for (int symbol = 0; symbol < count; ++symbol) ++counts_[lengths[symbol]];
        counts_[0] = 0;
        int left = 1;
        for (int bits = 1; bits <= kMostBits; ++bits) {
            left = 2 * left - counts_[static_cast<std::size_t>(bits)];
            if (left < 0) return;  // more codes than there are
        }
        std::array<int, kMostBits + 2> first{};
        for (std::size_t bits = 1; bits <= kMostBits; ++bits) {
            first[bits + 1] = first[bits] + counts_[bits];
        }
        for (int symbol = 0; symbol < count; ++symbol) {
            if (lengths[symbol] == 0) continue;
            symbols_[static_cast<std::size_t>(first[lengths[symbol]]++)] = symbol;
        }
        usable_ = true;
    }

    bool usable() const { return usable_; }
    /// The next symbol; below 0 for bits that are no code.
    int next(Bits& bits) const {
        int code = 0, first = 0, index = 0;
        for (std::size_t length = 1; length <= kMostBits; ++length) {
            code |= static_cast<int>(bits.take(1));
            if (bits.failed()) return -1;
            const int count = counts_[length];
            if (code - first < count)
                return symbols_[static_cast<std::size_t>(index + code - first)];
            index += count;
            first = 2 * (first + count);
            code *= 2;
        }
        return -1;
    }

private:
    std::array<int, kMostBits + 1> counts_{};
    std::array<int, 288> symbols_{};
    bool usable_ = false;
};

/// The length or distance of a copy, of a group of symbols whose size doubles: `symbol` counts from
/// 0, and each size has 2 `half` symbols. Further bits are added to it.
std::size_t copied(Bits& bits, int symbol, int half, std::size_t least) {
    const int more = symbol < 2 * half ? 0 : symbol / half - 1;
    const int first = symbol < 2 * half ? symbol : (half + symbol % half) << more;
    return least + static_cast<std::size_t>(first) + bits.take(more);
}

bool stored_block(Bits& bits, std::vector<std::uint8_t>& out, std::size_t size) {
    bits.to_byte();
    const unsigned length = bits.take(16), inverse = bits.take(16);
    if (bits.failed() || length != (~inverse & 0xffffu) || out.size() + length > size) return false;
    for (unsigned i = 0; i < length; ++i) out.push_back(static_cast<std::uint8_t>(bits.take(8)));
    return !bits.failed();
}

bool coded_block(Bits& bits, const Code& literals, const Code& distances,
                 std::vector<std::uint8_t>& out, std::size_t size) {
    for (;;) {
        const int symbol = literals.next(bits);
        if (symbol < 0 || symbol > 285) return false;
        if (symbol == 256) return true;
        if (symbol < 256) {
            if (out.size() == size) return false;
            out.push_back(static_cast<std::uint8_t>(symbol));
            continue;
        }
        const std::size_t length = symbol == 285 ? 258 : copied(bits, symbol - 257, 4, 3);
        const int back = distances.next(bits);
        if (back < 0 || back > 29) return false;
        const std::size_t distance = copied(bits, back, 2, 1);
        if (bits.failed() || distance > out.size() || out.size() + length > size) return false;
        for (std::size_t i = 0; i < length; ++i) out.push_back(out[out.size() - distance]);
    }
}

bool fixed_block(Bits& bits, std::vector<std::uint8_t>& out, std::size_t size) {
    static const Code literals = [] {
        std::array<std::uint8_t, 288> lengths{};
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            lengths[i] = i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8;
        }
        return Code(lengths.data(), 288);
    }();
    static const Code distances = [] {
        std::array<std::uint8_t, 30> lengths{};
        lengths.fill(5);
        return Code(lengths.data(), 30);
    }();
    return coded_block(bits, literals, distances, out, size);
}

bool dynamic_block(Bits& bits, std::vector<std::uint8_t>& out, std::size_t size) {
    const unsigned literals = bits.take(5) + 257, distances = bits.take(5) + 1,
                   codes = bits.take(4) + 4;
    if (bits.failed() || literals > 286 || distances > 30) return false;
    constexpr std::size_t kOrder[19] = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                        11, 4,  12, 3, 13, 2, 14, 1, 15};
    std::array<std::uint8_t, 19> of_codes{};
    for (std::size_t i = 0; i < codes; ++i) {
        of_codes[kOrder[i]] = static_cast<std::uint8_t>(bits.take(3));
    }
    const Code code(of_codes.data(), 19);
    if (!code.usable()) return false;
    std::array<std::uint8_t, 286 + 30> lengths{};
    for (std::size_t at = 0; at < literals + distances;) {
        const int symbol = code.next(bits);
        if (symbol < 0 || symbol > 18) return false;
        if (symbol < 16) {
            lengths[at++] = static_cast<std::uint8_t>(symbol);
            continue;
        }
        if (symbol == 16 && at == 0) return false;
        const std::uint8_t again = symbol == 16 ? lengths[at - 1] : std::uint8_t{0};
        const unsigned count = symbol == 16   ? 3 + bits.take(2)
                               : symbol == 17 ? 3 + bits.take(3)
                                              : 11 + bits.take(7);
        if (bits.failed() || at + count > literals + distances) return false;
        for (unsigned i = 0; i < count; ++i) lengths[at++] = again;
    }
    if (lengths[256] == 0) return false;  // a block that never ends
    const Code of_literals(lengths.data(), static_cast<int>(literals)),
        of_distances(lengths.data() + literals, static_cast<int>(distances));
    return of_literals.usable() && of_distances.usable() &&
           coded_block(bits, of_literals, of_distances, out, size);
}

std::uint32_t adler32(const std::vector<std::uint8_t>& bytes) {
    std::uint32_t a = 1, b = 0;
    for (const std::uint8_t byte : bytes) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    return b << 16 | a;
}

}  // namespace

std::optional<std::string> from_base64(const std::string& text) {
    if (text.size() % 4 != 0) return std::nullopt;
    const std::size_t padding = text.size() - std::min(text.find('='), text.size());
    if (padding > 2) return std::nullopt;
    const auto value = [](char c) -> int {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        return c == '+' ? 62 : c == '/' ? 63 : -1;
    };
    std::string bytes;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool pad = i + padding >= text.size();
        const int found = pad ? (text[i] == '=' ? 0 : -1) : value(text[i]);
        if (found < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(found);
        if (i % 4 != 3) continue;
        for (const int shift : {16, 8, 0}) bytes += static_cast<char>(bits >> shift & 0xff);
        bits = 0;
    }
    bytes.resize(bytes.size() - padding);
    return bytes;
}

std::optional<std::vector<std::uint8_t>> inflated(const std::string& stream, std::size_t size) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(stream[i]); };
    if (stream.size() < 6 || (byte(0) & 15) != 8 || byte(0) >> 4 > 7 || (byte(1) & 0x20) != 0 ||
        (256u * byte(0) + byte(1)) % 31 != 0) {
        return std::nullopt;
    }
    std::vector<std::uint8_t> out;
    out.reserve(size);
    Bits bits(stream, 2);
    bool last = false;
    for (int blocks = 0; !last; ++blocks) {
        last = bits.take(1) != 0;
        const unsigned kind = bits.take(2);
        if (bits.failed() || blocks == kMostBlocks) return std::nullopt;
        const bool good = kind == 0   ? stored_block(bits, out, size)
                          : kind == 1 ? fixed_block(bits, out, size)
                          : kind == 2 ? dynamic_block(bits, out, size)
                                      : false;
        if (!good) return std::nullopt;
    }
    std::uint32_t sum = 0;
    bits.to_byte();
    for (int i = 0; i < 4; ++i) sum = sum << 8 | bits.take(8);
    if (bits.failed() || bits.at() != stream.size() || out.size() != size || sum != adler32(out)) {
        return std::nullopt;
    }
    return out;
}

}  // namespace palette4d
