#include "fit/colour_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

const double kNoNumber = std::numeric_limits<double>::quiet_NaN();
const double kInfinite = std::numeric_limits<double>::infinity();

double squared(const Vec3& a, const Vec3& b) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
    return sum;
}

/// The k nearest pixels by sorting them all; no two colours are equally far here.
Vec3 nearest_by_sorting(const std::vector<Vec3>& rgb, const std::vector<double>& counts,
                        const Vec3& v, double k) {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < rgb.size(); ++i) order.emplace_back(squared(rgb[i], v), i);
    std::sort(order.begin(), order.end());
    Vec3 sum{0, 0, 0};
    double have = 0;
    for (const auto& [d2, i] : order) {
        const double n = std::min(counts[i], k - have);
        if (n <= 0) break;
        have += n;
        for (int c = 0; c < 3; ++c) sum[c] += n * rgb[i][c];
    }
    for (double& x : sum) x /= have;
    return sum;
}

void check_near(const Vec3& found, const Vec3& expected, double tolerance) {
    for (int c = 0; c < 3; ++c) CHECK_NEAR(found[c], expected[c], tolerance);
}

}  // namespace

TEST(nearest_pixels_by_hand) {
    const ColourTree tree({{0.1, 0, 0}, {0.2, 0, 0}, {0.9, 0.9, 0.9}}, {30, 40, 500});
    CHECK_EQUAL(tree.total(), 570.0);
    check_near(tree.nearest_mean({0, 0, 0}, 30), {0.1, 0, 0}, 1e-15);
    // 30 pixels of the nearest colour and 20 of the next.
    check_near(tree.nearest_mean({0, 0, 0}, 50), {(30 * 0.1 + 20 * 0.2) / 50, 0, 0}, 1e-15);
    check_near(tree.nearest_mean({1, 1, 1}, 0.5), {0.9, 0.9, 0.9}, 1e-15);
}

TEST(pixels_equally_far_share_what_is_left) {
    const ColourTree tree({{0.6, 0.5, 0.5}, {0.4, 0.5, 0.5}, {0.5, 0.5, 0.5}}, {30, 10, 5});
    // 5 in the middle, then 20 of the 40 at a distance of 0.1: three quarters of them at 0.6.
    check_near(tree.nearest_mean({0.5, 0.5, 0.5}, 25),
               {(5 * 0.5 + 15 * 0.6 + 5 * 0.4) / 25, 0.5, 0.5}, 1e-15);
}

TEST(nearest_pixels_are_those_of_a_sorted_list) {
    shapes::Random random(1);
    std::vector<Vec3> rgb;
    std::vector<double> counts;
    for (int i = 0; i < 1500; ++i) {
        rgb.push_back(random.colour());
        counts.push_back(1 + random.below(9));
    }
    const ColourTree tree(rgb, counts);
    for (int i = 0; i < 60; ++i) {
        const Vec3 v = random.colour(-0.5, 1.5);
        for (const double k : {0.25, 1.0, 50.0, 700.5, 1e9})
            check_near(tree.nearest_mean(v, k), nearest_by_sorting(rgb, counts, v, k), 1e-10);
    }
}

TEST(the_order_of_the_colours_does_not_matter) {
    shapes::Random random(2);
    std::vector<Vec3> rgb;
    std::vector<double> counts;
    for (int i = 0; i < 300; ++i) {
        rgb.push_back(random.colour());
        counts.push_back(1 + random.below(5));
    }
    const ColourTree forwards(rgb, counts);
    std::reverse(rgb.begin(), rgb.end());
    std::reverse(counts.begin(), counts.end());
    const ColourTree backwards(rgb, counts);
    for (int i = 0; i < 30; ++i) {
        const Vec3 v = random.colour();
        check_near(forwards.nearest_mean(v, 40), backwards.nearest_mean(v, 40), 1e-12);
    }
}

TEST(counts_stay_with_their_colours) {
    shapes::Random random(3);
    for (const int n : {1, 12, 13, 500}) {
        std::vector<Vec3> rgb;
        std::vector<double> counts;
        for (int i = 0; i < n; ++i) {
            rgb.push_back(random.colour());
            counts.push_back(1 + 100 * rgb.back()[0]);
        }
        const ColourTree tree(rgb, counts);
        CHECK_EQUAL(tree.size(), rgb.size());
        std::vector<Vec3> found;
        for (int i = 0; i < n; ++i) found.push_back(tree.rgb(i));
        for (std::size_t i = 0; i < found.size(); ++i)
            CHECK_EQUAL(tree.counts()[i], 1 + 100 * found[i][0]);
        for (int i = 0; i < ColourTree::kLeafSize; ++i) CHECK_EQUAL(tree.counts()[n + i], 0.0);
        std::sort(found.begin(), found.end());
        std::sort(rgb.begin(), rgb.end());
        CHECK(found == rgb);
    }
}

