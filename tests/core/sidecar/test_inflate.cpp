#include "sidecar/inflate.hpp"

#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "check.hpp"

using namespace palette4d;

namespace {

// What zlib 1.2.13 makes of kText and of dice().
/// Level 0: one stored block.
const unsigned char kStored[] = {
    0x78, 0x01, 0x01, 0x3e, 0x00, 0xc1, 0xff, 0x74, 0x6f, 0x20, 0x62, 0x65, 0x2c, 0x20, 0x6f,
    0x72, 0x20, 0x6e, 0x6f, 0x74, 0x20, 0x74, 0x6f, 0x20, 0x62, 0x65, 0x3a, 0x20, 0x74, 0x68,
    0x61, 0x74, 0x20, 0x69, 0x73, 0x20, 0x74, 0x68, 0x65, 0x20, 0x71, 0x75, 0x65, 0x73, 0x74,
    0x69, 0x6f, 0x6e, 0x3b, 0x20, 0x74, 0x6f, 0x20, 0x62, 0x65, 0x2c, 0x20, 0x6f, 0x72, 0x20,
    0x6e, 0x6f, 0x74, 0x20, 0x74, 0x6f, 0x20, 0x62, 0x65, 0x92, 0xa1, 0x15, 0x00};
/// Level 9 and Z_FIXED: one block with the fixed codes, with copies.
const unsigned char kFixed[] = {0x78, 0x01, 0x2b, 0xc9, 0x57, 0x48, 0x4a, 0xd5, 0x51, 0xc8,
                                0x2f, 0x52, 0xc8, 0xcb, 0x2f, 0x51, 0x28, 0x01, 0xf1, 0xac,
                                0x14, 0x4a, 0x32, 0x12, 0x4b, 0x14, 0x32, 0x8b, 0x81, 0x74,
                                0xaa, 0x42, 0x61, 0x69, 0x6a, 0x71, 0x49, 0x66, 0x7e, 0x9e,
                                0x35, 0x44, 0x12, 0x55, 0x29, 0x00, 0x92, 0xa1, 0x15, 0x00};
/// Level 9: one block with codes of its own, with repeated code lengths.
const unsigned char kDynamic[] = {
    0x78, 0xda, 0x45, 0x90, 0x0b, 0x0a, 0x03, 0x30, 0x08, 0x43, 0xe3, 0x2f, 0x48, 0xf1, 0xfe, 0xe7,
    0x5d, 0x94, 0xb1, 0x15, 0x4a, 0x5b, 0x4d, 0xf4, 0xd5, 0xa8, 0x01, 0x1e, 0x1a, 0x70, 0x00, 0xd9,
    0xae, 0x63, 0x90, 0xfb, 0x08, 0x63, 0x28, 0x5c, 0x09, 0x18, 0x2e, 0xff, 0x36, 0xaa, 0x43, 0xd7,
    0x8a, 0x90, 0x0e, 0xe3, 0x2b, 0xf6, 0x84, 0x39, 0x68, 0xa5, 0x3c, 0x53, 0x62, 0x3a, 0x72, 0xa0,
    0xdc, 0x6f, 0x85, 0x65, 0xcb, 0x1f, 0xeb, 0x84, 0x2a, 0xe6, 0x37, 0x3c, 0xf2, 0x3f, 0x57, 0x2d,
    0xc9, 0x51, 0xdb, 0x61, 0x18, 0xaa, 0x9f, 0x96, 0x92, 0x84, 0xb6, 0x88, 0x28, 0x79, 0xaf, 0x3c,
    0x69, 0xb3, 0xed, 0x9f, 0x88, 0xce, 0x01, 0xbb, 0x42, 0x92, 0x50, 0x04, 0x12, 0x65, 0xb1, 0x71,
    0x37, 0x3c, 0x8a, 0x4c, 0x20, 0x50, 0x25, 0x43, 0x06, 0x6a, 0xc8, 0xb7, 0xb5, 0x50, 0xfd, 0x87,
    0x7b, 0xe5, 0x42, 0x36, 0x36, 0x9d, 0x44, 0xdd, 0x37, 0xc7, 0x97, 0x14, 0xb3, 0xff, 0xee, 0x24,
    0x0b, 0xec, 0x1b, 0x51, 0xd5, 0x79, 0x66, 0x11, 0xc7, 0xd3, 0x5b, 0x1b, 0x93, 0x0a, 0xdf, 0xc8,
    0xdc, 0x6b, 0x55, 0xbd, 0x63, 0x52, 0x23, 0x3f, 0xfc, 0xcc, 0x5a, 0x7d, 0x9b, 0x70, 0x46, 0xb9,
    0xb7, 0xc8, 0xe6, 0xc5, 0x03, 0x3f, 0x6f, 0x51, 0x6b, 0x64, 0x9e, 0x0f, 0x62, 0x59, 0x04, 0x97};

const std::string kText = "to be, or not to be: that is the question; to be, or not to be";

std::string dice() {
    std::string found;
    std::uint32_t x = 1;
    const auto next = [&] { return (x = (x * 1103515245u + 12345u) & 0x7fffffffu) >> 16; };
    for (int i = 0; i < 400; ++i) {
        const std::uint32_t first = next() % 7;
        found += static_cast<char>(first * (next() % 3));
    }
    return found;
}

template <std::size_t N>
std::string bytes(const unsigned char (&array)[N]) {
    return {std::begin(array), std::end(array)};
}

std::string text_of(const std::string& stream, std::size_t size) {
    const auto found = inflated(stream, size);
    return found ? std::string(found->begin(), found->end()) : "(refused)";
}

bool refused(const std::string& stream, std::size_t size) { return !inflated(stream, size); }

/// A zlib stream written bit by bit, the lowest of each byte first.
class Stream {
public:
    Stream& number(unsigned value, int count) {
        for (int i = 0; i < count; ++i) bit(value >> i & 1);
        return *this;
    }
    /// Huffman codes have their highest bit first.
    Stream& code(unsigned value, int count) {
        for (int i = count - 1; i >= 0; --i) bit(value >> i & 1);
        return *this;
    }
    Stream& block(unsigned kind, bool last = true) { return number(last, 1).number(kind, 2); }
    /// With the checksum of `text`.
    std::string end(const std::string& text) {
        while (count_ % 8) bit(0);
        std::uint32_t a = 1, b = 0;
        for (const char c : text) {
            a = (a + static_cast<unsigned char>(c)) % 65521;
            b = (b + a) % 65521;
        }
        std::string stream = "\x78\x9c" + bytes_;
        for (const std::uint32_t half : {b, a}) {
            stream += static_cast<char>(half >> 8);
            stream += static_cast<char>(half & 0xff);
        }
        return stream;
    }

private:
    void bit(unsigned value) {
        if (count_ % 8 == 0) bytes_ += '\0';
        bytes_.back() =
            static_cast<char>(static_cast<unsigned char>(bytes_.back()) | value << count_ % 8);
        ++count_;
    }

