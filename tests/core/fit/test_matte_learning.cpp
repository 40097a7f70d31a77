#include "fit/matte_learning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;
using shapes::Random;

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// A picture, and what is asked of it.
struct Frame {
    int width, height;
    std::vector<float> pixels;

    Frame(int w, int h, const Vec3& colour)
        : width(w),
          height(h),
          pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3) {
        for (std::size_t i = 0; i < pixels.size(); ++i)
            pixels[i] = static_cast<float>(colour[i % 3]);
    }
    float* at(int x, int y) {
        return &pixels[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x))];
    }
    /// A square with soft edges, `soft` pixels wide.
    void square(int left, int top, int size, double soft, const Vec3& colour) {
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const double inside = std::min(
                    {x + 0.5 - left, left + size - x - 0.5, y + 0.5 - top, top + size - y - 0.5});
                const double part = std::clamp(inside / soft + 0.5, 0.0, 1.0);
                for (std::size_t c = 0; c < 3; ++c) {
                    float& value = at(x, y)[c];
                    value += static_cast<float>(part * (colour[c] - static_cast<double>(value)));
                }
            }
        }
    }
    void add_noise(std::uint64_t seed, double size) {
        Random random(seed);
        for (float& value : pixels) value += static_cast<float>(random.uniform(-size, size));
    }
    LearningFrame frame(const Vec3& colour, std::vector<Brush> object = {},
                        std::vector<Brush> others = {}) const {
        return {pixels.data(),
                width,
                height,
                static_cast<std::ptrdiff_t>(width) * 12,
                colour,
                std::move(object),
                std::move(others),
                true};
    }
};

double membership(const LearnedMatte& matte, const Vec3& colour) {
    return MatteGrid::at(matte.membership.data(), pick_point(colour));
}

bool sound(const LearnedMatte& matte) {
    return matte.membership.size() == MatteGrid::kSize &&
           std::all_of(matte.membership.begin(), matte.membership.end(),
                       [](float m) { return m >= 0 && m <= 1; }) &&
           matte.share >= 0 && matte.share <= 1;
}

const Vec3 kShirt{0.65, 0.25, 0.2}, kWall{0.35, 0.45, 0.4}, kSkin{0.75, 0.55, 0.45};

/// A shirt of 80 pixels before a wall, with skin beside it.
Frame shirt() {
    Frame scene(320, 180, kWall);
    scene.square(60, 50, 80, 6, kShirt);
    scene.square(220, 50, 60, 6, kSkin);
    scene.add_noise(1, 0.01);
    return scene;
}

const std::vector<Brush> kOnShirt = {{{{100, 90}, {110, 95}}, 4}};

}  // namespace

TEST(an_object_is_told_from_its_background) {
    const Frame scene = shirt();
    const LearnedMatte matte = learn_matte({scene.frame(kShirt, kOnShirt)}, kShirt, {}, nullptr);
    CHECK(sound(matte) && matte.found);
    CHECK_NEAR(matte.share, 80.0 * 80 / (320 * 180), 0.02);
    CHECK(membership(matte, kShirt) > 0.95);
    CHECK(membership(matte, kWall) < 0.05);
    CHECK(membership(matte, kSkin) < 0.05);
    // Colours that the frame has not: by their hue.
    CHECK(membership(matte, {0.3, 0.1, 0.08}) > 0.5);
    CHECK(membership(matte, {0.1, 0.3, 0.6}) < 0.05);
    // Half of the shirt, half of the wall: the soft edge, whose amount is a half already.
    CHECK(membership(matte, 0.5 * (kShirt + kWall)) > 0.5);
}

