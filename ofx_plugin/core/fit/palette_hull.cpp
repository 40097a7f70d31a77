#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/reconstruction.hpp"
#include "model/vec3.hpp"

namespace palette4d {
namespace {

LossEdge edge_of(const std::vector<Vec3>& v, int from, int to) {
    const Vec3 along = v[to] - v[from];
    const double length2 = dot(along, along);
    const bool some = length2 > std::numeric_limits<double>::min();
    LossEdge edge{{from, to}, {}, {}, some ? 1 / length2 : 0};
    for (int c = 0; c < 3; ++c) {
        edge.from[c] = v[from][c];
        edge.along[c] = along[c];
    }
    return edge;
}

LossFacet facet_of(const std::vector<Vec3>& v, const Face& at, const Vec3& normal, double offset) {
    const Vec3 ab = v[at[1]] - v[at[0]], ac = v[at[2]] - v[at[0]];
    const Vec3 n = cross(ab, ac);
    const double scale = 1 / dot(n, n);
    const Vec3 slope[2] = {scale * cross(ac, n), scale * cross(n, ab)};
    LossFacet f{{at[0], at[1], at[2]}, {}, {}, offset, {}, {}};
    for (int c = 0; c < 3; ++c) {
        f.normal[c] = normal[c];
        f.high[c] = normal[c] > 0;
        for (int i = 0; i < 2; ++i) f.slope[i][c] = slope[i][c];
    }
    for (int i = 0; i < 2; ++i) f.start[i] = -dot(slope[i], v[at[0]]);
    return f;
}

}  // namespace

void PaletteHull::build(const std::vector<Vec3>& v) {
    facets.clear();
    edges.clear();
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
    if (facets.empty())  // all on a line, or one colour: the segments between all pairs
        for (int i = 0; i < n; ++i)
            for (int j = i; j < n; ++j)
                if (i != j || n == 1) facets.push_back({{i, i, j}, {}, {}, 0, {}, {}});
    for (const LossFacet& f : facets)
        for (int e = 0; e < 3; ++e) {
            const int from = std::min(f.at[e], f.at[(e + 1) % 3]),
                      to = std::max(f.at[e], f.at[(e + 1) % 3]);
            const auto same = [from, to](const LossEdge& edge) {
                return edge.at[0] == from && edge.at[1] == to;
            };
            if (std::none_of(edges.begin(), edges.end(), same))
                edges.push_back(edge_of(v, from, to));
        }
}

}  // namespace palette4d
