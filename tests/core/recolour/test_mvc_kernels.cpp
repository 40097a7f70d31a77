// Recolouring many colours at a time, held against one at a time in double precision.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "check.hpp"
#include "images.hpp"
#include "recolour/recolour.hpp"
#include "shapes.hpp"

using namespace palette4d;
using namespace images;
using namespace shapes;

namespace {

struct Subject {
    Mesh mesh;
    std::vector<Vec3> edited;
    Recolourer recolourer() const { return {mesh.rgb, edited, mesh.faces}; }
    /// What errors are measured in: see Precision::kSingle.
    double unit(double strength = 1) const {
        double spread = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            double low = 1e300, high = -1e300;
            for (std::size_t i = 0; i < edited.size(); ++i) {
                low = std::min(low, edited[i][c] - mesh.rgb[i][c]);
                high = std::max(high, edited[i][c] - mesh.rgb[i][c]);
            }
            spread = std::max(spread, high - low);
        }
        return std::max(1.0, std::abs(strength) * spread);
    }
};

Subject edited(Mesh mesh, Random& random) {
    Subject subject{std::move(mesh), {}};
    subject.edited = subject.mesh.rgb;
    for (Vec3& colour : subject.edited) {
        if (random.uniform() < 0.5) continue;
        for (double& x : colour) x += random.uniform(-1, 1);
    }
    subject.edited[0][0] += 0.5;
    return subject;
}

/// Every kind of body that real palettes come near to, and some that they do not.
Mesh body(int kind, Random& random) {
    Mesh mesh;
    switch (kind) {
        case 0:
            return random_convex(random, 4 + random.below(20));
        case 1: {  // thin
            mesh = random_convex(random, 6 + random.below(10));
            const double thickness = std::pow(10, -random.below(5));
            for (Vec3& v : mesh.rgb) v[2] = 0.4 + (v[2] - 0.5) * thickness;
            return mesh;
        }
        case 2:  // not convex
            mesh = concave_cube();
            for (Vec3& v : mesh.rgb) {
                for (double& x : v) x += random.uniform(-0.05, 0.05);
            }
            return mesh;
        case 3: {  // two corners close to each other, as where a colour splits
            mesh = cube();
            const double apart = std::pow(10, -1 - random.below(5));
            for (std::size_t c = 0; c < 3; ++c) {
                mesh.rgb[7][c] = mesh.rgb[3][c] + apart * random.uniform(-1, 1);
            }
            return mesh;
        }
        case 4:
            return cube();  // faces in one plane
        case 5: {           // tiny or huge, and away from the origin
            mesh = random_convex(random, 8);
            const double scale = std::pow(10, random.uniform(-3, 3)), shift = random.uniform(-2, 2);
            for (Vec3& v : mesh.rgb) {
                for (double& x : v) x = x * scale + shift;
            }
            return mesh;
        }
        default:  // faces through each other
            mesh = random_convex(random, 8 + random.below(8));
            for (Vec3& v : mesh.rgb) {
                for (double& x : v) x += random.uniform(-0.15, 0.15);
            }
            return mesh;
    }
}
constexpr int kBodies = 7;

/// Colours inside, outside, on and close to vertices, edges, faces and the planes of faces.
std::vector<float> awkward_colours(const Mesh& mesh, Random& random, int count) {
    Vec3 low = mesh.rgb[0], high = low;
    for (const Vec3& v : mesh.rgb) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], v[c]);
            high[c] = std::max(high[c], v[c]);
        }
    }
    const double size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    std::vector<float> colours;
    for (int i = 0; i < count; ++i) {
        const Face& face = mesh.faces[random.below(static_cast<int>(mesh.faces.size()))];
        const Vec3 &a = mesh.rgb[face[0]], &b = mesh.rgb[face[1]], &c = mesh.rgb[face[2]];
        const double off = size * std::pow(10, -random.uniform(0, 8));
        double u = random.uniform(), v = random.uniform();
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        const double beside_u = random.uniform(-2, 3), beside_v = random.uniform(-2, 3);
        for (std::size_t k = 0; k < 3; ++k) {
            const double on_face = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
            const double on_edge = a[k] + u * (b[k] - a[k]);
            const double in_plane = a[k] + beside_u * (b[k] - a[k]) + beside_v * (c[k] - a[k]);
            const double step = off * random.uniform(-1, 1);
            const double values[] = {random.uniform(low[k], high[k]),
                                     random.uniform(-0.5, 1.5),
                                     on_face,
                                     on_face + step,
                                     on_edge,
                                     on_edge + step,
                                     a[k],
                                     a[k] + step,
                                     in_plane + 0.01 * step,
                                     std::floor(random.uniform() * 256) / 255};
            colours.push_back(static_cast<float>(values[i % 10]));
        }
    }
    return colours;
}

