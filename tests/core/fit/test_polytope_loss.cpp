#include "fit/polytope_loss.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "check.hpp"
#include "shapes.hpp"

using namespace palette4d;

namespace {

std::shared_ptr<const ColourTree> tree_of(std::vector<Vec3> rgb) {
    std::vector<double> counts(rgb.size(), 1);
    return std::make_shared<const ColourTree>(std::move(rgb), std::move(counts));
}

/// A tetrahedron's four tracks from frame 0 to 10, the first with a vertex between; 40 frames.
struct Scene {
    std::vector<Vec4> vertices;
    std::vector<BlockTopology> blocks;
    std::vector<FrameColours> frames;
    std::vector<int> all;
};

Scene scene() {
    shapes::Random random(1);
    Scene out;
    const shapes::Mesh mesh = shapes::tetrahedron();
    BlockTopology block{0, 10, {}, mesh.faces};
    for (const Vec3& v : mesh.rgb) {
        const int first = static_cast<int>(out.vertices.size());
        for (const double t : {0.0, 10.0})
            out.vertices.push_back({v[0] + random.uniform(-0.1, 0.1),
                                    v[1] + random.uniform(-0.1, 0.1),
                                    v[2] + random.uniform(-0.1, 0.1), t});
        block.tracks.push_back({first, first + 1});
    }
    out.vertices.push_back({0.05, 0.1, -0.05, 4.3});
    block.tracks[0] = {0, 8, 1};
    out.blocks.push_back(block);
    for (int i = 0; i < 40; ++i) {
        std::vector<Vec3> rgb;
        for (int n = 0; n < 60; ++n) rgb.push_back(random.colour(0, 0.7));
        out.frames.push_back({10.0 * i / 39, tree_of(rgb)});
        out.all.push_back(i);
    }
    return out;
}

const LossWeights kWeights{50, 60, 0.7};

bool same_bits(const FrameLoss& a, const FrameLoss& b) {
    return a.R == b.R && a.C == b.C && a.D == b.D && a.outside == b.outside &&
           a.max_distance == b.max_distance;
}

}  // namespace

TEST(a_slice_is_half_way_between_its_edges_ends) {
    // One colour that moves from 0 to (1, 0, 0) in frames 2 to 6, seen at frame 3: (1/4, 0, 0).
    const std::vector<Vec4> vertices{{0, 0, 0, 2}, {1, 0, 0, 6}};
    const std::vector<BlockTopology> blocks{{2, 6, {{0, 1}}, {}}};
    const std::vector<FrameColours> frames{{3, tree_of({{0.25, 0.5, 0}})}};
    std::vector<Vec4> gradient;
    const auto losses = polytope_loss(vertices, blocks, frames, {0}, {50, 1, 0}, 1, &gradient);
    CHECK_EQUAL(losses.size(), std::size_t{1});
    CHECK_NEAR(losses[0].R, 0.5, 1e-15);
    CHECK_NEAR(losses[0].C, 0.5, 1e-15);
    // d(50 R + C)/d colour = (0, -51, 0), shared 3/4 to 1/4; sliding in time changes nothing.
    CHECK_NEAR(gradient[0][1], -51 * 0.75, 1e-12);
    CHECK_NEAR(gradient[1][1], -51 * 0.25, 1e-12);
    for (const Vec4& g : gradient)
        for (const std::size_t c : {0u, 2u, 3u}) CHECK_NEAR(g[c], 0, 1e-12);
}

TEST(a_frame_has_the_losses_of_its_slice) {
    const Scene s = scene();
    const auto losses = polytope_loss(s.vertices, s.blocks, s.frames, s.all, kWeights, 1, nullptr);
    for (std::size_t i = 0; i < s.frames.size(); ++i) {
        const double t = s.frames[i].frame;
        std::vector<Vec3> palette;
        for (const auto& track : s.blocks[0].tracks) {
            std::size_t k = 1;
            while (s.vertices[static_cast<std::size_t>(track[k])][3] < t) ++k;
            const Vec4& a = s.vertices[static_cast<std::size_t>(track[k - 1])];
            const Vec4& b = s.vertices[static_cast<std::size_t>(track[k])];
            const double w = (t - a[3]) / (b[3] - a[3]);
            palette.push_back(
                {(1 - w) * a[0] + w * b[0], (1 - w) * a[1] + w * b[1], (1 - w) * a[2] + w * b[2]});
        }
        const FrameLoss expected =
            palette_loss(*s.frames[i].colours, palette, s.blocks[0].faces, kWeights, nullptr);
        CHECK_NEAR(losses[i].R, expected.R, 1e-12);
        CHECK_NEAR(losses[i].C, expected.C, 1e-12);
        CHECK_NEAR(losses[i].D, expected.D, 1e-12);
    }
}

