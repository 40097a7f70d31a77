#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <queue>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "fit/linear_program.hpp"
#include "fit/progressive_hull.hpp"
#include "model/vec3.hpp"

namespace palette4d {
namespace {

constexpr double kBound = 4;  // new vertices stay within [-kBound, 1 + kBound] of a unit cube
constexpr double kThin = 1e-14;

using Point = std::array<double, 4>;
using Simplex = std::array<int, 4>;
using Plane = HalfSpace<4>;
/// A face of a link, or a ridge: at most three vertices, increasing, 21 bits each, never 0.
using FaceKey = std::uint64_t;
constexpr int kKeyBits = 21;
constexpr std::size_t kMostPoints = (std::size_t{1} << kKeyBits) - 1;

FaceKey with_vertex(FaceKey key, int v) { return key << kKeyBits | (static_cast<FaceKey>(v) + 1); }

/// Insertion sort: GCC 12 warns about std::sort on so few elements.
void sort_few(int* numbers, int count) {
    for (int i = 1; i < count; ++i)
        for (int j = i; j > 0 && numbers[j] < numbers[j - 1]; --j)
            std::swap(numbers[j], numbers[j - 1]);
}

double dot(const Point& a, const Point& b) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += a[i] * b[i];
    return sum;
}

/// The vector perpendicular to three vectors: the cofactors of a determinant's first row. Its
/// product with x - p is 4! times the volume of the simplex between the facet and x.
Point normal_of(const std::array<Point, 3>& rows) {
    Point out;
    for (int skip = 0; skip < 4; ++skip) {
        std::array<Vec3, 3> m;
        for (int r = 0; r < 3; ++r)
            for (int c = 0, to = 0; c < 4; ++c)
                if (c != skip) m[r][to++] = rows[r][c];
        const double minor = palette4d::dot(m[0], cross(m[1], m[2]));
        out[skip] = skip % 2 == 0 ? minor : -minor;
    }
    return out;
}

class Hull {
public:
    Hull(const std::vector<Point>& points, const std::vector<Simplex>& simplices,
         const std::vector<Plane>& limits)
        : points_(points),
          simplices_(simplices),
          planes_(simplices.size()),
          stars_(points.size()),
          links_(points.size()),
          touched_(points.size(), 0),
          limits_(limits) {
        for (int s = 0; s < static_cast<int>(simplices_.size()); ++s)
            for (int v : simplices_[s]) stars_[v].push_back(s);
        Point centre{};
        for (std::size_t v = 0; v < points_.size(); ++v) {
            if (stars_[v].empty()) continue;
            ++left_;
            for (int i = 0; i < 4; ++i) centre[i] += points_[v][i];
        }
        for (double& x : centre) x /= left_;
        for (int s = 0; s < static_cast<int>(simplices_.size()); ++s) {
            planes_[s] = plane_of(simplices_[s]);
            if (dot(planes_[s].a, centre) < planes_[s].b) continue;
            std::swap(simplices_[s][0], simplices_[s][1]);
            planes_[s] = plane_of(simplices_[s]);
        }
    }

    std::vector<Point> simplify(int target) {
        for (int v = 0; v < static_cast<int>(points_.size()); ++v)
            for (int w : neighbours(v))
                if (v < w) evaluate(v, w);
        while (left_ > target && !queue_.empty()) {
            const Entry entry = queue_.top();
            queue_.pop();
            const auto current = stamp_.find({entry.a, entry.b});
            if (current == stamp_.end() || current->second != entry.stamp) continue;
            // Its facets have changed since it was queued, so its cost is outdated.
            if (std::max(touched_[entry.a], touched_[entry.b]) > entry.stamp)
                evaluate(entry.a, entry.b);
            else
                contract(entry);
        }
        std::vector<Point> out;
        for (std::size_t v = 0; v < points_.size(); ++v)
            if (!stars_[v].empty()) out.push_back(points_[v]);
        return out;
    }

private:
    struct Entry {
        double volume;
        int a, b;
        long stamp;
        Point x;
        bool operator<(const Entry& o) const {  // the queue's top is the smallest volume
            if (volume != o.volume) return volume > o.volume;
            return a != o.a ? a > o.a : b > o.b;
        }
    };

