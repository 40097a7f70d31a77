#include "model/polytope.hpp"

#include <functional>
#include <map>

#include "check.hpp"
#include "shapes.hpp"
#include "sidecar/sidecar.hpp"

using namespace palette4d;
using namespace shapes;

namespace {

/// Spoils the good polytope and expects the problem at `pointer`.
void spoiled(const char* pointer, const std::function<void(SplitParts&)>& spoil) {
    SplitParts parts = split_parts();
    spoil(parts);
    check::throws<SidecarError>([&] { parts.build(); }, __FILE__, __LINE__, pointer,
                                [&](const SidecarError& problem) {
                                    CHECK_EQUAL(problem.pointer(), std::string(pointer));
                                    CHECK_EQUAL(problem.file(), std::string());
                                    CHECK(!problem.found().empty());
                                    CHECK(!problem.expected().empty());
                                });
}

}  // namespace

TEST(a_good_polytope_is_taken_as_it_is) {
    const Polytope polytope = split_parts().build();
    CHECK_EQUAL(polytope.vertices().size(), 15u);
    CHECK_EQUAL(polytope.edges().size(), 11u);
    CHECK_EQUAL(polytope.sections().size(), 3u);
    CHECK_EQUAL(polytope.first_frame(), 0.0);
    CHECK_EQUAL(polytope.last_frame(), 20.0);
}

TEST(things_are_found_by_id_and_by_ends) {
    const Polytope polytope = split_parts().build();
    for (int i = 0; i < 15; ++i) CHECK_EQUAL(polytope.find_vertex(polytope.vertices()[i].id), i);
    for (int i = 0; i < 11; ++i) {
        const Edge& edge = polytope.edges()[i];
        CHECK_EQUAL(polytope.find_edge(edge.id), i);
        CHECK_EQUAL(polytope.find_edge(edge.from, edge.to), i);
        CHECK_EQUAL(polytope.find_edge(edge.to, edge.from), -1);
    }
    CHECK_EQUAL(polytope.find_vertex(""), -1);
    CHECK_EQUAL(polytope.find_vertex("zz"), -1);
    CHECK_EQUAL(polytope.find_edge("a0"), -1);
    CHECK_EQUAL(polytope.find_edge(0, 3), -1);
}

TEST(blocks_win_at_their_ends) {
    const Polytope polytope = split_parts().build();
    const std::map<double, int> expected{{-1e9, 0}, {0, 0},  {3.3, 0},  {8, 0},  {8.0000001, 1},
                                         {9, 1},    {10, 2}, {10.1, 2}, {20, 2}, {1e300, 2}};
    for (const auto& [frame, section] : expected) CHECK_EQUAL(polytope.section_at(frame), section);
}

TEST(a_block_of_one_frame_lies_between_two_transitions) {
    SplitParts parts;
    parts.vertices = {{"a", {0, 0, 0}, 0}, {"b", {1, 1, 1}, 2}, {"c", {0, 1, 0}, 4}};
    parts.edges = {{"e", 0, 1}, {"f", 1, 2}};
    parts.sections = {{0, 0, false, {{0}}, {}},
                      {0, 2, true, {{0, 1}}, {}},
                      {2, 2, false, {{1}}, {}},
                      {2, 4, true, {{1, 2}}, {}},
                      {4, 4, false, {{2}}, {}}};
    const Polytope polytope = parts.build();
    CHECK_EQUAL(polytope.section_at(0), 0);
    CHECK_EQUAL(polytope.section_at(1), 1);
    CHECK_EQUAL(polytope.section_at(2), 2);
    CHECK_EQUAL(polytope.section_at(3), 3);
    CHECK_EQUAL(polytope.section_at(4), 4);
    CHECK_EQUAL(polytope.section_at(5), 4);
}

TEST(bad_edges_are_named) {
    spoiled("/edges/3", [](SplitParts& p) { std::swap(p.edges[3].from, p.edges[3].to); });
    spoiled("/edges/3", [](SplitParts& p) { p.edges[3].to = p.edges[3].from; });
    spoiled("/edges/11", [](SplitParts& p) { p.edges.push_back({"again", 0, 1}); });
}

TEST(bad_times_are_named) {
    spoiled("/blocks/0/last", [](SplitParts& p) { p.sections[0].first = 9; });
    spoiled("/blocks/1/first", [](SplitParts& p) {
        p.sections[1].last = 8;
        p.sections[2].first = 8;
    });
}

TEST(bad_tracks_are_named) {
    spoiled("/blocks/0/tracks/1/1", [](SplitParts& p) { p.sections[0].tracks[1] = {2, 4}; });
    spoiled("/blocks/0/tracks/1", [](SplitParts& p) { p.sections[0].tracks[1] = {3, 4}; });
    spoiled("/blocks/0/tracks/1", [](SplitParts& p) { p.sections[0].tracks[1] = {2, 3}; });
    spoiled("/blocks/0/tracks/2", [](SplitParts& p) { p.sections[0].tracks[2] = {5}; });
    spoiled("/blocks/0/tracks/1", [](SplitParts& p) { p.sections[0].tracks[1] = {0, 1}; });
    spoiled("/transitions/0/tracks/1", [](SplitParts& p) { p.sections[1].tracks[1] = {2, 3, 4}; });
    spoiled("/transitions/0/tracks/2", [](SplitParts& p) { p.sections[1].tracks[2] = {7, 8}; });
}