TEST(the_gradient_in_colour_and_time_is_that_of_differences) {
    const Scene s = scene();
    // Frames not at a vertex's own time, where the slice has a corner.
    const std::vector<int> which{3, 10, 22, 31};
    const auto value = [&](const std::vector<Vec4>& vertices) {
        double sum = 0;
        for (const FrameLoss& l :
             polytope_loss(vertices, s.blocks, s.frames, which, kWeights, 1, nullptr))
            sum += kWeights.lambda * l.R + l.C + kWeights.convexity * l.D;
        return sum;
    };
    std::vector<Vec4> gradient;
    polytope_loss(s.vertices, s.blocks, s.frames, which, kWeights, 1, &gradient);
    CHECK_EQUAL(gradient.size(), s.vertices.size());
    bool time_matters = false;
    for (std::size_t i = 0; i < gradient.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) {
            std::vector<Vec4> up = s.vertices, down = s.vertices;
            up[i][c] += 1e-6;
            down[i][c] -= 1e-6;
            CHECK_NEAR(gradient[i][c], (value(up) - value(down)) / 2e-6, 1e-3);
            time_matters |= c == 3 && std::abs(gradient[i][c]) > 0.01;
        }
    CHECK(time_matters);
}

TEST(the_number_of_threads_does_not_change_a_bit) {
    const Scene s = scene();
    std::vector<Vec4> alone;
    const auto expected = polytope_loss(s.vertices, s.blocks, s.frames, s.all, kWeights, 1, &alone);
    for (const int threads : {-3, 0, 2, 3, 8, 1000}) {
        std::vector<Vec4> gradient;
        const auto losses =
            polytope_loss(s.vertices, s.blocks, s.frames, s.all, kWeights, threads, &gradient);
        CHECK_EQUAL(losses.size(), expected.size());
        for (std::size_t i = 0; i < losses.size(); ++i) CHECK(same_bits(losses[i], expected[i]));
        CHECK_EQUAL(gradient.size(), alone.size());
        CHECK(std::memcmp(gradient.data(), alone.data(), alone.size() * sizeof(Vec4)) == 0);
    }
}

TEST(frames_may_repeat_or_be_none_at_all) {
    const Scene s = scene();
    std::vector<Vec4> once, twice, none{{1, 2, 3, 4}};
    polytope_loss(s.vertices, s.blocks, s.frames, {7}, kWeights, 1, &once);
    const auto losses = polytope_loss(s.vertices, s.blocks, s.frames, {7, 7}, kWeights, 2, &twice);
    CHECK(same_bits(losses[0], losses[1]));
    for (std::size_t i = 0; i < once.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) CHECK_EQUAL(twice[i][c], 2 * once[i][c]);
    CHECK(polytope_loss(s.vertices, s.blocks, s.frames, {}, kWeights, 4, &none).empty());
    CHECK_EQUAL(none.size(), s.vertices.size());
    for (const Vec4& g : none) CHECK(g == (Vec4{0, 0, 0, 0}));
}

TEST(two_vertices_at_the_same_time_make_a_jump) {
    const std::vector<Vec4> vertices{{0, 0, 0, 0}, {0, 0, 0, 5}, {1, 0, 0, 5}, {1, 0, 0, 9}};
    const std::vector<BlockTopology> blocks{{0, 9, {{0, 1, 2, 3}}, {}}};
    std::vector<FrameColours> frames;
    for (const double t : {4.0, 5.0, 6.0}) frames.push_back({t, tree_of({{0, 0, 0}})});
    std::vector<Vec4> gradient;
    const auto losses =
        polytope_loss(vertices, blocks, frames, {0, 1, 2}, {50, 1, 0}, 1, &gradient);
    CHECK_EQUAL(losses[0].R, 0.0);
    CHECK_EQUAL(losses[1].R, 0.0);
    CHECK_EQUAL(losses[2].R, 1.0);
    for (const Vec4& g : gradient)
        for (const double x : g) CHECK(std::isfinite(x));
}

