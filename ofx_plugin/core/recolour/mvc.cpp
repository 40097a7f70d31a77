#include "recolour/mvc.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

constexpr double kPi = 3.14159265358979323846;
/// Distances below this share of the palette's extent count as rounding.
constexpr double kRounding = 1e-12;
/// A face whose height is below this share of its longest side has no usable normal. Skipping it
/// changes mean value coordinates by about that share.
constexpr double kThin = 1e-8;
/// Closer to a face's plane than this share of the distance to its nearest corner, terms of the
/// mean vector cancel. They are then computed as differences from their values in the plane.
constexpr double kNearPlane = 0.05;
/// A total weight below this share of the weights' magnitudes counts as rounding.
constexpr double kVanishing = 1e-11;
/// Farther out than this many extents, the weights are large and of both signs: too few digits
/// remain to reproduce the colour.
constexpr double kFar = 1000;
/// Colours farther out are first pulled in to this distance, so that no product overflows.
constexpr double kReach = 1e30;

void set_to(double value, std::size_t n, double* weights) {
    std::fill(weights, weights + n, value);
}

}  // namespace

PaletteBody::PaletteBody(std::vector<Vec3> rgb, std::vector<Face> faces)
    : rgb_(std::move(rgb)), faces_(std::move(faces)) {
    const int n = static_cast<int>(rgb_.size());
    if (n == 0) throw std::invalid_argument("a palette without colours; expected at least one");
    for (std::size_t i = 0; i < rgb_.size(); ++i) {
        if (!finite(rgb_[i])) {
            throw std::invalid_argument("palette colour " + std::to_string(i) +
                                        " is not finite; expected finite colours");
        }
    }
    if (n < 3 && !faces_.empty()) {
        throw std::invalid_argument("faces in a palette of fewer than three colours");
    }
    if (n >= 3 && faces_.empty()) {
        throw std::invalid_argument("a palette of " + std::to_string(n) +
                                    " colours without faces; expected a closed surface");
    }

    Vec3 low = rgb_[0], high = rgb_[0];
    double largest = 0;
    for (const Vec3& colour : rgb_) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], colour[c]);
            high[c] = std::max(high[c], colour[c]);
            largest = std::max(largest, std::abs(colour[c]));
        }
    }
    extent_ = norm(high - low);
    tolerance_ = kRounding * extent_ + 2 * std::numeric_limits<double>::epsilon() * largest;

    std::map<std::pair<int, int>, int> edge_of;
    planes_.reserve(faces_.size());
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        const Face& face = faces_[f];
        Plane plane{};
        double longest2 = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            if (face[k] < 0 || face[k] >= n) {
                throw std::invalid_argument("face " + std::to_string(f) + " has corner " +
                                            std::to_string(face[k]) + "; expected 0 to " +
                                            std::to_string(n - 1));
            }
            const int a = face[(k + 1) % 3], b = face[(k + 2) % 3];
            const auto key = std::minmax(a, b);
            const auto [at, added] = edge_of.insert({key, static_cast<int>(edges_.size())});
            if (added) edges_.push_back({key.first, key.second});
            plane.sides[k] = {at->second, a < b ? 1.0 : -1.0};
        }
        for (std::size_t k = 0; k < 3; ++k) {
            plane.along[k] = rgb_[face[(k + 2) % 3]] - rgb_[face[(k + 1) % 3]];
            plane.length2[k] = dot(plane.along[k], plane.along[k]);
            longest2 = std::max(longest2, plane.length2[k]);
        }
        // The corner opposite the longest side: its two sides give the most precise normal.
        const auto corner = static_cast<std::size_t>(
            std::max_element(plane.length2.begin(), plane.length2.end()) - plane.length2.begin());
        const Vec3 area = cross(plane.along[(corner + 1) % 3], plane.along[(corner + 2) % 3]);
        plane.twice_area = norm(area);
        plane.degenerate = !(plane.twice_area > kThin * longest2);
        if (!plane.degenerate) plane.normal = (1.0 / plane.twice_area) * area;
        planes_.push_back(plane);
    }

    const auto first_plane = std::find_if(planes_.begin(), planes_.end(),
                                          [](const Plane& plane) { return !plane.degenerate; });
    if (first_plane != planes_.end()) {
        const Vec3& corner = rgb_[faces_[first_plane - planes_.begin()][0]];
        flat_ = std::all_of(rgb_.begin(), rgb_.end(), [&](const Vec3& colour) {
            return std::abs(dot(first_plane->normal, colour - corner)) <= tolerance_;
        });
    }
    // The two sides of a flat body may have different triangles. Every colour uses the same side,
    // or its weights would jump at the other side's edges.
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        if (flat_ && (planes_[f].degenerate || dot(planes_[f].normal, first_plane->normal) < 0)) {
            continue;
        }
        skin_.push_back(f);
    }

    convex_ = !planes_.empty() && !flat_;
    for (std::size_t f = 0; convex_ && f < faces_.size(); ++f) {
        if (planes_[f].degenerate) convex_ = false;
        for (const Vec3& colour : rgb_) {
            if (dot(planes_[f].normal, colour - rgb_[faces_[f][0]]) > tolerance_) convex_ = false;
        }
    }
}