    std::string bytes_;
    int count_ = 0;
};

/// The fixed code of a literal up to 143, and of the symbols from 256 to 279.
constexpr unsigned literal(char c) { return 0x30u + static_cast<unsigned char>(c); }

}  // namespace

TEST(streams_of_zlib_are_read) {
    CHECK_EQUAL(text_of(bytes(kStored), kText.size()), kText);
    CHECK_EQUAL(text_of(bytes(kFixed), kText.size()), kText);
    CHECK_EQUAL(text_of(bytes(kDynamic), 400), dice());
    CHECK_EQUAL(text_of(Stream().block(1).code(0, 7).end(""), 0), std::string());
}

TEST(blocks_follow_each_other) {
    const std::string two = Stream()
                                .block(1, false)
                                .code(literal('a'), 8)
                                .code(0, 7)
                                .block(1)
                                .code(literal('b'), 8)
                                .code(1, 7)  // a length of 3
                                .code(1, 5)  // back by 2
                                .code(0, 7)
                                .end("ababa");
    CHECK_EQUAL(text_of(two, 5), std::string("ababa"));
    // zlib makes empty ones when it is flushed. Thousands are no use but to take time.
    for (const int count : {100, 5000}) {
        Stream empty;
        for (int i = 0; i < count; ++i) empty.block(1, false).code(0, 7);
        const std::string stream = empty.block(1).code(0, 7).end("");
        CHECK_EQUAL(refused(stream, 0), count > 1000);
    }
}

TEST(a_copy_may_overlap_itself) {
    const auto copied = [](unsigned back) {
        return Stream()
            .block(1)
            .code(literal('a'), 8)
            .code(literal('b'), 8)
            .code(2, 7)  // a length of 4
            .code(back, 5)
            .code(0, 7)
            .end(back == 0 ? "abbbbb" : "ababab");
    };
    CHECK_EQUAL(text_of(copied(0), 6), std::string("abbbbb"));
    CHECK_EQUAL(text_of(copied(1), 6), std::string("ababab"));
    CHECK(refused(copied(2), 6));   // before the start
    CHECK(refused(copied(29), 6));  // far before it: more bits follow than there are
    CHECK(refused(copied(30), 6) && refused(copied(31), 6));  // no distances
}