TEST(bad_structures_are_refused) {
    const Scene s = scene();
    const auto run = [&](const Scene& bad, const std::vector<int>& which, int threads = 1) {
        polytope_loss(bad.vertices, bad.blocks, bad.frames, which, kWeights, threads, nullptr);
    };
    CHECK_THROWS(std::invalid_argument, run(s, {-1}));
    CHECK_THROWS(std::invalid_argument, run(s, {40}));
    Scene bad = s;
    bad.blocks[0].tracks[2].clear();
    CHECK_THROWS(std::invalid_argument, run(bad, s.all));
    for (const int vertex : {-1, 9}) {
        bad = s;
        bad.blocks[0].tracks[2][1] = vertex;
        CHECK_THROWS(std::invalid_argument, run(bad, s.all));
    }
    for (const int corner : {-1, 4}) {
        bad = s;
        bad.blocks[0].faces[1][2] = corner;
        CHECK_THROWS(std::invalid_argument, run(bad, s.all));
    }
    bad = s;
    bad.frames[5].colours.reset();
    CHECK_THROWS(std::invalid_argument, run(bad, s.all));
    run(bad, {4});
}

TEST(problems_in_any_thread_reach_the_caller) {
    const Scene s = scene();
    for (const int threads : {1, 4}) {
        for (const double t : {-0.5, 10.5, std::numeric_limits<double>::quiet_NaN()}) {
            Scene bad = s;
            for (FrameColours& f : bad.frames) f.frame = t;
            CHECK_THROWS(std::invalid_argument, polytope_loss(bad.vertices, bad.blocks, bad.frames,
                                                              s.all, kWeights, threads, nullptr));
        }
        for (std::size_t c = 0; c < 3; ++c) {
            Scene bad = s;
            bad.vertices[2][c] = std::numeric_limits<double>::quiet_NaN();
            std::vector<Vec4> gradient;
            CHECK_THROWS(std::invalid_argument, polytope_loss(bad.vertices, bad.blocks, bad.frames,
                                                              s.all, kWeights, threads, &gradient));
        }
    }
}

TEST(smoothness_is_the_mean_speed_of_the_edges) {
    // 0.5 in half of the clip's 10 frames, with half its weight; 0.3 in a fifth of them.
    const std::vector<Vec4> vertices{{0, 0, 0, 0}, {0.3, 0.4, 0, 5}, {0.3, 0.4, 0.3, 7}};
    std::vector<TimeEdge> edges{{0, 1, 0.5}, {1, 2, 1}};
    std::vector<Vec4> gradient;
    CHECK_NEAR(smoothness(vertices, edges, 10, &gradient), (0.5 * 1 + 1.5) / 2, 1e-12);
    CHECK_EQUAL(gradient.size(), vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) {
            std::vector<Vec4> up = vertices, down = vertices;
            up[i][c] += 1e-6;
            down[i][c] -= 1e-6;
            const double slope =
                (smoothness(up, edges, 10, nullptr) - smoothness(down, edges, 10, nullptr)) / 2e-6;
            CHECK_NEAR(gradient[i][c], slope, 1e-6);
        }
    edges.push_back({2, 2, 1});  // without extent in time
    CHECK_NEAR(smoothness(vertices, edges, 10, &gradient), 2.0 / 3, 1e-12);
    for (const Vec4& g : gradient)
        for (const double x : g) CHECK(std::isfinite(x));
    CHECK_EQUAL(smoothness(vertices, {}, 10, &gradient), 0.0);
    for (const int vertex : {-1, 3})
        CHECK_THROWS(std::invalid_argument, smoothness(vertices, {{0, vertex, 1}}, 10, nullptr));
}