Vec3 PaletteBody::within_reach(const Vec3& p) const {
    const double size = std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
    return size > kReach ? Vec3{p[0] / size * kReach, p[1] / size * kReach, p[2] / size * kReach}
                         : p;
}

PaletteBody::Closest PaletteBody::closest_on_segment(const Vec3& p, int a, int b) const {
    const Vec3 along = rgb_[b] - rgb_[a];
    const double length2 = dot(along, along);
    const double at = length2 > 0 ? dot(p - rgb_[a], along) / length2 : 0.0;
    const double t = std::clamp(at, 0.0, 1.0);
    const Vec3 q = t < 1.0 ? rgb_[a] + t * along : rgb_[b];
    return {q, norm(p - q), {a, b, a}, {1.0 - t, t, 0.0}};
}

PaletteBody::Closest PaletteBody::closest_on_face(const Vec3& p, std::size_t f) const {
    const Face& face = faces_[f];
    const Plane& plane = planes_[f];
    if (!plane.degenerate) {
        std::array<double, 3> weights;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 from_side = p - rgb_[face[(k + 1) % 3]];
            weights[k] = dot(plane.normal, cross(plane.along[k], from_side)) / plane.twice_area;
        }
        const double sum = weights[0] + weights[1] + weights[2];
        if (weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0 && sum > 0.5) {
            Vec3 q{};
            for (std::size_t k = 0; k < 3; ++k) {
                weights[k] /= sum;
                q = q + weights[k] * rgb_[face[k]];
            }
            return {q, norm(p - q), face, weights};
        }
    }
    Closest best = closest_on_segment(p, face[0], face[1]);
    for (std::size_t k = 1; k < 3; ++k) {
        const Closest other = closest_on_segment(p, face[k], face[(k + 1) % 3]);
        if (other.distance < best.distance) best = other;
    }
    return best;
}

PaletteBody::Closest PaletteBody::closest_point(const Vec3& p, bool visible_only) const {
    Closest best{};
    best.distance = std::numeric_limits<double>::infinity();
    for (const std::size_t f : skin_) {
        if (visible_only && dot(planes_[f].normal, rgb_[faces_[f][0]] - p) > tolerance_) {
            continue;
        }
        const Closest here = closest_on_face(p, f);
        // Of faces at the same distance the first one wins, whatever the rounding.
        if (here.distance < best.distance - tolerance_) best = here;
    }
    return best;
}