TEST(without_areas_the_colour_is_looked_for) {
    const Frame scene = shirt();
    const LearnedMatte matte = learn_matte({scene.frame(kShirt)}, kShirt, {}, nullptr);
    CHECK(sound(matte) && matte.found);
    CHECK_NEAR(matte.share, 80.0 * 80 / (320 * 180), 0.02);
    CHECK(membership(matte, kShirt) > 0.95 && membership(matte, kSkin) < 0.05);
    // A colour that is nowhere near.
    const Vec3 blue{0.1, 0.2, 0.8};
    const LearnedMatte nowhere = learn_matte({scene.frame(blue)}, blue, {}, nullptr);
    CHECK(sound(nowhere) && !nowhere.found && nowhere.share == 0);
}

TEST(what_is_not_connected_is_background) {
    // A second square of nearly the same colour.
    const Vec3 brick{0.6, 0.35, 0.27};
    Frame scene(320, 180, kWall);
    scene.square(60, 50, 80, 4, kShirt);
    scene.square(200, 50, 80, 4, brick);
    scene.add_noise(2, 0.005);
    const LearnedMatte matte = learn_matte({scene.frame(kShirt, kOnShirt)}, kShirt, {}, nullptr);
    CHECK_NEAR(matte.share, 80.0 * 80 / (320 * 180), 0.02);
    CHECK(membership(matte, kShirt) > 0.9 && membership(matte, brick) < 0.4);
}

TEST(areas_of_the_background_take_colours_away) {
    Frame scene(320, 180, kWall);
    scene.square(40, 40, 100, 4, kShirt);
    const Vec3 pocket{0.55, 0.3, 0.28};
    scene.square(110, 60, 40, 2, pocket);
    scene.add_noise(3, 0.005);
    const std::vector<Brush> object = {{{{70, 90}}, 5}}, others = {{{{130, 80}}, 15}};
    const LearnedMatte with = learn_matte({scene.frame(kShirt, object)}, kShirt, {}, nullptr),
                       without =
                           learn_matte({scene.frame(kShirt, object, others)}, kShirt, {}, nullptr);
    CHECK(membership(with, pocket) > membership(without, pocket) + 0.2);
    CHECK(membership(without, kShirt) > 0.9);
    CHECK(without.share < with.share);
}

TEST(an_area_of_another_shade_adds_what_is_connected_with_it) {
    Frame scene(320, 180, kWall);
    scene.square(40, 40, 80, 4, kShirt);
    const Vec3 faded{0.62, 0.5, 0.47};  // less than half the shirt's saturation
    scene.square(200, 40, 80, 4, faded);
    scene.add_noise(5, 0.005);
    const std::vector<Brush> one = {{{{70, 90}}, 5}}, both = {{{{70, 90}}, 5}, {{{215, 55}}, 3}};
    const LearnedMatte without = learn_matte({scene.frame(kShirt, one)}, kShirt, {}, nullptr),
                       with = learn_matte({scene.frame(kShirt, both)}, kShirt, {}, nullptr);
    CHECK(membership(without, faded) < 0.2 && membership(with, faded) > 0.9);
    CHECK_NEAR(with.share, 2 * without.share, 0.02);
    CHECK(membership(with, kWall) < 0.05);
}

TEST(a_thing_of_the_background_is_taken_away_with_its_shadows) {
    // A face that grows as dark as the shirt, and whose hue is near.
    Frame scene(320, 180, kWall);
    scene.square(20, 70, 100, 4, kShirt);
    const Vec3 lit{0.95, 0.6, 0.42};
    for (int y = 20; y < 160; ++y) {
        for (int x = 120; x < 300; ++x) {
            for (std::size_t c = 0; c < 3; ++c) {
                scene.at(x, y)[c] = static_cast<float>(lit[c] * (0.6 + 0.4 * (x - 120) / 180));
            }
        }
    }
    scene.add_noise(6, 0.005);
    const std::vector<Brush> object = {{{{60, 120}}, 5}}, others = {{{{290, 90}}, 5}};
    const LearnedMatte matte =
        learn_matte({scene.frame(kShirt, object, others)}, kShirt, {}, nullptr);
    CHECK(membership(matte, 0.65 * lit) < 0.2);
    CHECK(membership(matte, kShirt) > 0.9);
    CHECK_NEAR(matte.share, 100.0 * 100 / (320 * 180), 0.02);
}

