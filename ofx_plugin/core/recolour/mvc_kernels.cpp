// The kernels of mvc_kernels.hpp, compiled for the vector width that lanes.hpp has here. One
// source per instruction set includes this file. It must include no header that defines functions
// for all processors.
//
// Mean value coordinates, as in mvc.cpp, with v = corner - p:
//     w_i = m . c_i / det(v),  c_i = v_j x v_k,  m = 1/2 sum over the sides of theta c / |c|.
// A polynomial replaces trigonometry:
//     theta / |c| = (theta / sin theta) / (|v_a| |v_b|),  theta / sin theta = P(k) / k.
// Here k = cos(theta / 2) is half the length of the sum of the two unit vectors. P(k) = acos(k) /
// sqrt(1 - k^2) is smooth on [0, 1]. Edges are computed once for both faces; the factor 1/2 is
// common to all weights and left out.
//
// Which results are good? Rounding adds these errors:
// - a few eps / k to an edge's theta c / |c|, and a few eps to every c_i / |v|^2. The weight w_i of
//   a face is then off by about eps z / (k |v_i|). z = |v_i| |v_j| |v_k| / |det(v)| is the inverse
//   of the solid angle's sine;
// - a few eps z, relative, to det(v). This scales the three weights W_f of one face. It moves the
//   result only where other faces have weight too: by
//   eps sum_f z_f |W_f| (sum_g |W_g| - |W_f|) / W^2.
// The sum of both uses the smallest k and |v|, times the spread of the vertices' displacements.
// The verdict is 0 where the sum exceeds the tolerance: near edges, in the planes of faces, beyond
// the range of T. It is also 0 where a value is NaN.
#include "recolour/mvc_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using palette4d::Block;
using palette4d::kTurn;
using palette4d::Plan;

/// Rounding errors: half a unit in the last place, and the error of the polynomial P in k - 1/2.
template <class T>
struct Arithmetic;
template <>
struct Arithmetic<float> {
    static constexpr float kEpsilon = 6e-8f;
    static constexpr float kSmallest = 1e-17f;  ///< lengths whose squares are normal numbers
    static constexpr int kDegree = 8;
    static constexpr float kAngle[kDegree + 1] = {
        1.209199576e+00f,  -5.271987895e-01f, 2.789318189e-01f,
        -1.587761969e-01f, 9.383630280e-02f,  -5.561914687e-02f,
        3.415704681e-02f,  -2.733482795e-02f, 1.718536918e-02f};
};
template <>
struct Arithmetic<double> {
    static constexpr double kEpsilon = 1.2e-16;
    static constexpr double kSmallest = 1e-140;
    static constexpr int kDegree = 20;
    static constexpr double kAngle[kDegree + 1] = {
        1.209199576156145234,      -0.5272002825625683356,    0.2789327682081926607,
        -0.1586971753802887977,    0.0937860635986605488,     -0.05673371071574477246,
        0.03486553527429113314,    -0.021671674846850369,     0.01358686714137591848,
        -0.008575526819773298584,  0.005441843341071648042,   -0.003469025943304075271,
        0.002219330356236449488,   -0.001420744963611454778,  0.0009142102212697623601,
        -0.0006080051604331022926, 0.0003930690971890260609,  -0.0001962553205833683415,
        0.0001270840088995349303,  -0.0001860909222978246287, 0.0001211730583111653754};
};
// Upper bounds on the rounding errors in each result, to first order.
// tests/core/recolour/test_mvc_kernels.cpp compares them with double precision.
template <class T>
constexpr T kWeightError = 16;
template <class T>
constexpr T kFactorError = 8;
template <class T>
constexpr T kDistanceError = 16;

/// y, y^2, y^4, y^8, y^16.
template <class T>
struct Powers {
    Lanes<T> to[5];
};
template <class T>
PALETTE4D_INLINE Powers<T> powers_of(Lanes<T> y) {
    const Lanes<T> y2 = y * y, y4 = y2 * y2, y8 = y4 * y4;
    return {{y, y2, y4, y8, y8 * y8}};
}
/// Evaluates Count coefficients of P from First on, halves first (Estrin's scheme): shorter
/// dependency chains than Horner's.
template <class T, int First, int Count>
struct Polynomial {
    static constexpr int kLog = Count > 16 ? 4 : Count > 8 ? 3 : Count > 4 ? 2 : Count > 2 ? 1 : 0;
    static constexpr int kHalf = 1 << kLog;
    static PALETTE4D_INLINE Lanes<T> at(const Powers<T>& y) {
        return Polynomial<T, First, kHalf>::at(y) +
               Polynomial<T, First + kHalf, Count - kHalf>::at(y) * y.to[kLog];
    }
};
template <class T, int First>
struct Polynomial<T, First, 1> {
    static PALETTE4D_INLINE Lanes<T> at(const Powers<T>&) {
        return all(Arithmetic<T>::kAngle[First]);
    }
};