double PaletteBody::winding_number(const Vec3& p) const {
    double sum = 0;
    for (const Face& face : faces_) {
        const Vec3 a = rgb_[face[0]] - p, b = rgb_[face[1]] - p, c = rgb_[face[2]] - p;
        const double la = norm(a), lb = norm(b), lc = norm(c);
        sum += std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (2 * kPi);
}

void PaletteBody::spread(const Closest& closest, double* weights) const {
    set_to(0, rgb_.size(), weights);
    for (std::size_t k = 0; k < 3; ++k) weights[closest.corners[k]] += closest.weights[k];
}

void PaletteBody::prepare_edges(Workspace& w) const {
    const std::size_t edges = edges_.size();
    w.edge_cross_.resize(edges);
    w.edge_dot_.resize(edges);
    w.edge_sine_.resize(edges);
    w.edge_angle_.resize(edges);
    for (std::size_t e = 0; e < edges; ++e) {
        const Vec3& a = w.to_vertex_[edges_[e][0]];
        const Vec3& b = w.to_vertex_[edges_[e][1]];
        w.edge_cross_[e] = cross(a, b);
        w.edge_dot_[e] = dot(a, b);
        w.edge_sine_[e] = norm(w.edge_cross_[e]);
        w.edge_angle_[e] = std::atan2(w.edge_sine_[e], w.edge_dot_[e]);
    }
}

// The mean vector m of a face seen from p is the integral of the unit normals over its spherical
// triangle: m = 1/2 sum_j theta_j c_j / |c_j|. Here v = corner - p, c_j = v_{j+1} x v_{j+2}, and
// theta_j is the angle between these two. The corners' weights solve sum_i w_i v_i = m, hence
// w_i = m . c_i / det(v). Over a closed surface the mean vectors cancel, so p is the weighted mean
// of the corners.
//
// Close to the face's plane, at height h, det(v) = 2 h area goes to zero. There every c_j is split
// into a_j n and h n x e_j. n is the unit normal, e_j the side, and a_j twice the area that p's
// foot spans with side j. This gives w_i = (a_i S + h^2 e_i . E) / (4 h area) with S = sum_j
// theta_j a_j / |c_j| and E = sum_j theta_j e_j / |c_j|. S is 2 pi above the face and nearly zero
// beside it. Seen from the foot, the angles with the signs of the a_j sum to exactly 2 pi or 0.
// Only the differences from that sum, all of order h^2, are added. So no precision is lost, even
// when h is as small as the rounding.
bool PaletteBody::mean_value(const Vec3& p, double* weights, Workspace& w) const {
    const std::size_t n = rgb_.size();
    set_to(0, n, weights);
    w.to_vertex_.resize(n);
    w.distance_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        w.to_vertex_[i] = rgb_[i] - p;
        w.distance_[i] = norm(w.to_vertex_[i]);
        if (w.distance_[i] <= tolerance_) {
            weights[i] = 1;
            return true;
        }
    }
    if (w.distance_[0] > kFar * extent_) return false;
    prepare_edges(w);

    for (std::size_t f = 0; f < faces_.size(); ++f) {
        const Plane& plane = planes_[f];
        if (plane.degenerate) continue;
        const Face& face = faces_[f];
        std::size_t nearest = 0;
        for (std::size_t k = 1; k < 3; ++k) {
            if (w.distance_[face[k]] < w.distance_[face[nearest]]) nearest = k;
        }
        const double h = dot(plane.normal, w.to_vertex_[face[nearest]]);
        std::array<double, 3> weight;

        if (std::abs(h) > kNearPlane * w.distance_[face[nearest]]) {
            std::array<Vec3, 3> c;
            Vec3 mean{};
            for (std::size_t k = 0; k < 3; ++k) {
                const Side& side = plane.sides[k];
                c[k] = side.sign * w.edge_cross_[side.edge];
                const double sine = w.edge_sine_[side.edge];
                if (sine > 0) mean = mean + (w.edge_angle_[side.edge] / sine) * c[k];
            }
            const double scale = 1 / (2 * h * plane.twice_area);
            for (std::size_t k = 0; k < 3; ++k) weight[k] = scale * dot(mean, c[k]);
        } else {
            std::array<double, 3> a;
            bool beside = false, off = false;
            for (std::size_t k = 0; k < 3; ++k) {
                const Side& side = plane.sides[k];
                a[k] = side.sign * dot(plane.normal, w.edge_cross_[side.edge]);
                if (a[k] < 0) beside = true;
                if (a[k] < -tolerance_ * std::sqrt(plane.length2[k])) off = true;
            }
            if (std::abs(h) <= tolerance_) {
                if (off) continue;
                // On the face: its barycentric weights.
                double sum = 0;
                for (double& part : a) sum += part = std::max(part, 0.0);
                set_to(0, n, weights);
                for (std::size_t k = 0; k < 3; ++k) weights[face[k]] = a[k] / sum;
                return true;
            }
            double S = beside ? 0 : 2 * kPi;
            Vec3 E{};
            for (std::size_t k = 0; k < 3; ++k) {
                const Side& side = plane.sides[k];
                const double area = std::abs(a[k]);
                const double sine = std::sqrt(area * area + h * h * plane.length2[k]);
                const double cosine = w.edge_dot_[side.edge];
                const double flat_cosine = cosine - h * h;
                const double angle = std::atan2(sine, cosine);
                const double more_than_flat =
                    std::atan2(h * h * (flat_cosine * plane.length2[k] / (sine + area) - area),
                               flat_cosine * cosine + sine * area);
                const double tilt = h * h * plane.length2[k] / (sine * (sine + area));
                const double change = more_than_flat - angle * tilt;
                S += a[k] < 0 ? -change : change;
                E = E + (angle / sine) * plane.along[k];
            }
            const double scale = 1 / (2 * plane.twice_area);
            for (std::size_t k = 0; k < 3; ++k) {
                weight[k] = scale * (a[k] * S / h + h * dot(plane.along[k], E));
            }
        }
        for (std::size_t k = 0; k < 3; ++k) weights[face[k]] += weight[k];
    }

    double total = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i) {
        total += weights[i];
        size += std::abs(weights[i]);
    }
    if (!(std::abs(total) > kVanishing * size) || !std::isfinite(size)) return false;
    for (std::size_t i = 0; i < n; ++i) weights[i] /= total;
    return true;
}

Projection PaletteBody::project(const Vec3& p, double* weights, Workspace& workspace) const {
    const std::size_t n = rgb_.size();
    if (!finite(p)) {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        set_to(nan, n, weights);
        return {p, nan, false};
    }
    const Vec3 near = within_reach(p);
    Closest closest{};
    if (n <= 2) {
        closest = closest_on_segment(near, 0, static_cast<int>(n) - 1);
    } else if (convex_) {
        bool inside = true;
        for (std::size_t f = 0; inside && f < faces_.size(); ++f) {
            inside = dot(planes_[f].normal, rgb_[faces_[f][0]] - near) >= 0;
        }
        if (inside && mean_value(near, weights, workspace)) return {p, 0, true};
        closest = closest_point(near, true);
    } else {
        closest = closest_point(near, false);
        if (!flat_ && closest.distance > tolerance_ && std::abs(winding_number(near)) > 0.5 &&
            mean_value(near, weights, workspace)) {
            return {p, 0, true};
        }
    }
    spread(closest, weights);
    if (closest.distance <= tolerance_) return {p, 0, true};
    const Vec3 apart = p - closest.q;
    return {closest.q, std::hypot(apart[0], apart[1], apart[2]), false};
}

}  // namespace palette4d