TEST(held_colours_are_left_out) {
    const Frame scene = shirt();
    const Vec3 shade = 0.5 * kShirt;
    const auto frame = scene.frame(kShirt, kOnShirt);
    const LearnedMatte free = learn_matte({frame}, kShirt, {}, nullptr),
                       held = learn_matte({frame}, kShirt, {shade}, nullptr);
    CHECK(membership(free, shade) > 0.5 && membership(held, shade) < 0.1);
    CHECK(membership(held, kShirt) > 0.9);
}

TEST(an_area_wins_over_a_hold_of_a_farther_colour) {
    Frame scene(320, 180, kWall);
    scene.square(40, 40, 100, 4, kShirt);
    const Vec3 worn{0.58, 0.42, 0.3}, hair{0.55, 0.44, 0.28};
    scene.square(200, 40, 60, 4, worn);
    scene.add_noise(7, 0.005);
    const std::vector<Brush> one = {{{{70, 90}}, 5}}, both = {{{{70, 90}}, 5}, {{{230, 70}}, 5}};
    const LearnedMatte without = learn_matte({scene.frame(kShirt, one)}, kShirt, {hair}, nullptr),
                       with = learn_matte({scene.frame(kShirt, both)}, kShirt, {hair}, nullptr);
    CHECK(membership(without, worn) < 0.1 && membership(with, worn) > 0.5);
    CHECK(membership(with, hair) < 0.5 * membership(with, worn));
}

TEST(other_frames_add_what_they_show) {
    const Frame first = shirt();
    // Later a car has the shirt's colour nearly, and the shirt has moved.
    const Vec3 car{0.7, 0.32, 0.15};
    Frame second(320, 180, {0.6, 0.6, 0.55});
    second.square(30, 60, 80, 4, kShirt);
    second.square(160, 30, 130, 4, car);
    second.add_noise(4, 0.01);
    LearningFrame later = second.frame(kShirt);
    later.seeded = false;
    const auto start = first.frame(kShirt, kOnShirt);
    const LearnedMatte alone = learn_matte({start}, kShirt, {}, nullptr),
                       both = learn_matte({start, later}, kShirt, {}, nullptr);
    CHECK(sound(both) && both.found);
    CHECK_NEAR(both.share, alone.share, 0.01);  // of the first frame
    CHECK(membership(both, car) < membership(alone, car));
    CHECK(membership(both, kShirt) > 0.9);
}

TEST(a_colour_that_moves_is_learned_where_it_was_picked) {
    const Frame first = shirt();
    const Vec3 dusk = 0.6 * kShirt;
    Frame second(320, 180, 0.6 * kWall);
    second.square(60, 50, 80, 6, dusk);
    second.add_noise(5, 0.005);
    LearningFrame later = second.frame(dusk, kOnShirt);
    const LearnedMatte matte =
        learn_matte({first.frame(kShirt, kOnShirt), later}, kShirt, {}, nullptr);
    CHECK(sound(matte) && membership(matte, kShirt) > 0.9 && membership(matte, kWall) < 0.1);
}

TEST(a_display_curve_leads_to_the_same_matte) {
    Frame scene = shirt();
    const LearnedMatte plain = learn_matte({scene.frame(kShirt, kOnShirt)}, kShirt, {}, nullptr);
    // The same picture in twice the code values.
    for (float& value : scene.pixels) value *= 2;
    const DisplayCurve half{0, 4, {0, 2}};
    const LearnedMatte doubled =
        learn_matte({scene.frame(2 * kShirt, kOnShirt)}, 2 * kShirt, {}, &half);
    double largest = 0;
    for (std::size_t i = 0; i < MatteGrid::kSize; ++i) {
        const double difference = plain.membership[i] - doubled.membership[i];
        largest = std::max(largest, std::abs(difference));
    }
    CHECK(largest < 0.01);
}

