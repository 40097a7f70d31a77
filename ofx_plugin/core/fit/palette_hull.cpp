#include "fit/palette_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

void set_corners(LossFacet& f, const std::vector<Vec3>& v, const Face& at) {
    for (int e = 0; e < 3; ++e) {
        const Vec3& from = v[at[e]];
        const Vec3 along = v[at[(e + 1) % 3]] - from;
        f.at[e] = at[e];
        for (int c = 0; c < 3; ++c) {
            f.edges[e].from[c] = from[c];
            f.edges[e].along[c] = along[c];
        }
        const double length2 = dot(along, along);
        const bool some = length2 > std::numeric_limits<double>::min();
        f.edges[e].inverse_length2 = some ? 1 / length2 : 0;
    }
}

LossFacet facet_of(const std::vector<Vec3>& v, const Face& at, const Vec3& normal, double offset) {
    const Vec3 ab = v[at[1]] - v[at[0]], ac = v[at[2]] - v[at[0]];
    const Vec3 n = cross(ab, ac);
    const double scale = 1 / dot(n, n);
    const Vec3 slope[2] = {scale * cross(ac, n), scale * cross(n, ab)};
    LossFacet f{};
    set_corners(f, v, at);
    f.offset = offset;
    for (int c = 0; c < 3; ++c) {
        f.normal[c] = normal[c];
        f.high[c] = normal[c] > 0;
        for (int i = 0; i < 2; ++i) f.slope[i][c] = slope[i][c];
    }
    for (int i = 0; i < 2; ++i) f.start[i] = -dot(slope[i], v[at[0]]);
    return f;
}

/// A segment, as a degenerate triangle.
LossFacet segment_of(const std::vector<Vec3>& v, int from, int to) {
    LossFacet f{};
    set_corners(f, v, {from, from, to});
    return f;
}

}  // namespace

void PaletteHull::build(const std::vector<Vec3>& v) {
    facets.clear();
    solid = false;
    const int n = static_cast<int>(v.size());
    for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j)
            for (int k = j + 1; k < n; ++k) {
                Vec3 normal = cross(v[j] - v[i], v[k] - v[i]);
                const double length = std::sqrt(dot(normal, normal));
                if (length < 1e-14) continue;
                for (double& x : normal) x /= length;
                const double offset = -dot(normal, v[i]);
                double low = 0, high = 0;
                for (int m = 0; m < n; ++m) {
                    if (m == i || m == j || m == k) continue;
                    const double d = dot(normal, v[m]) + offset;
                    low = std::min(low, d);
                    high = std::max(high, d);
                    if (low < -kFlat && high > kFlat) break;
                }
                if (low < -kFlat && high > kFlat) continue;
                if (high > kFlat) {
                    facets.push_back(facet_of(v, {i, k, j}, -1 * normal, -offset));
                    solid = true;
                } else {
                    facets.push_back(facet_of(v, {i, j, k}, normal, offset));
                    solid = solid || low < -kFlat;
                }
            }
    if (solid || !facets.empty()) return;
    // All on a line (or one colour): the segments between all pairs.
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j)
            if (i != j || n == 1) facets.push_back(segment_of(v, i, j));
}

}  // namespace palette4d
