// What users rely on, and the same bits by every way; tests/parity has the values at all frames.
#include "recolour/frame_picks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>

#include "check.hpp"
#include "images.hpp"
#include "picks.hpp"
#include "recolour/recolour.hpp"
#include "shapes.hpp"
#include "simd/instruction_set.hpp"

using namespace palette4d;
using namespace images;
using namespace shapes;
using picks::ball;
using picks::hold;
using picks::pick;

namespace {

const Vec3 kRed{0.6, 0.25, 0.2}, kGreen{0.25, 0.55, 0.3}, kBlue{0.2, 0.3, 0.65};

Edits edits_of(std::vector<Pick> all) {
    Edits edits;
    edits.picks = std::move(all);
    return edits;
}

/// The palette as it is, or with some colours moved.
Recolourer with(const FramePicks& all, bool handles = false) {
    std::vector<Vec3> edited = cube().rgb;
    if (handles) {
        edited[7] = {1.2, 0.7, 0.9};
        edited[1] = {0.8, 0.1, -0.1};
    }
    return {cube().rgb, edited, cube().faces, all};
}

double gap(const Vec3& a, const Vec3& b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// Colours everywhere: near the picks, greys, black and white, far outside, and what is none.
Image everything(int width, int height, int channels, std::uint64_t seed) {
    Image image(width, height, channels);
    Random random(seed);
    for (int i = 0; i < width * height; ++i) {
        const Vec3 centres[] = {kRed, kGreen, kBlue, {0, 0, 0}, {1, 1, 1}, {0.5, 0.5, 0.5}};
        const double reach = i % 3 == 0 ? 1.0 : 0.1;
        const Vec3 colour = centres[i % 6] + random.colour(-reach, reach);
        float* const pixel = &image.data[static_cast<std::size_t>(i * channels)];
        for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<float>(colour[c]);
        if (channels == 4) pixel[3] = static_cast<float>(random.uniform(0.2, 1.2));
    }
    const float odd[] = {kNan, kInf, -kInf, -0.0f, 0.0f, 1e-42f, 3e38f, -3e38f, 1e30f, -1e6f};
    for (std::size_t i = 0; i < std::size(odd); ++i) image.data[i * 7 * channels + i % 3] = odd[i];
    for (std::size_t c = 0; c < 3; ++c) {
        image.data[90 * channels + c] = c == 1 ? -3e38f : 3e38f;
        image.data[91 * channels + c] = -3e38f;
        image.data[92 * channels + c] = -0.0f;
    }
    return image;
}

/// A window that goes from the left to the right in 10 frames.
PickWindow moving_window(double feather) {
    return {feather, {{0, {10, 2, 60, 5}}, {10, {110, 2, 160, 5}}}};
}

/// Picks of every kind: several, one, with holds, pale ones, with a curve, with windows.
std::vector<FramePicks> many() {
    std::vector<FramePicks> all;
    Pick inside = pick("a", kRed, {0.3, 0.3, 0.6}), spot = pick("b", kGreen, {0.6, 0.5, 0.2});
    inside.window = moving_window(20);
    spot.window = moving_window(0);
    all.push_back(picks_at(edits_of({inside}), 5));
    all.push_back(picks_at(edits_of({inside, spot, pick("c", kBlue, {0.6, 0.3, 0.2})}), 2));
    all.push_back(picks_at(edits_of({pick("a", kRed, {0.3, 0.3, 0.6})}), 0));
    all.push_back(
        picks_at(edits_of({pick("a", kRed, {0.3, 0.3, 0.6}), pick("b", kGreen, {0.6, 0.5, 0.2}),
                           pick("w", {0.95, 0.94, 0.96}, {0.9, 0.8, 0.7})}),
                 0));
    all.push_back(picks_at(
        edits_of({pick("a", kRed, {0.3, 0.3, 0.6}), hold("h", kGreen), hold("g", {0.1, 0.1, 0.1}),
                  pick("k", {0.02, 0.02, 0.02}, {0.1, 0.05, 0})}),
        0));
    all.push_back(picks_at(edits_of({hold("h", kGreen)}), 0));
    all.push_back({{ball(kBlue, {0.1, -0.2, 0.05}, 0.15)}, nullptr, nullptr});
    Edits log = edits_of({pick("a", kRed, {0.3, 0.3, 0.6}), hold("h", kGreen)});
    std::vector<double> values;
    for (int i = 0; i <= 64; ++i) values.push_back(std::pow(i / 64.0, 0.6));
    log.display = std::make_shared<const DisplayCurve>(DisplayCurve{0, 1.1, values});
    all.push_back(picks_at(log, 0));
    return all;
}

}  // namespace

TEST(a_picked_colour_becomes_its_target_exactly) {
    const Vec3 pale{0.52, 0.5, 0.49}, black{0, 0, 0}, white{1, 1, 1}, dark{0.02, 0.03, 0.02};
    for (const Vec3& colour : {kRed, kGreen, kBlue, pale, black, white, dark}) {
        const Vec3 to{0.4, 0.3, 0.5};
        for (const double softness : {0.0, 0.5, 1.0}) {
            Pick one = pick("p", colour, to);
            one.softness = softness;
            one.reach = softness - 0.5;
            for (const bool handles : {false, true}) {
                const Recolourer recolourer = with(picks_at(edits_of({one}), 3), handles);
                CHECK(gap(recolourer.displaced(colour, 1), to) < 1e-12);
                // Half of the strength, half of the way.
                CHECK(gap(recolourer.displaced(colour, 0.5), 0.5 * (colour + to)) < 1e-12);
            }
        }
    }
}

TEST(colours_below_black_and_above_white_can_be_picked) {
    for (const double level : {-0.5, -0.02, -0.01, 1.01, 1.02, 4.0}) {
        const Vec3 colour{level, level, level}, to{0.5, 0.4, 0.3};
        const Recolourer recolourer = with(picks_at(edits_of({pick("p", colour, to)}), 0), true);
        Pick exact = pick("p", colour, to);
        exact.toward_colour = true;
        const Recolourer toward = with(picks_at(edits_of({exact}), 0), true);
        CHECK(gap(toward.displaced(colour, 1), to) < 1e-9);
        for (const double other : {-9.0, -0.02, 0.0, 0.5, 1.0, 1.02, 9.0}) {
            CHECK(finite(recolourer.displaced({other, other, other}, 1)));
        }
    }
}

TEST(targets_are_met_with_a_display_curve) {
    Edits edits = edits_of({pick("p", kRed, {0.3, 0.3, 0.6})});
    edits.display =
        std::make_shared<const DisplayCurve>(DisplayCurve{-0.1, 0.9, {0.05, 0.3, 0.7, 1.0}});
    const Vec3 to{0.3, 0.3, 0.6};
    edits.picks[0].matte =
        std::make_shared<const Matte>(hue_matte(displayed(kRed, edits.display.get())));
    const Recolourer recolourer = with(picks_at(edits, 0), true);
    CHECK(gap(recolourer.displaced(kRed, 1), to) < 1e-12);
}

TEST(several_targets_are_met_together) {
    const Vec3 near_red{0.62, 0.28, 0.2};
    const Edits edits =
        edits_of({pick("a", kRed, {0.3, 0.3, 0.6}), pick("b", kGreen, {0.7, 0.6, 0}),
                  pick("c", kBlue, kBlue), pick("d", near_red, {0.7, 0.3, 0.2})});
    for (const bool handles : {false, true}) {
        const Recolourer recolourer = with(picks_at(edits, 0), handles);
        for (const Pick& one : edits.picks) {
            CHECK(gap(recolourer.displaced(one.rgb, 1), one.to) < 1e-3);
        }
    }
}

TEST(a_hold_keeps_its_colour) {
    const Vec3 kept{0.55, 0.35, 0.15};
    Pick a = pick("a", kRed, {0.3, 0.3, 0.6}), h = hold("h", kept);
    // Without picks: to the bit, whatever the palette does.
    const Recolourer alone = with(picks_at(edits_of({h}), 0), true);
    CHECK(gap(alone.displaced(kept, 1), kept) < 1e-15);
    CHECK(gap(alone.displaced(kBlue, 1), with({}, true).displaced(kBlue, 1)) < 1e-15);
    CHECK(!with(picks_at(edits_of({h}), 0)).moves());
    // Next to a pick: within the grid's cells.
    const Recolourer both = with(picks_at(edits_of({a, h}), 0), true);
    const Recolourer only = with(picks_at(edits_of({a}), 0), true);
    CHECK(gap(only.displaced(kept, 1), kept) > 0.1);
    CHECK(gap(both.displaced(kept, 1), kept) < 0.01);
    CHECK(gap(both.displaced(kRed, 1), a.to) < 1e-12);
    // A hold that has faded by half keeps half.
    h.from = 10;
    h.fade = 4;
    const Vec3 full = with({}, true).displaced(kept, 1),
               half = with(picks_at(edits_of({h}), 8), true).displaced(kept, 1);
    CHECK(gap(half, 0.5 * (full + kept)) < 1e-6);
}

TEST(a_matte_shows_one_pick_alone) {
    const Edits edits = edits_of(
        {pick("a", kRed, {0.3, 0.3, 0.6}), pick("b", kGreen, {0, 0, 0}), hold("h", kBlue)});
    for (const char* id : {"a", "b", "h"}) {
        const FramePicks shown = matte_at(edits, id, 0);
        CHECK_EQUAL(shown.picks.size(), 1u);
        const Recolourer recolourer = with(shown);
        for (const Pick& one : edits.picks) {
            const Vec3 moved = recolourer.displaced(one.rgb, 1) - one.rgb;
            const double expected = one.id == id ? 1 : 0;
            CHECK(gap(moved, {expected, expected, expected}) < 0.02);
        }
    }
    CHECK(matte_at(edits, "nobody", 0).picks.empty());
}

TEST(where_a_matte_is_0_every_bit_stays) {
    for (const FramePicks& all : many()) {
        const auto recolourer =
            std::make_shared<const Recolourer>(cube().rgb, cube().rgb, cube().faces, all);
        for (const int channels : {3, 4}) {
            const Image image = everything(61, 20, channels, 11);
            for (const Precision precision : {Precision::kSingle, Precision::kDouble}) {
                Image found(61, 20, channels);
                RecolourOptions way{1.0, channels == 4, 1};
                way.precision = precision;
                recolourer->apply(image.in(), found.out(), way);
                int still = 0, moved = 0;
                for (std::size_t i = 0; i < image.data.size(); i += channels) {
                    const float* const from = &image.data[i];
                    const double alpha = channels == 4 ? from[3] : 1.0;
                    const Vec3 colour{from[0] / alpha, from[1] / alpha, from[2] / alpha};
                    bool zero = true;
                    if (finite(colour)) {
                        const Vec3 point = pick_point(displayed(colour, all.display.get()));
                        for (const FramePick& one : all.picks) {
                            zero &= MatteGrid::at(one.matte->data(), point) < 1e-12;
                        }
                    }
                    const bool same = std::memcmp(from, &found.data[i], 4 * channels) == 0;
                    if (zero) CHECK(same);
                    still += same;
                    moved += !same;
                }
                CHECK(still > 50 && (all.picks.empty() || moved > 50));
            }
        }
    }
}

TEST(pictures_are_the_same_by_every_way) {
    for (const FramePicks& all : many()) {
        for (const bool handles : {false, true}) {
            const Recolourer recolourer = with(all, handles);
            if (!recolourer.moves()) continue;
            for (const int channels : {3, 4}) {
                const Image image = everything(203, 7, channels, 5);
                RecolourOptions way{0.75, channels == 4, 1};
                way.place = ImagePlace{0, 0, 1, 1, 1};
                Image expected(203, 7, channels), exact(203, 7, channels);
                recolourer.apply(image.in(), expected.out(), way);
                RecolourOptions twofold = way;
                twofold.precision = Precision::kDouble;
                recolourer.apply(image.in(), exact.out(), twofold);
                for (std::size_t i = 0; i < image.data.size(); ++i) {
                    const double alpha =
                        channels == 4 ? std::max(std::abs(image.data[i / 4 * 4 + 3]), 1.0f) : 1;
                    const bool close = std::abs(expected.data[i] - exact.data[i]) <=
                                       alpha * kSingleTolerance + 1e-6 * std::abs(exact.data[i]);
                    CHECK(close || same_bits({expected.data[i]}, {exact.data[i]}) ||
                          (std::isnan(expected.data[i]) && std::isnan(exact.data[i])));
                }
                // Threads, instruction sets, places in a row, and the same memory do not show.
                for (const InstructionSet set : instruction_sets()) {
                    Image found = image;
                    RecolourOptions other = way;
                    other.threads = 3;
                    other.instructions = set;
                    recolourer.apply(found.in(), found.out(), other);
                    CHECK(same_bits(found.data, expected.data));
                    other.precision = Precision::kDouble;
                    recolourer.apply(image.in(), found.out(), other);
                    CHECK(same_bits(found.data, exact.data));
                }
                for (const int x : {0, 1, 17, 130, 202}) {
                    const std::size_t at = (4 * 203 + static_cast<std::size_t>(x)) *
                                           static_cast<std::size_t>(channels);
                    float pixel[4];
                    way.place = ImagePlace{x, 4, 1, 1, 1};
                    recolourer.apply({&image.data[at], 1, 1, channels, 16},
                                     {pixel, 1, 1, channels, 16}, way);
                    CHECK(std::memcmp(pixel, &expected.data[at], sizeof(float) * channels) == 0);
                }
            }
        }
    }
}

TEST(one_colour_and_a_picture_agree) {
    for (const FramePicks& all : many()) {
        const Recolourer recolourer = with(all, true);
        const Image image = everything(100, 3, 3, 8);
        Image found(100, 3, 3);
        RecolourOptions way;
        way.precision = Precision::kDouble;
        recolourer.apply(image.in(), found.out(), way);
        for (std::size_t i = 0; i < image.data.size(); i += 3) {
            const Vec3 colour{image.data[i], image.data[i + 1], image.data[i + 2]};
            const Vec3 expected = recolourer.displaced(colour, 1);
            for (std::size_t c = 0; c < 3; ++c) {
                const float rounded = static_cast<float>(expected[c]);
                CHECK(same_bits({found.data[i + c]}, {rounded}) || std::isnan(rounded));
            }
        }
    }
}

TEST(kernels_of_all_sets_agree_where_stages_need_them) {
    // The twofold kernels run on few pixels of a picture only.
    Random random(9);
    for (const FramePicks& all : many()) {
        const PickMemory<double> twofold(all, {});
        const PickMemory<float> single(all, {});
        alignas(64) double colour[3][64], expected[3][64], found[3][64];
        alignas(64) float colour_f[3][64], expected_f[4][64], found_f[4][64];
        alignas(64) double place[2][64];
        alignas(64) float place_f[2][64];
        Spot spots[64];
        for (int i = 0; i < 64; ++i) {
            const Vec3 p = random.colour(-0.3, 1.3);
            for (std::size_t c = 0; c < 3; ++c) {
                colour_f[c][i] = static_cast<float>(p[c]);
                colour[c][i] = static_cast<double>(colour_f[c][i]);
            }
            spots[i] = {static_cast<float>(random.uniform(-5, 210)),
                        static_cast<float>(random.uniform(-5, 12))};
            place[0][i] = static_cast<double>(place_f[0][i] = spots[i].x);
            place[1][i] = static_cast<double>(place_f[1][i] = spots[i].y);
        }
        for (const int count : {1, 3, 17, 64}) {
            std::fill_n(&expected[0][0], 192, 0.25);
            PickKernels::baseline().add_twofold(twofold.plan(), colour, place, expected, count);
            for (int i = 0; i < count; ++i) {
                const Vec3 p{colour[0][i], colour[1][i], colour[2][i]};
                const Vec3 exact =
                    with_picks(all, twofold.plan(), p, {0.25, 0.25, 0.25}, &spots[i]);
                for (std::size_t c = 0; c < 3; ++c) CHECK_NEAR(expected[c][i], exact[c], 1e-12);
            }
            std::fill_n(&expected_f[0][0], 256, 1.0f);
            PickKernels::baseline().set(single.plan(), colour_f, place_f, expected_f, count);
            for (const InstructionSet set : instruction_sets()) {
                const PickKernels& kernels = kernels_of<PickKernels>(set);
                std::fill_n(&found[0][0], 192, 0.25);
                kernels.add_twofold(twofold.plan(), colour, place, found, count);
                std::fill_n(&found_f[0][0], 256, 1.0f);
                const bool some = kernels.set(single.plan(), colour_f, place_f, found_f, count);
                for (std::size_t c = 0; c < 4; ++c) {
                    const std::size_t size = static_cast<std::size_t>(count);
                    if (c < 3) CHECK(std::memcmp(found[c], expected[c], size * 8) == 0);
                    CHECK(std::memcmp(found_f[c], expected_f[c], size * 4) == 0);
                    CHECK(some || std::count(found_f[c], found_f[c] + size, 0.0f) == count);
                }
            }
        }
    }
}

TEST(a_pick_stays_in_its_window) {
    Pick inside = pick("a", kRed, {0.3, 0.3, 0.6});
    inside.window = moving_window(20);
    const Edits edits = edits_of({inside});
    const Recolourer all = with(picks_at(edits_of({pick("a", kRed, {0.3, 0.3, 0.6})}), 0));
    const Vec3 whole = all.displaced(kRed, 1) - kRed;
    CHECK_NEAR(whole[2], 0.4, 1e-6);
    const auto share_at = [&](double frame, const Spot& spot) {
        const Recolourer map = with(picks_at(edits, frame));
        const Vec3 moved = map.displaced(kRed, 1, &spot) - kRed;
        CHECK_NEAR(moved[0] * whole[2], moved[2] * whole[0], 1e-9);
        return moved[2] / whole[2];
    };
    // The box, and half of the feather beyond its sides and its corner.
    CHECK_NEAR(share_at(0, {30, 3}), 1, 1e-9);
    CHECK_NEAR(share_at(0, {10, 5}), 1, 1e-9);
    for (const Spot& spot : {Spot{0, 3}, Spot{70, 3}, Spot{30, 15}, Spot{66, 13}}) {
        CHECK_NEAR(share_at(0, spot), 0.5625, 1e-6);
    }
    CHECK(share_at(0, {81, 3}) == 0 && share_at(0, {76, 19}) == 0);
    // It moves with time, and stays where it was before and after.
    CHECK(share_at(5, {30, 3}) == 0);
    CHECK_NEAR(share_at(5, {60, 3}), 1, 1e-9);
    CHECK_NEAR(share_at(5, {50, 3}), share_at(0, {0, 3}), 1e-6);
    CHECK(share_at(-3, {30, 3}) == share_at(0, {30, 3}));
    CHECK(share_at(99, {120, 3}) == share_at(10, {120, 3}));
    // A colour alone has no place: LUTs have all of the pick.
    CHECK(with(picks_at(edits, 0)).displaced(kRed, 1) == all.displaced(kRed, 1));
}

TEST(the_picture_may_have_another_size_than_the_clip) {
    Pick inside = pick("a", kRed, {0.3, 0.3, 0.6});
    inside.window = PickWindow{1, {{0, {100, 0, 200, 50}}}};
    Edits edits = edits_of({inside});
    edits.width = 200;
    edits.height = 100;
    const Recolourer map = with(picks_at(edits, 0));
    Image proxy(20, 10, 3);
    for (std::size_t i = 0; i < proxy.data.size(); ++i) {
        proxy.data[i] = static_cast<float>(kRed[i % 3]);
    }
    Image found(20, 10, 3);
    RecolourOptions way;
    way.place = ImagePlace{0, 0, 1, 10, 10};
    map.apply(proxy.in(), found.out(), way);
    for (int y = 0; y < 10; ++y) {
        for (int x = 0; x < 20; ++x) {
            const auto at = static_cast<std::size_t>(3 * (y * 20 + x));
            CHECK((found.data[at] != proxy.data[at]) == (x >= 10 && y < 5));
        }
    }
}

TEST(saturated_shades_keep_their_part_of_the_light) {
    // Half as light as the pick, and as saturated as far as numbers reach: its amount is nearly 1.
    const Vec3 picked{0.6, 0.3, 0.2}, shade{0.45, 0.1, 0.0};
    for (const Vec3& to : {Vec3{0.2, 0.15, 0.1}, Vec3{0.9, 0.75, 0.7}}) {
        const Recolourer map = with(picks_at(edits_of({pick("a", picked, to)}), 0));
        CHECK(gap(map.displaced(picked, 1), to) < 1e-9);
        const Vec3 moved = map.displaced(shade, 1);
        const auto light = [](const Vec3& c) { return (c[0] + c[1] + c[2]) / 3; };
        // The lightness is to the new colour's as it was to the pick's.
        CHECK_NEAR(light(moved) / light(to), light(shade) / light(picked), 0.06);
        CHECK(*std::min_element(moved.begin(), moved.end()) > -0.02);
        // A shade in the proper sense, and a mixture with grey, change as ever.
        const Vec3 half = 0.5 * picked, mixed = 0.5 * picked + Vec3{0.2, 0.2, 0.2};
        CHECK(gap(map.displaced(half, 1), half + 0.5 * (to - picked)) < 0.02);
        CHECK(gap(map.displaced(mixed, 1), mixed + 0.5 * (to - picked)) < 0.02);
    }
    // Mattes show the amount.
    const Recolourer matte = with(matte_at(edits_of({pick("a", picked, {0, 0, 0})}), "a", 0));
    CHECK((matte.displaced(shade, 1) - shade)[2] > 0.85);
}