TEST(learning_is_repeatable_and_takes_any_rows) {
    const Frame scene = shirt();
    const LearnedMatte once = learn_matte({scene.frame(kShirt, kOnShirt)}, kShirt, {}, nullptr);
    // Upside down, with room at the end of each row.
    std::vector<float> padded(180 * 1000, kNone);
    for (int y = 0; y < 180; ++y) {
        std::copy_n(&scene.pixels[static_cast<std::size_t>(y) * 960], 960,
                    &padded[static_cast<std::size_t>(179 - y) * 1000]);
    }
    LearningFrame frame = scene.frame(kShirt, kOnShirt);
    frame.pixels = &padded[179 * 1000];
    frame.row_bytes = -4000;
    const LearnedMatte again = learn_matte({frame}, kShirt, {}, nullptr);
    CHECK(once.membership == again.membership && once.share == again.share);
}

TEST(large_frames_are_reduced) {
    const Frame small = shirt();
    Frame large(1280, 720, {0, 0, 0});
    for (int y = 0; y < 720; ++y) {
        for (int x = 0; x < 1280; ++x) {
            const std::size_t at =
                3 * (static_cast<std::size_t>(y / 4) * 320 + static_cast<std::size_t>(x / 4));
            std::copy_n(&small.pixels[at], 3, large.at(x, y));
        }
    }
    const std::vector<Brush> areas = {{{{400, 360}, {440, 380}}, 16}};
    const LearnedMatte matte = learn_matte({large.frame(kShirt, areas)}, kShirt, {}, nullptr);
    CHECK_NEAR(matte.share, 80.0 * 80 / (320 * 180), 0.02);
    CHECK(membership(matte, kShirt) > 0.95 && membership(matte, kSkin) < 0.05);
}