/// The packed rows of an image without alpha, recoloured.
std::vector<float> recoloured(const Recolourer& recolourer, const std::vector<float>& colours,
                              const RecolourOptions& options, RecolourCounts* counts = nullptr,
                              int channels = 3) {
    std::vector<float> result(colours.size());
    const int width = static_cast<int>(colours.size()) / channels;
    const auto row = static_cast<std::ptrdiff_t>(colours.size() * sizeof(float));
    const RecolourCounts found =
        recolourer.apply({colours.data(), width, 1, channels, row},
                         {result.data(), width, 1, channels, row}, options);
    if (counts) {
        counts->single += found.single;
        counts->twofold += found.twofold;
        counts->one += found.one;
    }
    return result;
}

RecolourOptions with(Precision precision, double strength = 1) {
    RecolourOptions options;
    options.precision = precision;
    options.strength = strength;
    return options;
}

/// The largest difference beyond half a unit in the last place.
double worst(const std::vector<float>& found, const std::vector<float>& expected) {
    double most = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double apart = std::abs(static_cast<double>(found[i]) - expected[i]);
        if (!(apart >= 0)) return 1e300;  // not a number
        most = std::max(most, apart - 6e-8 * std::abs(expected[i]));
    }
    return most;
}

}  // namespace

TEST(the_error_stays_below_the_promise_everywhere) {
    Random random(1);
    RecolourCounts counts;
    for (int round = 0; round < 20 * kBodies; ++round) {
        const Subject subject = edited(body(round % kBodies, random), random);
        const Recolourer recolourer = subject.recolourer();
        const std::vector<float> colours = awkward_colours(subject.mesh, random, 1000);
        const double strength = round % 3 == 0 ? random.uniform(-2, 2) : 1.0;
        const auto single =
            recoloured(recolourer, colours, with(Precision::kSingle, strength), &counts);
        const auto twofold = recoloured(recolourer, colours, with(Precision::kDouble, strength));
        CHECK(worst(single, twofold) <= kSingleTolerance * subject.unit(strength));
    }
    // Every way of computing was needed, even for what was chosen to be awkward.
    CHECK(counts.single > 40000);
    CHECK(counts.twofold > 1000);
    CHECK(counts.one > 1000);
}

TEST(ordinary_colours_take_the_fast_way) {
    Random random(2);
    RecolourCounts counts;
    for (const Mesh& mesh : {cube(), random_convex(random, 8), concave_cube()}) {
        const Recolourer recolourer = edited(mesh, random).recolourer();
        std::vector<float> colours;
        for (int i = 0; i < 30000; ++i) colours.push_back(static_cast<float>(random.uniform()));
        recoloured(recolourer, colours, with(Precision::kSingle), &counts);
    }
    CHECK_EQUAL(counts.single + counts.twofold + counts.one, 30000);
    CHECK(counts.single > 29500);
    CHECK(counts.one < 10);
}

TEST(the_error_stays_below_the_promise_for_premultiplied_colours) {
    Random random(3);
    for (int round = 0; round < 3 * kBodies; ++round) {
        const Subject subject = edited(body(round % kBodies, random), random);
        const Recolourer recolourer = subject.recolourer();
        const std::vector<float> straight = awkward_colours(subject.mesh, random, 700);
        std::vector<float> colours;
        for (std::size_t i = 0; i < straight.size(); i += 3) {
            const auto alpha = static_cast<float>(random.uniform(0.01, 1));
            for (std::size_t c = 0; c < 3; ++c) colours.push_back(alpha * straight[i + c]);
            colours.push_back(alpha);
        }
        RecolourOptions options = with(Precision::kSingle);
        options.premultiplied = true;
        const auto single = recoloured(recolourer, colours, options, nullptr, 4);
        options.precision = Precision::kDouble;
        const auto twofold = recoloured(recolourer, colours, options, nullptr, 4);
        CHECK(worst(single, twofold) <= kSingleTolerance * subject.unit());
    }
}

TEST(palettes_without_a_body_keep_the_promise) {
    Random random(4);
    const Mesh one{{{0.2, 0.4, 0.6}}, {}}, two{{{0, 0, 0}, {1, 1, 0.9}}, {}};
    for (const Mesh& mesh : {one, two, flat_square(), flat_triangle()}) {
        const Subject subject = edited(mesh, random);
        const Recolourer recolourer = subject.recolourer();
        std::vector<float> colours;
        for (int i = 0; i < 6000; ++i) {
            colours.push_back(static_cast<float>(random.uniform(-0.3, 1.3)));
            // In the square's own plane, too.
            if (i % 6 == 2) colours.back() = 0.5f;
        }
        CHECK(worst(recoloured(recolourer, colours, with(Precision::kSingle)),
                    recoloured(recolourer, colours, with(Precision::kDouble))) <=
              kSingleTolerance * subject.unit());
    }
}

