#include "fit/progressive_hull.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <queue>
#include <stdexcept>

#include "fit/linear_program.hpp"
#include "model/vec3.hpp"

namespace palette4d {
namespace {

constexpr double kBound = 4;  // new vertices stay within [-kBound, 1 + kBound]

class Mesh {
public:
    Mesh(const std::vector<Vec3>& rgb, const std::vector<Face>& faces)
        : position_(rgb), faces_(faces), alive_(faces.size(), true), at_(rgb.size()) {
        for (int f = 0; f < static_cast<int>(faces_.size()); ++f)
            for (int v : faces_[f]) insert(at_[v], f);
        std::map<std::pair<int, int>, int> directed;
        for (const Face& f : faces_)
            for (int e = 0; e < 3; ++e) ++directed[{f[e], f[(e + 1) % 3]}];
        for (const auto& [edge, n] : directed) {
            const auto back = directed.find({edge.second, edge.first});
            if (n != 1 || back == directed.end() || back->second != 1)
                throw std::invalid_argument("progressive_hull needs a closed, oriented mesh");
        }
        for (const auto& a : at_) left_ += !a.empty();
    }

    std::vector<Vec3> simplify(int target) {
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (int e = 0; e < 3; ++e)
                if (faces_[f][e] < faces_[f][(e + 1) % 3])
                    push(faces_[f][e], faces_[f][(e + 1) % 3]);
        while (left_ > target && !queue_.empty()) {
            const Entry entry = queue_.top();
            queue_.pop();
            const auto current = stamp_.find({entry.a, entry.b});
            if (current == stamp_.end() || current->second != entry.stamp) continue;
            contract(entry);
        }
        std::vector<Vec3> out;
        for (std::size_t v = 0; v < at_.size(); ++v)
            if (!at_[v].empty()) out.push_back(position_[v]);
        return out;
    }

private:
    using Sorted = std::vector<int>;  // a small set, rising

    static bool has(const Sorted& set, int x) {
        return std::binary_search(set.begin(), set.end(), x);
    }
    static void insert(Sorted& set, int x) {
        const auto at = std::lower_bound(set.begin(), set.end(), x);
        if (at == set.end() || *at != x) set.insert(at, x);
    }
    static void erase(Sorted& set, int x) {
        const auto at = std::lower_bound(set.begin(), set.end(), x);
        if (at != set.end() && *at == x) set.erase(at);
    }
    static Sorted united(const Sorted& a, const Sorted& b) {
        Sorted out;
        out.reserve(a.size() + b.size());
        std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
        return out;
    }

    struct Entry {
        double volume;
        int a, b;
        long stamp;
        Vec3 x;
        bool operator<(const Entry& o) const {  // the queue's top is the smallest volume
            if (volume != o.volume) return volume > o.volume;
            return a != o.a ? a > o.a : b > o.b;
        }
    };

    Sorted neighbours(int v) const {
        Sorted out;
        out.reserve(2 * at_[v].size());
        for (int f : at_[v])
            for (int w : faces_[f])
                if (w != v) out.push_back(w);
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
        return out;
    }

    void push(int a, int b) {
        if (a > b) std::swap(a, b);
        stamp_.erase({a, b});
        // Contracting keeps the mesh a sphere only when the ends share exactly two neighbours.
        const Sorted na = neighbours(a), nb = neighbours(b);
        const std::size_t shared = na.size() + nb.size() - united(na, nb).size();
        if (shared != 2 || !has(na, b)) return;

        const Sorted around = united(at_[a], at_[b]);
        std::vector<HalfSpace<3>> constraints;
        constraints.reserve(around.size());
        Vec3 objective{0, 0, 0};
        double constant = 0;
        for (int f : around) {
            const Vec3& p = position_[faces_[f][0]];
            Vec3 n = cross(position_[faces_[f][1]] - p, position_[faces_[f][2]] - p);
            // volume of the tetrahedron over the face: (n . x - n . p) / 6 with n of length 2 area
            for (int c = 0; c < 3; ++c) objective[c] += n[c] / 6;
            constant -= dot(n, p) / 6;
            const double length = std::sqrt(dot(n, n));
            if (length < 1e-15) continue;
            for (double& x : n) x /= length;
            constraints.push_back({n, dot(n, p)});
        }
        const auto x = minimise(objective, constraints, {-kBound, -kBound, -kBound},
                                {1 + kBound, 1 + kBound, 1 + kBound});
        if (!x) return;
        const double volume = std::max(0.0, dot(objective, *x) + constant);
        stamp_[{a, b}] = ++clock_;
        queue_.push({volume, a, b, clock_, *x});
    }

    void contract(const Entry& entry) {
        const int a = entry.a, b = entry.b;
        const Sorted other = neighbours(b);
        Sorted ring = united(neighbours(a), other);
        erase(ring, a);
        erase(ring, b);
        for (int w : other) stamp_.erase({std::min(b, w), std::max(b, w)});
        const Sorted faces_b = at_[b];
        for (int f : faces_b) {
            if (has(at_[a], f)) {
                for (int v : faces_[f]) erase(at_[v], f);
                alive_[f] = false;
                continue;
            }
            for (int& v : faces_[f])
                if (v == b) v = a;
            insert(at_[a], f);
        }
        at_[b].clear();
        position_[a] = entry.x;
        --left_;
        // All edges with a changed face: at a, on the ring, and from the ring outwards.
        std::vector<std::pair<int, int>> touched;
        for (int v : ring)
            for (int w : neighbours(v)) touched.emplace_back(std::min(v, w), std::max(v, w));
        std::sort(touched.begin(), touched.end());
        touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
        for (const auto& [v, w] : touched) push(v, w);
    }

    std::vector<Vec3> position_;
    std::vector<Face> faces_;
    std::vector<bool> alive_;
    std::vector<Sorted> at_;  // the faces of each vertex
    std::map<std::pair<int, int>, long> stamp_;
    std::priority_queue<Entry> queue_;
    long clock_ = 0;
    int left_ = 0;
};

}  // namespace

std::vector<Vec3> progressive_hull(const std::vector<Vec3>& rgb, const std::vector<Face>& faces,
                                   int target) {
    if (rgb.empty()) throw std::invalid_argument("progressive_hull needs at least four vertices");
    for (const Face& f : faces)
        for (int v : f)
            if (v < 0 || v >= static_cast<int>(rgb.size()))
                throw std::invalid_argument("a face names vertex " + std::to_string(v));
    for (const Vec3& v : rgb)
        if (!finite(v)) throw std::invalid_argument("progressive_hull needs finite vertices");
    // Bounds and tolerances assume colours of about unit size, so work in a unit cube.
    Vec3 low = rgb.at(0), high = rgb.at(0);
    for (const Vec3& v : rgb)
        for (int c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], v[c]);
            high[c] = std::max(high[c], v[c]);
        }
    const double extent = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    const double scale = extent > 0 ? extent : 1;
    std::vector<Vec3> unit(rgb);
    for (Vec3& v : unit)
        for (int c = 0; c < 3; ++c) v[c] = (v[c] - low[c]) / scale;
    std::vector<Vec3> out = Mesh(unit, faces).simplify(std::max(4, target));
    for (Vec3& v : out)
        for (int c = 0; c < 3; ++c) v[c] = low[c] + scale * v[c];
    return out;
}

}  // namespace palette4d