TEST(many_points_that_cover_a_tall_frame_are_as_one) {
    // Pixel by pixel these took half an hour.
    Frame scene(64, 20'000, kWall);
    scene.add_noise(8, 0.01);
    Brush one{{{32, 10'000}}, 1e5}, many{{}, 1e5};
    for (int i = 0; i < 100'000; ++i) {
        many.points.push_back({static_cast<double>(i % 64), static_cast<double>(i % 20'000)});
    }
    const LearnedMatte same = learn_matte({scene.frame(kWall, {one})}, kWall, {}, nullptr),
                       matte = learn_matte({scene.frame(kWall, {many})}, kWall, {}, nullptr);
    CHECK(sound(matte) && matte.found);
    CHECK(matte.membership == same.membership && matte.share == same.share);
}

TEST(a_frame_of_one_colour_is_all_object) {
    const Frame scene(64, 36, kShirt);
    const LearnedMatte matte =
        learn_matte({scene.frame(kShirt, {{{{10, 10}}, 2}})}, kShirt, {}, nullptr);
    CHECK(sound(matte) && matte.found);
    CHECK_EQUAL(matte.share, 1.0);
    CHECK(membership(matte, kShirt) > 0.9);
}

TEST(frames_of_a_pixel_or_a_line_are_frames) {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {2, 1}, {1, 5}, {500, 1}, {1, 500}, {481, 2}}) {
        const Frame scene(width, height, kShirt);
        for (const std::vector<Brush>& areas : {std::vector<Brush>{}, {{{{0, 0}}, 1}}}) {
            const LearnedMatte matte =
                learn_matte({scene.frame(kShirt, areas)}, kShirt, {}, nullptr);
            CHECK(sound(matte) && matte.found);
        }
    }
}

TEST(pixels_without_a_colour_do_not_count) {
    Frame scene = shirt();
    for (int y = 0; y < 180; ++y) {
        for (int x = 0; x < 320; ++x) {
            if ((x + y) % 3 == 0) scene.at(x, y)[y % 3] = kNone;
            if (x > 290) scene.at(x, y)[1] = std::numeric_limits<float>::infinity();
        }
    }
    const LearnedMatte matte = learn_matte({scene.frame(kShirt)}, kShirt, {}, nullptr);
    CHECK(sound(matte) && matte.found && membership(matte, kWall) < 0.1);
    const Frame empty(50, 40, {std::nan(""), 0, 0});
    const LearnedMatte none =
        learn_matte({empty.frame(kShirt, {{{{10, 10}}, 5}})}, kShirt, {}, nullptr);
    CHECK(sound(none) && !none.found && none.share == 0);
    CHECK(membership(none, kShirt) > 0.9);  // all of the hue
}

TEST(colours_far_from_any_display_are_learned_from) {
    Frame scene = shirt();
    const float odd[] = {3e38f, -3e38f, 1e30f, -1e6f, 1e-42f};
    for (std::size_t i = 0; i < 300; ++i) scene.pixels[i * 101] = odd[i % 5];
    for (const Vec3& colour : {kShirt, Vec3{900, -3, 5}, Vec3{-1, -1, -1}, Vec3{0, 0, 0}}) {
        CHECK(sound(learn_matte({scene.frame(colour)}, colour, {}, nullptr)));
    }
}

TEST(areas_beyond_the_frame_are_clipped) {
    const Frame scene = shirt();
    for (const Brush& area :
         {Brush{{{1000, 1000}}, 5}, Brush{{{-50, -50}, {-1e6, -1e6}}, 3},
          Brush{{{-1e6, 5000}, {1e6, -5000}}, 0}, Brush{{}, 3}, Brush{{{5, 5}}, -3}}) {
        CHECK(sound(learn_matte({scene.frame(kShirt, {area})}, kShirt, {}, nullptr)));
    }
    // One that is larger than the frame has all of it.
    const LearnedMatte all =
        learn_matte({scene.frame(kShirt, {{{{100, 90}}, 1e6}})}, kShirt, {}, nullptr);
    CHECK(sound(all) && all.share > 0.9);
    // Of a long line, what is in the frame.
    const std::vector<Brush> crosses = {{{{100 - 1e6, 90}, {100 + 1e6, 90}}, 2}};
    const LearnedMatte line = learn_matte({scene.frame(kShirt, crosses)}, kShirt, {}, nullptr);
    CHECK(sound(line) && line.found);
    // And many of them take no time.
    std::vector<Brush> many = {{{}, 0}};
    for (int i = 0; i < 20000; ++i) {
        many[0].points.push_back({i % 2 ? 1e6 : -1e6, i % 3 ? 1e6 : 2e5});
    }
    CHECK(sound(learn_matte({scene.frame(kShirt, many)}, kShirt, {}, nullptr)));
}

TEST(what_cannot_be_learned_from_is_refused) {
    const Frame scene = shirt();
    CHECK_THROWS(std::invalid_argument, learn_matte({}, kShirt, {}, nullptr));
    LearningFrame bad = scene.frame(kShirt);
    bad.width = 0;
    CHECK_THROWS(std::invalid_argument, learn_matte({bad}, kShirt, {}, nullptr));
    const double nan = std::nan("");
    for (const Brush& area : {Brush{{{nan, 0}}, 1}, Brush{{{0, 1e300}}, 1}, Brush{{{0, 0}}, nan}}) {
        CHECK_THROWS(std::invalid_argument,
                     learn_matte({scene.frame(kShirt, {area})}, kShirt, {}, nullptr));
        CHECK_THROWS(std::invalid_argument,
                     learn_matte({scene.frame(kShirt, {}, {area})}, kShirt, {}, nullptr));
    }
    // A first frame that shows no object teaches nothing.
    LearningFrame unseeded = scene.frame(kShirt);
    unseeded.seeded = false;
    CHECK(sound(learn_matte({unseeded}, kShirt, {}, nullptr)));
}