TEST(numbers_at_the_ends_of_the_range_keep_the_promise) {
    Random random(5);
    const Subject subject = edited(cube(), random);
    const Recolourer recolourer = subject.recolourer();
    std::vector<float> colours;
    const float ends[] = {0.0f, -0.0f, 1e-45f, 1e-38f, 1e-20f,  1e-9f,   1.0f,  1 + 1.2e-7f,
                          1e3f, 1e9f,  1e20f,  3e38f,  -1e-45f, -1e-20f, -1.0f, -3e38f};
    for (const float r : ends) {
        for (const float g : ends) {
            for (const float b : ends) colours.insert(colours.end(), {r, g, b});
        }
    }
    CHECK(worst(recoloured(recolourer, colours, with(Precision::kSingle)),
                recoloured(recolourer, colours, with(Precision::kDouble))) <=
          kSingleTolerance * subject.unit());
}

TEST(all_instruction_sets_give_the_same_bits) {
    Random random(6);
    CHECK(!instruction_sets().empty());
    CHECK(instruction_sets().front() == InstructionSet::kBaseline);
    for (int round = 0; round < 4 * kBodies; ++round) {
        const Subject subject = edited(body(round % kBodies, random), random);
        const Recolourer recolourer = subject.recolourer();
        const std::vector<float> colours = awkward_colours(subject.mesh, random, 500);
        RecolourOptions options = with(Precision::kSingle);
        options.instructions = InstructionSet::kBaseline;
        const std::vector<float> expected = recoloured(recolourer, colours, options);
        for (const InstructionSet set : instruction_sets()) {
            options.instructions = set;
            CHECK(same_bits(recoloured(recolourer, colours, options), expected));
        }
    }
}

TEST(instructions_that_are_not_there_are_refused) {
    const std::vector<InstructionSet>& there = instruction_sets();
    for (const InstructionSet set :
         {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
        if (std::find(there.begin(), there.end(), set) != there.end()) {
            CHECK(resolved(set) == set);
        } else {
            CHECK_THROWS(std::invalid_argument, resolved(set));
        }
    }
    // The environment may name one; what it names that is not there changes nothing.
    const char* wanted = std::getenv("PALETTE4D_INSTRUCTIONS");
    const InstructionSet best = resolved(InstructionSet::kBest);
    CHECK(best == there.back() || (wanted && std::string(wanted) == name_of(best)));
}

TEST(a_pixel_does_not_see_its_surroundings) {
    Random random(7);
    for (const bool premultiplied : {false, true}) {
        const Subject subject = edited(concave_cube(), random);
        const Recolourer recolourer = subject.recolourer();
        constexpr int kWidth = 97, kHeight = 13, kChannels = 4;
        std::vector<float> image;
        for (int i = 0; i < kWidth * kHeight * kChannels; ++i) {
            image.push_back(static_cast<float>(random.uniform(-0.2, 1.2)));
            if (i % 31 == 0) image.back() = 0.5f;
            if (i % 499 == 0) image.back() = NAN;
        }
        RecolourOptions options;
        options.premultiplied = premultiplied;
        const auto row = static_cast<std::ptrdiff_t>(kWidth * kChannels * sizeof(float));
        std::vector<float> whole(image.size());
        recolourer.apply({image.data(), kWidth, kHeight, kChannels, row},
                         {whole.data(), kWidth, kHeight, kChannels, row}, options);
        // One pixel after another, tiles of every width, threads, rows upside down, in place, and
        // memory aligned to nothing but floats.
        for (const int tile : {1, 2, 3, 7, 16, 63, 64, 65}) {
            std::vector<float> pieces(image.size());
            for (int y = 0; y < kHeight; ++y) {
                for (int x = 0; x < kWidth; x += tile) {
                    const int at = (y * kWidth + x) * kChannels;
                    const int width = std::min(tile, kWidth - x);
                    recolourer.apply({image.data() + at, width, 1, kChannels, row},
                                     {pieces.data() + at, width, 1, kChannels, row}, options);
                }
            }
            CHECK(same_bits(pieces, whole));
        }
        for (const int threads : {2, 3, 8}) {
            std::vector<float> shared = image;
            options.threads = threads;
            const float* last = shared.data() + (kHeight - 1) * kWidth * kChannels;
            recolourer.apply({last, kWidth, kHeight, kChannels, -row},
                             {const_cast<float*>(last), kWidth, kHeight, kChannels, -row}, options);
            CHECK(same_bits(shared, whole));
        }
        std::vector<float> shifted(image.size() + 3);
        std::copy(image.begin(), image.end(), shifted.begin() + 3);
        recolourer.apply({shifted.data() + 3, kWidth, kHeight, kChannels, row},
                         {shifted.data() + 3, kWidth, kHeight, kChannels, row}, options);
        shifted.erase(shifted.begin(), shifted.begin() + 3);
        CHECK(same_bits(shifted, whole));
    }
}