TEST(another_size_is_refused) {
    for (const std::string& stream : {bytes(kStored), bytes(kFixed)}) {
        for (const std::size_t size : {std::size_t{0}, std::size_t{1}, kText.size() - 1,
                                       kText.size() + 1, std::size_t{100'000}}) {
            CHECK(refused(stream, size));
        }
    }
    CHECK(refused(bytes(kDynamic), 399) && refused(bytes(kDynamic), 401));
}

TEST(every_truncation_and_what_follows_is_refused) {
    for (const std::string& stream : {bytes(kStored), bytes(kFixed), bytes(kDynamic)}) {
        const std::size_t size = stream.size() > 150 ? 400 : kText.size();
        CHECK(!refused(stream, size));
        for (std::size_t length = 0; length < stream.size(); ++length) {
            CHECK(refused(stream.substr(0, length), size));
        }
        CHECK(refused(stream + '\0', size) && refused(stream + stream, size));
    }
}

TEST(every_damaged_bit_is_refused) {
    // But for bits that mean nothing: they pad the last byte before the checksum, and the header
    // has a level. The checksum sees all others.
    for (const std::string& stream : {bytes(kStored), bytes(kFixed), bytes(kDynamic)}) {
        const std::size_t size = stream.size() > 150 ? 400 : kText.size();
        int accepted = 0;
        for (std::size_t bit = 16; bit < 8 * stream.size(); ++bit) {
            std::string damaged = stream;
            damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
            accepted += !refused(damaged, size);
        }
        CHECK(accepted <= 7);
    }
}

TEST(a_damaged_header_is_refused) {
    const std::string good = bytes(kFixed);
    const auto with = [&](int first, int second) {
        std::string other = good;
        other[0] = static_cast<char>(first);
        other[1] = static_cast<char>(second);
        return other;
    };
    CHECK(!refused(with(0x78, 0xda), kText.size()));
    CHECK(refused(with(0x78, 0x02), kText.size()));  // no multiple of 31
    CHECK(refused(with(0x79, 0x1a), kText.size()));  // another method
    CHECK(refused(with(0x78, 0x20), kText.size()));  // a dictionary
    CHECK(refused(with(0x88, 0x1c), kText.size()));  // a window that zlib refuses
    CHECK(refused("", 0) && refused("x", 0));
}

TEST(impossible_blocks_are_refused) {
    CHECK(refused(Stream().block(3).end(""), 0));
    CHECK(refused(Stream().block(1).code(0xc6, 8).code(0, 7).end(""), 0));  // symbol 286
    CHECK(refused(Stream().block(0).number(0, 5).number(1, 16).number(1, 16).end("a"), 1));
}

TEST(impossible_codes_are_refused) {
    /// A block with codes of its own; the lengths of the code of code lengths, as they are stored.
    const auto dynamic = [](unsigned literals, unsigned distances,
                            const std::vector<unsigned>& lengths) {
        Stream stream;
        stream.block(2)
            .number(literals, 5)
            .number(distances, 5)
            .number(static_cast<unsigned>(lengths.size()) - 4, 4);
        for (const unsigned length : lengths) stream.number(length, 3);
        return stream;
    };
    // Stored first are the lengths of 16, 17, 18, 0.
    CHECK(refused(dynamic(0, 0, {1, 1, 1, 0}).end(""), 0));   // three codes of one bit
    CHECK(refused(dynamic(30, 0, {1, 1, 0, 0}).end(""), 0));  // 287 literals
    CHECK(refused(dynamic(0, 30, {1, 1, 0, 0}).end(""), 0));  // 31 distances
    // Lengths of codes: code 0 is 16, to repeat the last one, and there is none.
    CHECK(refused(dynamic(0, 0, {1, 1, 0, 0}).code(0, 1).number(0, 2).end(""), 0));
    // Code 1 is 18, zeros: as many as there are lengths, and too many.
    const auto zeros = [&](unsigned first, unsigned second) {
        Stream stream = dynamic(0, 0, {0, 1, 1, 0});
        stream.code(1, 1).number(first - 11, 7).code(1, 1).number(second - 11, 7);
        return stream.end("");
    };
    CHECK(refused(zeros(138, 120), 0));  // 258: no literal has a code, not even the end
    CHECK(refused(zeros(138, 138), 0));
    CHECK(refused(dynamic(0, 0, {0, 0, 0, 0}).number(0, 16).end(""), 0));  // no codes at all
}

TEST(base64_is_read_with_its_padding) {
    const auto text = [](const std::string& coded) {
        return from_base64(coded).value_or("(refused)");
    };
    CHECK_EQUAL(text(""), std::string());
    CHECK_EQUAL(text("Zg=="), std::string("f"));
    CHECK_EQUAL(text("Zm8="), std::string("fo"));
    CHECK_EQUAL(text("Zm9v"), std::string("foo"));
    CHECK_EQUAL(text("Zm9vYmFy"), std::string("foobar"));
    CHECK_EQUAL(text("+/+/"), std::string("\xfb\xff\xbf"));
    for (const char* bad : {"Z", "Zg", "Zg=", "=", "====", "Z===", "Zg==Zg==", "Z=g=", "Zm9\n",
                            "Zm 9", "Zm9-", "Zm9_", "Zm9\xff", "Zm9v\n"}) {
        CHECK(!from_base64(bad));
    }
    CHECK(!from_base64(std::string("Zm9\0", 4)));
}
