// The peer of bench_recolour.py: recolouring as the papers write it down, one pixel after another
// in double precision. Mean value coordinates by the formula of Ju, Schaefer and Warren (2005),
// with its angles by asin and its spherical cosines; pixels outside at the closest point of the
// surface. No care for what lies on faces, edges and vertices, nothing shared, nothing remembered.
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace {

using Vec3 = std::array<double, 3>;

Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Palette {
    std::vector<Vec3> rgb, delta;
    std::vector<std::array<int, 3>> faces;
};

bool inside(const Palette& palette, const Vec3& p) {
    double angle = 0;
    for (const auto& face : palette.faces) {
        const Vec3 a = minus(palette.rgb[face[0]], p), b = minus(palette.rgb[face[1]], p),
                   c = minus(palette.rgb[face[2]], p);
        const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)),
                     lc = std::sqrt(dot(c, c));
        angle += std::atan2(dot(a, cross(b, c)),
                            la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return std::abs(angle) > 3.14159265358979323846;
}

void mean_value(const Palette& palette, const Vec3& p, std::vector<double>& weights) {
    weights.assign(palette.rgb.size(), 0);
    for (const auto& face : palette.faces) {
        double d[3], theta[3], cosine[3], sine[3], half = 0;
        Vec3 u[3];
        for (int i = 0; i < 3; ++i) {
            const Vec3 v = minus(palette.rgb[face[i]], p);
            d[i] = std::sqrt(dot(v, v));
            u[i] = {v[0] / d[i], v[1] / d[i], v[2] / d[i]};
        }
        for (int i = 0; i < 3; ++i) {
            const Vec3 chord = minus(u[(i + 1) % 3], u[(i + 2) % 3]);
            theta[i] = 2 * std::asin(std::sqrt(dot(chord, chord)) / 2);
            half += theta[i] / 2;
        }
        const double sign = dot(u[0], cross(u[1], u[2])) < 0 ? -1 : 1;
        for (int i = 0; i < 3; ++i) {
            cosine[i] = 2 * std::sin(half) * std::sin(half - theta[i]) /
                            (std::sin(theta[(i + 1) % 3]) * std::sin(theta[(i + 2) % 3])) -
                        1;
            sine[i] = sign * std::sqrt(1 - cosine[i] * cosine[i]);
        }
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            weights[face[i]] += (theta[i] - cosine[j] * theta[k] - cosine[k] * theta[j]) /
                                (d[i] * std::sin(theta[j]) * sine[k]);
        }
    }
    double total = 0;
    for (const double weight : weights) total += weight;
    for (double& weight : weights) weight /= total;
}

/// Weights of the closest point of a face (Ericson, Real-Time Collision Detection, 5.1.5).
double closest(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, double (&w)[3]) {
    const Vec3 ab = minus(b, a), ac = minus(c, a), ap = minus(p, a), bp = minus(p, b),
               cp = minus(p, c);
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp),
                 d5 = dot(ab, cp), d6 = dot(ac, cp);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    double v, u;
    if (d1 <= 0 && d2 <= 0) {
        v = u = 0;
    } else if (d3 >= 0 && d4 <= d3) {
        v = 1, u = 0;
    } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        v = d1 / (d1 - d3), u = 0;
    } else if (d6 >= 0 && d5 <= d6) {
        v = 0, u = 1;
    } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        v = 0, u = d2 / (d2 - d6);
    } else if (va <= 0 && d4 >= d3 && d5 >= d6) {
        u = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - u;
    } else {
        const double sum = va + vb + vc;
        v = vb / sum, u = vc / sum;
    }
    w[0] = 1 - v - u;
    w[1] = v;
    w[2] = u;
    Vec3 q;
    for (int i = 0; i < 3; ++i) q[i] = w[0] * a[i] + w[1] * b[i] + w[2] * c[i] - p[i];
    return dot(q, q);
}

}  // namespace

/// (n, 3) palette and displacements, (f, 3) faces, and packed RGB pixels in and out.
extern "C" void recolour_scalar(const double* rgb, const double* delta, int vertices,
                                const int* corners, int faces, const float* in, float* out,
                                std::ptrdiff_t pixels) {
    Palette palette;
    for (int i = 0; i < vertices; ++i) {
        palette.rgb.push_back({rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]});
        palette.delta.push_back({delta[3 * i], delta[3 * i + 1], delta[3 * i + 2]});
    }
    for (int i = 0; i < faces; ++i) {
        palette.faces.push_back({corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]});
    }
    std::vector<double> weights;
    for (std::ptrdiff_t at = 0; at < 3 * pixels; at += 3) {
        const Vec3 p{in[at], in[at + 1], in[at + 2]};
        if (inside(palette, p)) {
            mean_value(palette, p, weights);
        } else {
            weights.assign(palette.rgb.size(), 0);
            double best = 1e300, found[3], w[3] = {1, 0, 0};
            const std::array<int, 3>* nearest = &palette.faces[0];
            for (const auto& face : palette.faces) {
                const double distance = closest(p, palette.rgb[face[0]], palette.rgb[face[1]],
                                                palette.rgb[face[2]], found);
                if (distance >= best) continue;
                best = distance;
                nearest = &face;
                for (int i = 0; i < 3; ++i) w[i] = found[i];
            }
            for (int i = 0; i < 3; ++i) weights[(*nearest)[i]] = w[i];
        }
        for (int c = 0; c < 3; ++c) {
            double moved = p[c];
            for (int i = 0; i < vertices; ++i) moved += weights[i] * palette.delta[i][c];
            out[at + c] = static_cast<float>(moved);
        }
    }
}