TEST(bad_faces_are_named) {
    spoiled("/blocks/0/faces/3/1", [](SplitParts& p) { p.sections[0].faces[3][1] = 4; });
    spoiled("/blocks/0/faces/3/0", [](SplitParts& p) { p.sections[0].faces[3][0] = -1; });
    spoiled("/blocks/0/faces/2", [](SplitParts& p) { p.sections[0].faces[2] = {0, 3, 3}; });
    spoiled("/blocks/0/faces/2", [](SplitParts& p) { p.sections[0].faces[2] = {0, 2, 3}; });
    spoiled("/blocks/0/faces/0", [](SplitParts& p) { p.sections[0].faces.pop_back(); });
    spoiled("/transitions/0/faces/6",
            [](SplitParts& p) { p.sections[1].faces.push_back(p.sections[1].faces.back()); });
    // Track 3 hangs loose: faces that leave it out.
    spoiled("/blocks/0/tracks/3",
            [](SplitParts& p) { p.sections[0].faces = {{0, 1, 2}, {0, 2, 1}}; });
    spoiled("/blocks/0/tracks/0", [](SplitParts& p) { p.sections[0].faces.clear(); });
}

TEST(surfaces_that_are_no_sphere_are_refused) {
    const auto build = [](int tracks, std::vector<Face> faces) {
        SplitParts parts;
        Section block{0, 0, false, {}, std::move(faces)};
        for (int i = 0; i < tracks; ++i) {
            parts.vertices.push_back({"v" + std::to_string(i), {double(i), 0, 0}, 0});
            block.tracks.push_back({i});
        }
        parts.sections = {block};
        return parts.build();
    };
    const auto refused = [&](int tracks, const std::vector<Face>& faces) {
        check::throws<SidecarError>([&] { build(tracks, faces); }, __FILE__, __LINE__, "no sphere",
                                    [](const SidecarError& problem) {
                                        CHECK_EQUAL(problem.pointer(),
                                                    std::string("/blocks/0/faces"));
                                    });
    };
    const std::vector<Face> tetrahedron{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    build(4, tetrahedron);
    const auto joined = [&](const Face& moved, int apex) {  // a second tetrahedron on top
        std::vector<Face> faces = tetrahedron;
        const int map[4] = {moved[0], moved[1], moved[2], apex};
        for (const Face& f : tetrahedron) faces.push_back({map[f[0]], map[f[1]], map[f[2]]});
        return faces;
    };
    refused(8, joined({4, 5, 6}, 7));  // two pieces
    refused(7, joined({3, 4, 5}, 6));  // pinched at a vertex
    // Two octahedra that share their poles: v - e + f is 2 again, but they are pinched twice.
    std::vector<Face> poles;
    for (const int ring : {2, 6}) {
        for (int k = 0; k < 4; ++k) {
            poles.push_back({0, ring + k, ring + (k + 1) % 4});
            poles.push_back({1, ring + (k + 1) % 4, ring + k});
        }
    }
    build(6, {poles.begin(), poles.begin() + 8});
    refused(10, poles);
    // A torus of 3 by 3 squares.
    std::vector<Face> torus;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const int a = 3 * i + j, b = 3 * i + (j + 1) % 3, c = 3 * ((i + 1) % 3) + j,
                      d = 3 * ((i + 1) % 3) + (j + 1) % 3;
            torus.push_back({a, b, d});
            torus.push_back({a, d, c});
        }
    }
    refused(9, torus);
    // One and two colours have no faces, three a two-sided triangle.
    build(1, {});
    build(2, {});
    build(3, {{0, 1, 2}, {2, 1, 0}});
    refused(2, {{0, 1, 0}, {0, 0, 1}});
}

TEST(the_palette_goes_on_across_boundaries) {
    // A transition track from nowhere, one that ends nowhere, and block tracks that break off.
    spoiled("/transitions/0/tracks/3", [](SplitParts& p) {
        p.vertices.push_back({"x", {0, 0, 0}, 8});
        p.edges.push_back({"ex", 15, 11});
        p.sections[1].tracks[3] = {15, 11};
    });
    spoiled("/transitions/0/tracks/4", [](SplitParts& p) {
        p.vertices.push_back({"x", {0, 0, 0}, 10});
        p.edges.push_back({"ex", 10, 15});
        p.sections[1].tracks[4] = {10, 15};
    });
    // Through a boundary on one edge, but out of it on another of the same colour.
    spoiled("/transitions/0/tracks/0", [](SplitParts& p) {
        p.vertices.push_back({"x", {0, 0, 0}, 0});
        p.edges.push_back({"ex", 15, 1});
        p.sections[1].tracks[0] = {15, 1};
    });
    spoiled("/blocks/1/tracks/5", [](SplitParts& p) {
        p.vertices.push_back({"x", {0, 0, 0.5}, 10});
        p.vertices.push_back({"y", {0, 0, 0.5}, 20});
        p.edges.push_back({"ex", 15, 16});
        p.sections[2].tracks.push_back({15, 16});
        auto& faces = p.sections[2].faces;
        faces.pop_back();
        for (const Face& f : std::vector<Face>{{2, 3, 5}, {3, 4, 5}, {4, 2, 5}}) faces.push_back(f);
    });
}
