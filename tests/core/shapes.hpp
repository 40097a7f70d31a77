// Palettes, polytopes and random numbers that several tests use.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "model/polytope.hpp"

namespace shapes {

using palette4d::Edge;
using palette4d::Face;
using palette4d::Polytope;
using palette4d::Section;
using palette4d::Vec3;
using palette4d::Vertex;

/// The same numbers on every machine, unlike the distributions of <random>.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed * 2 + 1) {}
    double uniform(double low = 0, double high = 1) {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        std::uint64_t x = state_;
        x ^= x >> 33;
        x *= 0xff51afd7ed558ccdu;
        x ^= x >> 33;
        return low + (high - low) * (static_cast<double>(x >> 11) / 9007199254740992.0);
    }
    Vec3 colour(double low = 0, double high = 1) {
        const double r = uniform(low, high), g = uniform(low, high), b = uniform(low, high);
        return {r, g, b};
    }
    int below(int n) { return static_cast<int>(uniform() * n) % n; }

private:
    std::uint64_t state_;
};

struct Mesh {
    std::vector<Vec3> rgb;
    std::vector<Face> faces;
};

inline Mesh tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

inline Mesh cube() {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) {
        mesh.rgb.push_back({double(i & 1), double(i >> 1 & 1), double(i >> 2 & 1)});
    }
    const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        mesh.faces.push_back({q[0], q[1], q[2]});
        mesh.faces.push_back({q[0], q[2], q[3]});
    }
    return mesh;
}

/// A cube whose top is pushed in to a point below the middle: not convex.
inline Mesh concave_cube() {
    Mesh mesh = cube();
    mesh.rgb.push_back({0.5, 0.5, 0.3});
    mesh.faces.erase(mesh.faces.begin() + 2, mesh.faces.begin() + 4);
    const int top[4] = {4, 5, 7, 6};
    for (int k = 0; k < 4; ++k) mesh.faces.push_back({top[k], top[(k + 1) % 4], 8});
    return mesh;
}

/// Two-sided: the square's sides are cut along different diagonals.
inline Mesh flat_square() {
    return {{{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}},
            {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
}

inline Mesh flat_triangle() {
    return {{{0.1, 0.1, 0.1}, {0.9, 0.2, 0.1}, {0.2, 0.8, 0.7}}, {{0, 1, 2}, {0, 2, 1}}};
}

/// The convex hull of random points on an ellipsoid, built by adding one point after another.
inline Mesh random_convex(Random& random, int points) {
    Mesh mesh;
    const Vec3 radii{random.uniform(0.1, 0.6), random.uniform(0.1, 0.6), random.uniform(0.1, 0.6)};
    for (int i = 0; i < points; ++i) {
        const double z = random.uniform(-1, 1), a = random.uniform(0, 6.283185307179586);
        const double r = std::sqrt(1 - z * z);
        mesh.rgb.push_back({0.5 + radii[0] * r * std::cos(a), 0.5 + radii[1] * r * std::sin(a),
                            0.5 + radii[2] * z});
    }
    const auto side = [&](const Face& f, const Vec3& p) {
        const Vec3 &a = mesh.rgb[f[0]], &b = mesh.rgb[f[1]], &c = mesh.rgb[f[2]];
        const Vec3 u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const Vec3 v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        const Vec3 w{p[0] - a[0], p[1] - a[1], p[2] - a[2]};
        return w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) +
               w[2] * (u[0] * v[1] - u[1] * v[0]);
    };
    mesh.faces = side({0, 1, 2}, mesh.rgb[3]) < 0
                     ? std::vector<Face>{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}
                     : std::vector<Face>{{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}};
    for (int i = 4; i < points; ++i) {
        std::vector<Face> kept, seen;
        for (const Face& f : mesh.faces) (side(f, mesh.rgb[i]) > 0 ? seen : kept).push_back(f);
        for (const Face& f : seen) {
            for (int k = 0; k < 3; ++k) {
                const int a = f[k], b = f[(k + 1) % 3];
                bool inner = false;
                for (const Face& g : seen) {
                    for (int m = 0; m < 3; ++m) inner |= g[m] == b && g[(m + 1) % 3] == a;
                }
                if (!inner) kept.push_back({a, b, i});
            }
        }
        mesh.faces = kept;
    }
    return mesh;
}

/// Frames 0 to 20: block [0, 8] of four tracks, transition (8, 10) in which track 3 splits into
/// two, block [10, 20] of five tracks. Track 0 is one edge from 0 to 20, through both boundaries;
/// track 1 has a vertex at 5.5.
struct SplitParts {
    std::vector<Vertex> vertices;
    std::vector<Edge> edges;
    std::vector<Section> sections;
    Polytope build() const { return {vertices, edges, sections}; }
};

inline SplitParts split_parts() {
    SplitParts parts;
    parts.vertices = {
        {"a0", {0, 0, 0}, 0},        {"a1", {0.1, 0, 0}, 20},     // 0, 1
        {"b0", {1, 0, 0}, 0},        {"bm", {0.9, 0.1, 0}, 5.5},  // 2, 3
        {"b1", {0.8, 0, 0.1}, 20},                                // 4
        {"c0", {0, 1, 0}, 0},        {"c1", {0, 0.9, 0}, 8},      // 5, 6
        {"c2", {0.1, 0.9, 0}, 10},   {"c3", {0.2, 1, 0}, 20},     // 7, 8
        {"d0", {0, 0, 1}, 0},        {"d1", {0, 0, 0.8}, 8},      // 9, 10
        {"d2", {0, 0.2, 0.9}, 10},   {"d3", {0, 0.4, 1}, 20},     // 11, 12
        {"e2", {0.4, 0.1, 0.8}, 10}, {"e3", {0.6, 0, 1}, 20},     // 13, 14
    };
    parts.edges = {{"ea", 0, 1},    {"eb", 2, 3},    {"eb2", 3, 4},  {"ec", 5, 6},
                   {"ec2", 6, 7},   {"ec3", 7, 8},   {"ed", 9, 10},  {"ed2", 10, 11},
                   {"ed3", 11, 12}, {"ee2", 10, 13}, {"ee3", 13, 14}};
    const std::vector<Face> four{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    // Track 3 of `four` becomes 3 and 4: 4 takes the place of 3 between 0, 1 and 2.
    const std::vector<Face> five{{0, 2, 1}, {0, 1, 4}, {0, 4, 3}, {0, 3, 2}, {1, 2, 4}, {2, 3, 4}};
    parts.sections = {
        {0, 8, false, {{0, 1}, {2, 3, 4}, {5, 6}, {9, 10}}, four},
        {8, 10, true, {{0, 1}, {3, 4}, {6, 7}, {10, 11}, {10, 13}}, five},
        {10, 20, false, {{0, 1}, {3, 4}, {7, 8}, {11, 12}, {13, 14}}, five},
    };
    return parts;
}

}  // namespace shapes