template <class T>
struct Lanes3 {
    Lanes<T> x, y, z;
};
template <class T>
PALETTE4D_INLINE Lanes3<T> operator+(const Lanes3<T>& a, const Lanes3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
PALETTE4D_INLINE Lanes3<T> operator-(const Lanes3<T>& a, const Lanes3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
PALETTE4D_INLINE Lanes3<T> operator*(const Lanes<T>& s, const Lanes3<T>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class T>
PALETTE4D_INLINE Lanes<T> dot(const Lanes3<T>& a, const Lanes3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
PALETTE4D_INLINE Lanes3<T> cross(const Lanes3<T>& a, const Lanes3<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
PALETTE4D_INLINE Lanes3<T> all3(const T* v) {
    return {all(v[0]), all(v[1]), all(v[2])};
}
template <class T>
PALETTE4D_INLINE Lanes3<T> load3(const T (&from)[3][Block<T>::kSize], int at) {
    return {load(from[0] + at), load(from[1] + at), load(from[2] + at)};
}
template <class T>
PALETTE4D_INLINE Lanes3<T> load3(const T* from) {
    constexpr int n = Lanes<T>::kCount;
    return {load(from), load(from + n), load(from + 2 * n)};
}
template <class T>
PALETTE4D_INLINE void store3(T* to, Lanes3<T> a) {
    constexpr int n = Lanes<T>::kCount;
    store(to, a.x);
    store(to + n, a.y);
    store(to + 2 * n, a.z);
}
/// vertex - colour, with both parts of each position.
template <class T>
PALETTE4D_INLINE Lanes3<T> from_colour(const T* high, const T* low, Lanes3<T> p, Lanes3<T> rest) {
    return (all3(high) - p) + (all3(low) - rest);
}

/// `p` minus the first vertex.
template <class T>
PALETTE4D_INLINE Lanes<T> classify_convex(const Plan<T>& plan, Lanes3<T> p, T shell, T at_surface) {
    const Lanes<T> one = all(T(1));
    Lanes<T> depth = all(plan.extent + 1);
    for (int f = 0; f < plan.plane_count; ++f) {
        const typename Plan<T>::Plane& plane = plan.planes[f];
        depth = min(all(plane.offset) - dot(all3(plane.normal), p), depth);
    }
    return select(depth > all(shell), one,
                  select(depth < all(-shell), all(T(-1)), all(at_surface)));
}

/// Counts the faces above the colour, signed: whether the ray leaves or enters the body there.
template <class T>
PALETTE4D_INLINE Lanes<T> classify_by_ray(const Plan<T>& plan, Lanes3<T> p, T shell, T at_surface,
                                          T* scratch) {
    constexpr int n = Lanes<T>::kCount;
    const T turn[3][3] = {{T(kTurn[0][0]), T(kTurn[0][1]), T(kTurn[0][2])},
                          {T(kTurn[1][0]), T(kTurn[1][1]), T(kTurn[1][2])},
                          {T(kTurn[2][0]), T(kTurn[2][1]), T(kTurn[2][2])}};
    const Lanes<T> x = dot(all3(turn[0]), p), y = dot(all3(turn[1]), p), z = dot(all3(turn[2]), p);
    T* const turned = scratch;
    for (int i = 0; i < plan.vertex_count; ++i) {
        const T* ray = plan.vertices[i].ray;
        store3(turned + 3 * n * i, {all(ray[0]) - x, all(ray[1]) - y, all(ray[2]) - z});
    }
    T* const side = turned + 3 * n * plan.vertex_count;
    Lanes<T> nearest = all(T(1e30));
    for (int e = 0; e < plan.edge_count; ++e) {
        const T *a = turned + 3 * n * plan.edges[e].a, *b = turned + 3 * n * plan.edges[e].b;
        const Lanes<T> area = load(a) * load(b + n) - load(a + n) * load(b);
        store(side + n * e, area);
        nearest = min(abs(area), nearest);
    }
    const Lanes<T> zero = all(T(0)), one = all(T(1));
    Lanes<T> count = zero, lowest = all(plan.extent + 1);
    for (int f = 0; f < plan.face_count; ++f) {
        const typename Plan<T>::Face& face = plan.faces[f];
        const Lanes<T> jk = load(side + n * face.jk), ik = zero - load(side + n * face.ik),
                       ij = load(side + n * face.ij);
        const LaneMask<T> hit = ((jk >= zero) & (ik >= zero) & (ij >= zero)) |
                                ((jk <= zero) & (ik <= zero) & (ij <= zero));
        const Lanes<T> height = dot(all3(face.ray_normal), load3(turned + 3 * n * face.i));
        count = count + select(hit & (height > zero), all(face.ray_sign), zero);
        lowest = min(select(hit, abs(height), lowest), lowest);
    }
    const Lanes<T> size = abs(x) + abs(y) + abs(z) + all(plan.extent);
    const LaneMask<T> sure = nearest > all(16 * Arithmetic<T>::kEpsilon) * size * size;
    const Lanes<T> side_of = select(abs(count) > all(T(0.5)), one, zero - one);
    return select(sure, select(lowest > all(shell), side_of, all(at_surface)), zero);
}

template <class T>
void classify(const Plan<T>& plan, Block<T>& block, int count, T shell, T at_surface, T* scratch) {
    for (int at = 0; at < count; at += Lanes<T>::kCount) {
        if (!plan.solid) {
            store(block.verdict + at, all(T(-1)));
            continue;
        }
        const Lanes3<T> to_first = from_colour(plan.vertices[0].high, plan.vertices[0].low,
                                               load3(block.high, at), load3(block.low, at));
        const Lanes<T> zero = all(T(0));
        const Lanes3<T> p{zero - to_first.x, zero - to_first.y, zero - to_first.z};
        store(block.verdict + at, plan.convex
                                      ? classify_convex(plan, p, shell, at_surface)
                                      : classify_by_ray(plan, p, shell, at_surface, scratch));
    }
}

template <class T>
void mean_value(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T* scratch) {
    using A = Arithmetic<T>;
    constexpr int n = Lanes<T>::kCount;
    // Scratch per vertex: v, its unit vector, 1 / |v|, the weight so far. Per edge: c, theta c /
    // |c|, 1 / (|v_a| |v_b|), k.
    constexpr int kVertex = 8 * n, kEdge = 8 * n;
    T* const vertices = scratch;
    T* const edges = scratch + kVertex * plan.vertex_count;
    const Lanes<T> zero = all(T(0)), one = all(T(1)), half = all(T(0.5));
    for (int at = 0; at < count; at += n) {
        const Lanes3<T> p = load3(block.high, at), rest = load3(block.low, at);
        Lanes<T> largest_inverse = zero;
        for (int i = 0; i < plan.vertex_count; ++i) {
            const Lanes3<T> v = from_colour(plan.vertices[i].high, plan.vertices[i].low, p, rest);
            const Lanes<T> inverse = one / sqrt(dot(v, v));
            largest_inverse = max(inverse, largest_inverse);
            T* const vertex = vertices + kVertex * i;
            store3(vertex, v);
            store3(vertex + 3 * n, inverse * v);
            store(vertex + 6 * n, inverse);
            store(vertex + 7 * n, zero);
        }

        Lanes<T> smallest_k = one;
        for (int e = 0; e < plan.edge_count; ++e) {
            const T *a = vertices + kVertex * plan.edges[e].a,
                    *b = vertices + kVertex * plan.edges[e].b;
            const Lanes3<T> sum = load3(a + 3 * n) + load3(b + 3 * n);
            const Lanes<T> k = half * sqrt(dot(sum, sum));
            smallest_k = min(k, smallest_k);
            T* const edge = edges + kEdge * e;
            store3(edge, cross(load3(a), load3(b)));
            store(edge + 6 * n, load(a + 6 * n) * load(b + 6 * n));
            store(edge + 7 * n, k);
        }
        // A separate loop: its long dependency chain leaves room for the processor to overlap
        // edges.
        for (int e = 0; e < plan.edge_count; ++e) {
            T* const edge = edges + kEdge * e;
            const Lanes<T> k = load(edge + 7 * n);
            const Lanes<T> angle = Polynomial<T, 0, A::kDegree + 1>::at(powers_of(k - half));
            store3(edge + 3 * n, (angle * (load(edge + 6 * n) / k)) * load3(edge));
        }

        Lanes<T> flatness = zero, total_size = zero, first = zero, second = zero;
        for (int f = 0; f < plan.face_count; ++f) {
            const typename Plan<T>::Face& face = plan.faces[f];
            const T *jk = edges + kEdge * face.jk, *ik = edges + kEdge * face.ik,
                    *ij = edges + kEdge * face.ij;
            T *i = vertices + kVertex * face.i, *j = vertices + kVertex * face.j,
              *k = vertices + kVertex * face.k;
            const Lanes<T> inverses = load(jk + 6 * n) * load(i + 6 * n);
            const Lanes<T> solid_inverse = all(face.sign) / (dot(load3(i), load3(jk)) * inverses);
            const Lanes3<T> mean = load3(jk + 3 * n) - load3(ik + 3 * n) + load3(ij + 3 * n);
            const Lanes<T> inverse = solid_inverse * inverses;
            const Lanes<T> w_i = dot(mean, load3(jk)) * inverse,
                           w_j = dot(mean, load3(ik)) * inverse,
                           w_k = dot(mean, load3(ij)) * inverse;
            store(i + 7 * n, load(i + 7 * n) + w_i);
            store(j + 7 * n, load(j + 7 * n) - w_j);
            store(k + 7 * n, load(k + 7 * n) + w_k);

            const Lanes<T> z = abs(solid_inverse), size = abs(w_i - w_j + w_k);
            const Lanes<T> weighted = z * size;
            flatness = flatness + z;
            total_size = total_size + size;
            first = first + weighted;
            second = second + weighted * size;
        }

        Lanes<T> total = zero;
        for (int i = 0; i < plan.vertex_count; ++i) {
            total = total + load(vertices + kVertex * i + 7 * n);
        }
        Lanes3<T> moved{zero, zero, zero};
        for (int m = 0; m < plan.mover_count; ++m) {
            const typename Plan<T>::Mover& mover = plan.movers[m];
            const Lanes<T> weight = load(vertices + kVertex * mover.vertex + 7 * n);
            moved = moved + weight * all3(mover.delta);
        }
        const Lanes<T> share = one / total;
        moved = share * moved;
        const Lanes<T> error =
            all(kWeightError<T>) * flatness * largest_inverse / smallest_k * abs(total) +
            all(kFactorError<T>) * (total_size * first - second);
        const Lanes<T> limit = all(1 / A::kSmallest);
        LaneMask<T> good =
            (all(A::kEpsilon * plan.spread) * error <= all(tolerance) * total * total) &
            (largest_inverse < limit);
        // Colours on a vertex: black and white are common in pictures and in palettes.
        if (any(largest_inverse >= limit)) {
            for (int i = 0; i < plan.vertex_count; ++i) {
                const Lanes3<T> v = load3(vertices + kVertex * i);
                const LaneMask<T> on = abs(v.x) + abs(v.y) + abs(v.z) <= zero;
                const Lanes3<T> delta = all3(plan.vertices[i].delta);
                moved = {select(on, delta.x, moved.x), select(on, delta.y, moved.y),
                         select(on, delta.z, moved.z)};
                good = good | on;
            }
        }
        store(block.moved[0] + at, moved.x);
        store(block.moved[1] + at, moved.y);
        store(block.moved[2] + at, moved.z);
        store(block.verdict + at, select(good, one, zero));
    }
}

template <class T>
void closest(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T* scratch) {
    using A = Arithmetic<T>;
    constexpr int n = Lanes<T>::kCount;
    constexpr T kNever = sizeof(T) == 4 ? T(1e38) : T(1e300);
    // Per segment: position on it, squared distance. Per triangle: two weights, squared distance.
    constexpr int kSegment = 2 * n, kTriangle = 3 * n;
    T* const segments = scratch;
    T* const triangles = scratch + kSegment * plan.segment_count;
    const Lanes<T> zero = all(T(0)), one = all(T(1));
    for (int at = 0; at < count; at += n) {
        const Lanes3<T> p = load3(block.high, at), rest = load3(block.low, at);
        Lanes<T> best = all(kNever);
        for (int s = 0; s < plan.segment_count; ++s) {
            const typename Plan<T>::Segment& segment = plan.segments[s];
            const Lanes3<T> v = from_colour(segment.high, segment.low, p, rest);
            const Lanes3<T> along = all3(segment.along);
            const Lanes<T> foot = zero - dot(v, along) * all(segment.inverse_length2);
            const Lanes<T> t = min(max(foot, zero), one);
            const Lanes3<T> apart = v + t * along;
            const Lanes<T> distance2 = dot(apart, apart);
            store(segments + kSegment * s, t);
            store(segments + kSegment * s + n, distance2);
            best = min(distance2, best);
        }
        for (int f = 0; f < plan.triangle_count; ++f) {
            const typename Plan<T>::Triangle& triangle = plan.triangles[f];
            const Lanes3<T> v = from_colour(triangle.high, triangle.low, p, rest);
            const Lanes<T> w_j = zero - dot(v, all3(triangle.gradient_j)),
                           w_k = zero - dot(v, all3(triangle.gradient_k));
            const Lanes<T> height = dot(v, all3(triangle.normal));
            const LaneMask<T> above = (w_j >= zero) & (w_k >= zero) & (w_j + w_k <= one);
            const Lanes<T> distance2 = select(above, height * height, all(kNever));
            store(triangles + kTriangle * f, w_j);
            store(triangles + kTriangle * f + n, w_k);
            store(triangles + kTriangle * f + 2 * n, distance2);
            best = min(distance2, best);
        }

        // All points that are equally close, within rounding, must have the same displacement.
        const Lanes<T> distance = sqrt(best), size = distance + all(plan.extent);
        const Lanes<T> seen = best + all(kDistanceError<T> * A::kEpsilon) * size * distance +
                              all(A::kEpsilon * A::kEpsilon * 64) * size * size;
        Lanes3<T> low{all(kNever), all(kNever), all(kNever)};
        Lanes3<T> high{zero - low.x, zero - low.x, zero - low.x};
        Lanes<T> slope = zero;
        const auto take = [&](LaneMask<T> near, Lanes3<T> moved, T steepness) {
            low = {min(select(near, moved.x, low.x), low.x),
                   min(select(near, moved.y, low.y), low.y),
                   min(select(near, moved.z, low.z), low.z)};
            high = {max(select(near, moved.x, high.x), high.x),
                    max(select(near, moved.y, high.y), high.y),
                    max(select(near, moved.z, high.z), high.z)};
            slope = max(select(near, all(steepness), slope), slope);
        };
        for (int s = 0; s < plan.segment_count; ++s) {
            const LaneMask<T> near = load(segments + kSegment * s + n) <= seen;
            if (!any(near)) continue;
            const typename Plan<T>::Segment& segment = plan.segments[s];
            take(near, all3(segment.delta) + load(segments + kSegment * s) * all3(segment.change),
                 segment.slope);
        }
        for (int f = 0; f < plan.triangle_count; ++f) {
            const LaneMask<T> near = load(triangles + kTriangle * f + 2 * n) <= seen;
            if (!any(near)) continue;
            const typename Plan<T>::Triangle& triangle = plan.triangles[f];
            take(near,
                 all3(triangle.delta) + load(triangles + kTriangle * f) * all3(triangle.change_j) +
                     load(triangles + kTriangle * f + n) * all3(triangle.change_k),
                 triangle.slope);
        }
        const Lanes<T> half = all(T(0.5));
        store(block.moved[0] + at, half * (low.x + high.x));
        store(block.moved[1] + at, half * (low.y + high.y));
        store(block.moved[2] + at, half * (low.z + high.z));
        const Lanes<T> range = max(max(high.x - low.x, high.y - low.y), high.z - low.z);
        const Lanes<T> error = range + all(kDistanceError<T> * A::kEpsilon) * size * slope;
        store(block.verdict + at, select(error <= all(tolerance), one, zero));
    }
}

template <class T>
void move(Block<T>& block, int count, T strength, bool premultiplied) {
    const Lanes<T> zero = all(T(0));
    for (int c = 0; c < 3; ++c) {
        const T* from = premultiplied ? block.seen[c] : block.high[c];
        T* to = block.moved[c];
        for (int at = 0; at < count; at += Lanes<T>::kCount) {
            const Lanes<T> before = load(from + at), whole = all(strength) * load(to + at);
            const Lanes<T> step = premultiplied ? load(block.alpha + at) * whole : whole;
            store(to + at, select((step < zero) | (step > zero), before + step, before));
        }
    }
}

constexpr palette4d::MvcKernels kKernels = {
    {&classify<float>, &mean_value<float>, &closest<float>, &move<float>},
    {&classify<double>, &mean_value<double>, &closest<double>, &move<double>},
};

}  // namespace

namespace palette4d {
const MvcKernels& MvcKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