    /// The facet's plane a . x = b. a is the outward normal, (N - 1)! times the area long.
    Plane plane_of(const Simplex& s) const {
        std::array<Point, 3> rows;
        for (int r = 1; r < 4; ++r)
            for (int i = 0; i < 4; ++i) rows[r - 1][i] = points_[s[r]][i] - points_[s[0]][i];
        const Point a = normal_of(rows);
        return {a, dot(a, points_[s[0]])};
    }

    std::vector<int> neighbours(int v) const {
        std::vector<int> out;
        for (int s : stars_[v])
            for (int w : simplices_[s])
                if (w != v) out.push_back(w);
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
        return out;
    }

    bool has(int s, int v) const {
        return std::find(simplices_[s].begin(), simplices_[s].end(), v) != simplices_[s].end();
    }

    /// All faces of the simplices around v (and w, unless w is v), without v and w.
    std::vector<FaceKey> link(int v, int w) const {
        std::vector<FaceKey> out;
        for (int s : stars_[v]) {
            if (!has(s, w)) continue;
            Simplex rest;
            int count = 0;
            for (int u : simplices_[s])
                if (u != v && u != w) rest[count++] = u;
            sort_few(rest.data(), count);
            for (int subset = 1; subset < 1 << count; ++subset) {
                FaceKey face = 0;
                for (int i = 0; i < count; ++i)
                    if (subset >> i & 1) face = with_vertex(face, rest[i]);
                out.push_back(face);
            }
        }
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
        return out;
    }

    const std::vector<FaceKey>& link_of(int v) {
        if (links_[v].empty()) links_[v] = link(v, v);
        return links_[v];
    }

    /// Whether the hull stays a sphere when a and b merge: the common part of both links must be
    /// the link of their edge (the link condition of Dey et al. 1999).
    bool contractible(int a, int b) {
        const std::vector<FaceKey>&of_a = link_of(a), &of_b = link_of(b);
        std::vector<FaceKey> shared;
        std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                              std::back_inserter(shared));
        return shared == link(a, b);
    }

    /// Queues the edge with the volume that its contraction adds, unless it cannot be contracted.
    void evaluate(int a, int b) {
        if (a > b) std::swap(a, b);
        stamp_.erase({a, b});
        waiting_.insert({a, b});
        if (!contractible(a, b)) return;
        std::vector<int> around;
        std::set_union(stars_[a].begin(), stars_[a].end(), stars_[b].begin(), stars_[b].end(),
                       std::back_inserter(around));
        Point objective{};
        double constant = 0;
        std::vector<Plane> constraints(limits_);
        for (int s : around) {
            Plane plane = planes_[s];
            for (int i = 0; i < 4; ++i) objective[i] += plane.a[i];
            constant -= plane.b;
            const double length = std::sqrt(dot(plane.a, plane.a));
            if (length < kThin) continue;
            for (double& x : plane.a) x /= length;
            plane.b /= length;
            constraints.push_back(plane);
        }
        Point low, high;
        low.fill(-kBound);
        high.fill(1 + kBound);
        const auto x = minimise_by_need(objective, constraints, low, high);
        if (!x) return;
        waiting_.erase({a, b});
        stamp_[{a, b}] = ++clock_;
        queue_.push({std::max(0.0, dot(objective, *x) + constant), a, b, clock_, *x});
    }

    void contract(const Entry& entry) {
        const int a = entry.a, b = entry.b;
        for (int w : neighbours(b)) {
            const std::pair<int, int> edge{std::min(b, w), std::max(b, w)};
            stamp_.erase(edge);
            waiting_.erase(edge);
        }
        std::vector<int> star;
        for (int s : stars_[a])
            if (!has(s, b)) star.push_back(s);
        for (int s : stars_[b]) {
            if (has(s, a)) {
                for (int v : simplices_[s])
                    if (v != a && v != b)
                        stars_[v].erase(std::find(stars_[v].begin(), stars_[v].end(), s));
                continue;
            }
            std::replace(simplices_[s].begin(), simplices_[s].end(), b, a);
            star.push_back(s);
        }
        std::sort(star.begin(), star.end());
        stars_[a] = star;
        stars_[b].clear();
        points_[a] = entry.x;
        --left_;
        ++clock_;
        for (int s : star) planes_[s] = plane_of(simplices_[s]);
        const std::vector<int> ring = neighbours(a);
        touched_[a] = clock_;
        links_[a].clear();
        for (int w : ring) {
            touched_[w] = clock_;
            links_[w].clear();
        }
        for (int w : ring) evaluate(a, w);
        // Other edges with changed facets: queued ones are evaluated when their turn comes. Edges
        // that could not be contracted may be possible now.
        std::set<std::pair<int, int>> again;
        for (int v : ring)
            for (int w : neighbours(v)) {
                const std::pair<int, int> edge{std::min(v, w), std::max(v, w)};
                if (w != a && waiting_.count(edge) != 0) again.insert(edge);
            }
        for (const auto& [v, w] : again) evaluate(v, w);
    }

