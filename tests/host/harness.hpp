// A few lines of test harness, and what the node's tests share: sidecars, pictures, expectations.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/ramps.hpp"
#include "output/drawing.hpp"
#include "recolour/recolour.hpp"
#include "sidecar/sidecar.hpp"
#include "strict_host.hpp"

namespace test {

struct Case {
    const char* name;
    void (*run)();
};
std::vector<Case>& cases();
struct Registration {
    Registration(const char* name, void (*run)()) { cases().push_back({name, run}); }
};
#define TEST(name)                                                       \
    static void name();                                                  \
    static const ::test::Registration registration_##name(#name, &name); \
    static void name()

void failed(const char* file, int line, const std::string& what);
#define CHECK(condition)                                                  \
    do {                                                                  \
        if (!(condition)) ::test::failed(__FILE__, __LINE__, #condition); \
    } while (false)
/// The same with words of one's own.
#define EXPECT(condition, words)                                       \
    do {                                                               \
        if (!(condition)) ::test::failed(__FILE__, __LINE__, (words)); \
    } while (false)

/// A figure of a test, for docs: printed above its line.
void figure(const std::string& what);

/// A step between the many calls that are refused one after the other; 1, for all of them, where
/// PALETTE4D_EVERY_CALL is set, and about twice as long where PALETTE4D_FEW_ROUNDS is: the slow
/// sanitized tests.
long every(long step);

/// The bundle under test, and a folder of the running test's own.
const std::string& bundle();
std::filesystem::path folder();

/// This program.
std::filesystem::path own_file();

/// Writes a file in folder(); its path.
std::string write(const std::string& name, const std::string& text);

/// A sidecar of a box of eight colours over frames 10 to 20, which shrinks towards the end. With
/// `edited`, some corners and a stop change; corners at blue 1 stay as they are.
std::string sidecar_text(bool edited = true);
/// The same with two picks, p1 and p4, and a hold, p3.
std::string text_with_picks(bool edited = true);
/// Without picks, written under a name; its path.
std::string sidecar(const std::string& name = "clip.p4d.json", bool edited = true);
/// A sidecar's text, with scene-linear light in its clip and a log's code values in its palette.
std::string with_conversion(std::string sidecar);

/// Colours inside and outside the palette, below 0 and above 1; for float, NaN and infinities too.
void fill(strict::Picture& picture, unsigned seed = 1, bool odd_values = true);

/// What the core makes of an area of a picture: pixels without gaps, of any depth. Integers go
/// through value / 255 or value / 65535, and come back rounded and clamped. `frame` is the
/// sidecar's, and so is the conversion.
std::vector<unsigned char> recoloured(const palette4d::Sidecar& sidecar, double frame,
                                      const strict::Picture& picture, const OfxRectI& area,
                                      double strength = 1, double clean_up = 1);
/// The same of any drawing.
std::vector<unsigned char> drawn(palette4d::Drawing drawing, const strict::Picture& picture,
                                 const OfxRectI& area);

OfxRectI rect(int x1, int y1, int x2, int y2);

/// A small picture's layouts of either depth, with and without alpha of every kind.
std::vector<strict::Layout> layouts();
/// A picture as fill() makes it, whose premultiplied colours go with its alpha.
strict::Picture source_of(const strict::Layout& layout);
/// Pixels of any depth as floats, and back.
std::vector<float> floats(const strict::Layout& layout, const std::vector<unsigned char>& pixels);
/// How far a number of that size may be from what is stored.
double rounding(strict::Depth depth, double number = 1);
std::vector<unsigned char> stored(const strict::Layout& layout, const std::vector<float>& values);

/// An instance of the node that has a sidecar.
struct Ready {
    strict::Plugin plugin{bundle()};
    std::string path;
    palette4d::Sidecar parsed = palette4d::read_sidecar(path);
    std::unique_ptr<strict::Instance> instance;
    explicit Ready(std::string chosen = test::sidecar(),
                   const std::string& context = kOfxImageEffectContextFilter);
    void set(const std::string& name, strict::Value value) {
        instance->set(name, std::move(value));
    }
    /// As a user does: the host tells of it.
    void change(const std::string& name, strict::Value value);
    /// All pixels of a picture after a render, which succeeds.
    std::vector<unsigned char> render(const strict::Picture& picture, double time) const;
    bool says(const std::string& words) const;  ///< the status
    const std::string& message() const { return instance->effect().persistent_message; }
};

/// The same with a picture of the default layout, as fill() makes it.
struct Shown : Ready {
    strict::Layout layout;
    strict::Picture source{layout};
    template <class... Arguments>
    explicit Shown(Arguments&&... arguments) : Ready(std::forward<Arguments>(arguments)...) {
        fill(source);
    }
    std::vector<unsigned char> render(double time = 2) const { return Ready::render(source, time); }
    std::vector<unsigned char> render(strict::Instance& other, double time = 2) const;
    std::vector<unsigned char> unchanged() const { return source.pixels(layout.bounds); }
    /// As the core recolours it, by the sidecar's edits or others.
    std::vector<unsigned char> edited(double frame = 12) const;
    std::vector<unsigned char> edited(const palette4d::Edits& edits, double frame) const;
};

}  // namespace test