TEST(boxes_are_as_small_as_they_can_be) {
    shapes::Random random(4);
    for (const int n : {1, 16, 17, 100, 130, 2000}) {
        std::vector<Vec3> rgb;
        for (int i = 0; i < n; ++i) rgb.push_back(random.colour(-1, 2));
        const ColourTree tree(rgb, std::vector<double>(rgb.size(), 1));
        std::vector<std::pair<Vec3, Vec3>> boxes;
        const std::vector<int>& starts = tree.leaf_starts();
        CHECK_EQUAL(starts.front(), 0);
        CHECK_EQUAL(starts.back(), n);
        for (std::size_t leaf = 0; leaf + 1 < starts.size(); ++leaf) {
            CHECK(starts[leaf] < starts[leaf + 1]);
            CHECK(starts[leaf + 1] - starts[leaf] <= ColourTree::kLeafSize);
            Vec3 low{kInfinite, kInfinite, kInfinite}, high{-kInfinite, -kInfinite, -kInfinite};
            for (int i = starts[leaf]; i < starts[leaf + 1]; ++i)
                for (std::size_t c = 0; c < 3; ++c) {
                    low[c] = std::min(low[c], tree.rgb(i)[c]);
                    high[c] = std::max(high[c], tree.rgb(i)[c]);
                }
            boxes.emplace_back(low, high);
        }
        for (const std::vector<ColourTree::Boxes>& level : tree.levels()) {
            std::vector<std::pair<Vec3, Vec3>> around;
            std::size_t next = 0;
            for (const ColourTree::Boxes& group : level) {
                Vec3 low{kInfinite, kInfinite, kInfinite}, high{-kInfinite, -kInfinite, -kInfinite};
                CHECK(group.count > 0);
                for (int i = 0; i < group.count; ++i, ++next)
                    for (std::size_t c = 0; c < 3; ++c) {
                        CHECK_EQUAL(group.sides[0][c][i], boxes.at(next).first[c]);
                        CHECK_EQUAL(group.sides[1][c][i], boxes.at(next).second[c]);
                        low[c] = std::min(low[c], boxes[next].first[c]);
                        high[c] = std::max(high[c], boxes[next].second[c]);
                    }
                around.emplace_back(low, high);
            }
            CHECK_EQUAL(next, boxes.size());
            boxes = around;
        }
        CHECK_EQUAL(boxes.size(), 1u);
        CHECK(boxes[0].first == tree.low() && boxes[0].second == tree.high());
    }
}

TEST(many_times_the_same_colour) {
    const ColourTree tree(std::vector<Vec3>(100, {0.3, 0.4, 0.5}), std::vector<double>(100, 2));
    CHECK_EQUAL(tree.total(), 200.0);
    check_near(tree.nearest_mean({1, 1, 1}, 7), {0.3, 0.4, 0.5}, 1e-14);
}

TEST(a_tree_refuses_bad_arguments) {
    CHECK_THROWS(std::invalid_argument, ColourTree({}, {}));
    CHECK_THROWS(std::invalid_argument, ColourTree({{0, 0, 0}}, {1, 1}));
    for (const double bad : {0.0, -1.0, kNoNumber, kInfinite})
        CHECK_THROWS(std::invalid_argument, ColourTree({{0, 0, 0}}, {bad}));
    for (const double bad : {kNoNumber, kInfinite, -kInfinite})
        for (std::size_t c = 0; c < 3; ++c) {
            Vec3 colour{0, 0, 0};
            colour[c] = bad;
            CHECK_THROWS(std::invalid_argument, ColourTree({colour}, {1}));
            const ColourTree tree({{0, 0, 0}, {1, 1, 1}}, {50, 50});
            CHECK_THROWS(std::invalid_argument, tree.nearest_mean(colour, 50));
        }
    const ColourTree tree({{0, 0, 0}}, {1});
    for (const double bad : {0.0, -1.0, kNoNumber})
        CHECK_THROWS(std::invalid_argument, tree.nearest_mean({0, 0, 0}, bad));
}