    std::vector<Point> points_;
    std::vector<Simplex> simplices_;
    std::vector<Plane> planes_;
    std::vector<std::vector<int>> stars_;      // facets at each vertex, increasing
    std::vector<std::vector<FaceKey>> links_;  // links of vertices that were requested
    std::vector<long> touched_;                // when a facet at the vertex last changed
    std::vector<Plane> limits_;
    std::map<std::pair<int, int>, long> stamp_;
    std::set<std::pair<int, int>> waiting_;  // edges that cannot be contracted now
    std::priority_queue<Entry> queue_;
    long clock_ = 0;
    int left_ = 0;
};

void check(const std::vector<Point>& points, const std::vector<Simplex>& simplices,
           const std::vector<Plane>& limits) {
    for (const Point& p : points)
        for (double x : p)
            if (!std::isfinite(x))
                throw std::invalid_argument("a progressive hull needs finite points");
    for (const Plane& limit : limits)
        if (!std::isfinite(limit.b) || !std::isfinite(dot(limit.a, limit.a)))
            throw std::invalid_argument("a progressive hull needs finite limits");
    if (points.size() > kMostPoints)
        throw std::invalid_argument("a progressive hull takes at most " +
                                    std::to_string(kMostPoints) + " points, found " +
                                    std::to_string(points.size()));
    std::vector<FaceKey> ridges;
    for (const Simplex& s : simplices) {
        for (int v : s)
            if (v < 0 || v >= static_cast<int>(points.size()))
                throw std::invalid_argument("a facet names point " + std::to_string(v) + " of " +
                                            std::to_string(points.size()));
        Simplex sorted = s;
        sort_few(sorted.data(), 4);
        for (int skip = 0; skip < 4; ++skip) {
            FaceKey ridge = 0;
            for (int i = 0; i < 4; ++i)
                if (i != skip) ridge = with_vertex(ridge, sorted[i]);
            ridges.push_back(ridge);
        }
    }
    std::sort(ridges.begin(), ridges.end());
    bool closed = !ridges.empty();
    for (std::size_t i = 0; i < ridges.size(); i += 2)
        closed &= i + 1 < ridges.size() && ridges[i] == ridges[i + 1] &&
                  (i + 2 >= ridges.size() || ridges[i + 2] != ridges[i]);
    if (!closed)
        throw std::invalid_argument(
            "a progressive hull needs a closed hull, each ridge between two facets");
}

}  // namespace

std::vector<Point> progressive_hull_4d(const std::vector<Point>& points,
                                       const std::vector<Simplex>& simplices, int target,
                                       const std::vector<Plane>& limits) {
    check(points, simplices, limits);
    // Bounds and tolerances assume unit size; scaling keeps the order of volumes.
    Point low = points[simplices[0][0]], extent{};
    for (const Simplex& s : simplices)
        for (int v : s)
            for (int i = 0; i < 4; ++i) low[i] = std::min(low[i], points[v][i]);
    for (const Simplex& s : simplices)
        for (int v : s)
            for (int i = 0; i < 4; ++i) extent[i] = std::max(extent[i], points[v][i] - low[i]);
    for (double& x : extent)
        if (!(x > 0)) x = 1;
    std::vector<Point> unit(points);
    for (Point& p : unit)
        for (int i = 0; i < 4; ++i) p[i] = (p[i] - low[i]) / extent[i];
    std::vector<Plane> bounds;
    for (const Plane& limit : limits) {
        Plane bound{limit.a, limit.b - dot(limit.a, low)};
        for (int i = 0; i < 4; ++i) bound.a[i] *= extent[i];
        const double length = std::sqrt(dot(bound.a, bound.a));
        if (!(length > 0)) continue;
        for (double& x : bound.a) x /= length;
        bound.b /= length;
        bounds.push_back(bound);
    }
    std::vector<Point> out = Hull(unit, simplices, bounds).simplify(std::max(5, target));
    for (Point& p : out)
        for (int i = 0; i < 4; ++i) p[i] = low[i] + extent[i] * p[i];
    return out;
}

}  // namespace palette4d
