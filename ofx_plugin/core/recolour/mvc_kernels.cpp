// The kernels of mvc_kernels.hpp, compiled for the vector width that lanes.hpp has here. One
// source per instruction set includes this file. It must include no header that defines functions
// for all processors.
//
// Mean value coordinates, as in mvc.cpp, with v = corner - p:
//     w_i = m . c_i / det(v),  c_i = v_j x v_k,  m = 1/2 sum over the sides of theta c / |c|.
// In the cosines g of the sides' angles theta, with T = theta / sin theta and the unit vectors'
// determinant 1 / z, this is
//     |v_i| w_i = z (T_i (1 - g_i^2) + T_j (g_i g_j - g_k) + T_k (g_i g_k - g_j)).
// det(v) is twice the face's area times the height h of its plane above p. A rational function of
// k = sqrt(1 + g) replaces trigonometry. Edges are computed once for both faces. The factor 1/2 and
// that of T are common to all weights and left out.
//
// Which results are good? Rounding adds these errors:
// - a few eps to every g, and a few eps / k^2, relative, to an edge's T. The latter scales what the
//   edge adds. It moves the result only where other edges have weight too, a share of about k. The
//   weight w_i of a face is then off by about eps z / (k |v_i|);
// - a few eps r, relative, to a face's h, where r = size / |h|. This scales the three weights W_f
//   of one face. It moves the result only where other faces have weight too: by
//   eps sum_f r_f |W_f| (B - |W_f|) / W^2,  B = sum_f |W_f|.
// The sum of both uses the smallest k and |v|, times the spread of the vertices' displacements.
// The verdict is 0 where the sum exceeds the tolerance: near edges, in the planes of faces, beyond
// the range of T. It is also 0 where a value is NaN.
#include "recolour/mvc_kernels.hpp"

#include "simd/lanes.hpp"

namespace {

using palette4d::Block;
using palette4d::kStride;
using palette4d::kTurn;
using palette4d::Plan;

/// Rounding errors: half a unit in the last place, and the coefficients of T, see angle().
template <class T>
struct Arithmetic;
template <>
struct Arithmetic<float> {
    static constexpr float kEpsilon = 6e-8f;
    static constexpr float kSmallest = 1e-17f;  ///< lengths whose squares are normal numbers
    static constexpr float kWhole = -0.034938476f;
    static constexpr float kAbove[] = {45.856227f, 22.890474f};
    static constexpr float kBelow[] = {5.1626453f, 4.8807709f};
};
template <>
struct Arithmetic<double> {
    static constexpr double kEpsilon = 1.2e-16;
    static constexpr double kSmallest = 1e-140;
    static constexpr double kWhole = -0.0093938828469573;
    static constexpr double kAbove[] = {11667.365937941166, 17672.558507758935, 9164.693185188156,
                                        1884.772712396079, 129.3111249600498};
    static constexpr double kBelow[] = {351.1549686306, 689.8704025728097, 498.3985437338839,
                                        161.16778452474344, 22.39384389440747};
};
// Upper bounds on the rounding errors in each result, to first order.
// tests/core/recolour/test_mvc_kernels.cpp compares them with double precision.
template <class T>
constexpr T kWeightError = 32;  ///< T is some 4 times as large as theta / sin theta
template <class T>
constexpr T kHeightError = 8;
template <class T>
constexpr T kDistanceError = 16;

/// A polynomial whose highest coefficient is 1; the others are given, the lowest first.
template <class T, int Count>
PALETTE4D_INLINE Lanes<T> polynomial(const T (&others)[Count], Lanes<T> x) {
    Lanes<T> sum = x + all(others[Count - 1]);
    for (int i = Count - 2; i >= 0; --i) sum = sum * x + all(others[i]);
    return sum;
}
/// theta / sin theta, times a constant, for k = sqrt(1 + cos theta). Its relative error is below
/// half a unit in the last place.
template <class T>
PALETTE4D_INLINE Lanes<T> angle(Lanes<T> k) {
    using A = Arithmetic<T>;
    return all(A::kWhole) + polynomial(A::kAbove, k) / (k * polynomial(A::kBelow, k));
}

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
    return {load(from), load(from + kStride<T>), load(from + 2 * kStride<T>)};
}
template <class T>
PALETTE4D_INLINE void store3(T* to, Lanes3<T> a) {
    store(to, a.x);
    store(to + kStride<T>, a.y);
    store(to + 2 * kStride<T>, a.z);
}
/// 1 inside, -1 outside, 0 where the body bends too close by to decide, or closer to the surface
/// than `shell`. Counts the faces above the colour, signed: whether the ray leaves or enters the
/// body there.
template <class T>
PALETTE4D_INLINE Lanes<T> side_by_ray(const Plan<T>& plan, T shell, const T* vertices, T* edges,
                                      T* rays) {
    constexpr std::size_t kPart = 3;  // a ray takes a third of a vertex
    const T turn[3][3] = {{T(kTurn[0][0]), T(kTurn[0][1]), T(kTurn[0][2])},
                          {T(kTurn[1][0]), T(kTurn[1][1]), T(kTurn[1][2])},
                          {T(kTurn[2][0]), T(kTurn[2][1]), T(kTurn[2][2])}};
    const Lanes3<T> first = load3(vertices);
    const Lanes3<T> to_first{dot(all3(turn[0]), first), dot(all3(turn[1]), first),
                             dot(all3(turn[2]), first)};
    for (int i = 0; i < plan.vertex_count; ++i) {
        store3(rays + Plan<T>::kVertex / kPart * i, all3(plan.vertices[i].ray) + to_first);
    }
    Lanes<T> nearest = all(T(1e30));
    for (int e = 0; e < plan.edge_count; ++e) {
        const T *a = rays + plan.edges[e].a / kPart, *b = rays + plan.edges[e].b / kPart;
        const Lanes<T> area = load(a) * load(b + kStride<T>) - load(a + kStride<T>) * load(b);
        store(edges + Plan<T>::kEdge * e, area);
        nearest = min(abs(area), nearest);
    }
    const Lanes<T> zero = all(T(0)), one = all(T(1));
    Lanes<T> count = zero, lowest = all(plan.size + 1);
    for (int f = 0; f < plan.face_count; ++f) {
        const typename Plan<T>::Face& face = plan.faces[f];
        const Lanes<T> jk = load(edges + face.jk), ik = zero - load(edges + face.ik),
                       ij = load(edges + face.ij);
        const LaneMask<T> hit = ((jk >= zero) & (ik >= zero) & (ij >= zero)) |
                                ((jk <= zero) & (ik <= zero) & (ij <= zero));
        const Lanes<T> height = dot(all3(face.ray_normal), load3(rays + face.i / kPart));
        count = count + select(hit & (height > zero), all(face.ray_sign), zero);
        lowest = min(select(hit, abs(height), lowest), lowest);
    }
    const Lanes<T> size = abs(to_first.x) + abs(to_first.y) + abs(to_first.z) + all(plan.size);
    const LaneMask<T> sure = nearest > all(16 * Arithmetic<T>::kEpsilon) * size * size;
    const Lanes<T> side = select(abs(count) > all(T(0.5)), one, zero - one);
    // Colours on the surface use the closest point, unless a rounding of the surface matters.
    const Lanes<T> on_surface = shell > 0 ? zero : zero - one;
    return select(sure, select(lowest > all(shell), side, on_surface), zero);
}

template <class T>
void inside(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T shell, T* scratch) {
    using A = Arithmetic<T>;
    constexpr int n = Lanes<T>::kCount;
    // Scratch per vertex: v, its unit vector, 1 / |v|, |v|, |v| times the weight so far. Per edge:
    // T, T (1 - g^2), g. Per face: det(v). Then the rays.
    constexpr int kVertex = Plan<T>::kVertex, kEdge = Plan<T>::kEdge;
    using Face = typename Plan<T>::Face;
    using Edge = typename Plan<T>::Edge;
    const Face *const faces = plan.faces, *const faces_end = faces + plan.face_count;
    const Edge *const plan_edges = plan.edges, *const edges_end = plan_edges + plan.edge_count;
    T* const vertices = scratch;
    T* const edges = vertices + kVertex * plan.vertex_count;
    T* const volumes = edges + kEdge * plan.edge_count;
    const Lanes<T> zero = all(T(0)), one = all(T(1));
    for (int at = 0; at < count; at += n) {
        if (!plan.solid) {
            store(block.verdict + at, zero - one);
            continue;
        }
        const Lanes3<T> p = load3(block.colour, at);
        Lanes<T> shortest = all(plan.size);
        T* vertex = vertices;
        for (int i = 0; i < plan.vertex_count; ++i, vertex += kVertex) {
            const Lanes3<T> v = all3(plan.vertices[i].at) - p;
            const Lanes<T> length = sqrt(dot(v, v)), inverse = one / length;
            shortest = min(length, shortest);
            store3(vertex, v);
            store3(vertex + 3 * kStride<T>, inverse * v);
            store(vertex + 6 * kStride<T>, inverse);
            store(vertex + 7 * kStride<T>, length);
            store(vertex + 8 * kStride<T>, zero);
        }
        Lanes<T> lowest = one;
        T* volume = volumes;
        for (const Face* face = faces; face != faces_end; ++face, volume += kStride<T>) {
            const Lanes<T> here = dot(all3(face->area), load3(vertices + face->i));
            store(volume, here);
            lowest = min(here, lowest);
        }
        Lanes<T> side = select(lowest > zero, one, zero - one);
        if (!plan.convex) side = side_by_ray(plan, shell, vertices, edges, volume);
        if (!any(side > zero)) {
            store(block.verdict + at, side);
            continue;
        }
        const LaneMask<T> on_vertex = shortest <= all(A::kSmallest);
        side = select((side > zero) & on_vertex, zero - one, side);

        Lanes<T> smallest_k = one;
        T* edge = edges;
        for (const Edge* ends = plan_edges; ends != edges_end; ++ends, edge += kEdge) {
            const Lanes<T> g = dot(load3(vertices + ends->a + 3 * kStride<T>),
                                   load3(vertices + ends->b + 3 * kStride<T>));
            const Lanes<T> k2 = one + g, k = sqrt(k2), t = angle(k);
            smallest_k = min(k, smallest_k);
            store(edge, t);
            store(edge + kStride<T>, (one - g) * k2 * t);
            store(edge + 2 * kStride<T>, g);
        }

        Lanes<T> flatness = zero, first = zero, second = zero, size = zero;
        volume = volumes;
        for (const Face* face = faces; face != faces_end; ++face, volume += kStride<T>) {
            const T *jk = edges + face->jk, *ik = edges + face->ik, *ij = edges + face->ij;
            T *i = vertices + face->i, *j = vertices + face->j, *k = vertices + face->k;
            const Lanes<T> near = one / load(volume);
            const Lanes<T> z = load(i + 7 * kStride<T>) * load(j + 7 * kStride<T>) *
                               load(k + 7 * kStride<T>) * near;
            const Lanes<T> g_i = load(jk + 2 * kStride<T>), g_j = load(ik + 2 * kStride<T>),
                           g_k = load(ij + 2 * kStride<T>);
            const Lanes<T> b_i = g_j * g_k - g_i, b_j = g_i * g_k - g_j, b_k = g_i * g_j - g_k;
            const Lanes<T> t_i = load(jk), t_j = load(ik), t_k = load(ij);
            const Lanes<T> w_i = z * (load(jk + kStride<T>) + t_j * b_k + t_k * b_j),
                           w_j = z * (load(ik + kStride<T>) + t_i * b_k + t_k * b_i),
                           w_k = z * (load(ij + kStride<T>) + t_i * b_j + t_j * b_i);
            store(i + 8 * kStride<T>, load(i + 8 * kStride<T>) + w_i);
            store(j + 8 * kStride<T>, load(j + 8 * kStride<T>) + w_j);
            store(k + 8 * kStride<T>, load(k + 8 * kStride<T>) + w_k);

            const Lanes<T> weight =
                abs(w_i * load(i + 6 * kStride<T>) + w_j * load(j + 6 * kStride<T>) +
                    w_k * load(k + 6 * kStride<T>));
            const Lanes<T> weighted = abs(all(face->twice_area) * near) * weight;
            first = first + weighted;
            second = second + weighted * weight;
            flatness = flatness + abs(z);
            if (!plan.convex) size = size + weight;
        }

        Lanes<T> total = zero;
        for (int i = 0; i < plan.vertex_count; ++i) {
            vertex = vertices + kVertex * i;
            const Lanes<T> weight = load(vertex + 8 * kStride<T>) * load(vertex + 6 * kStride<T>);
            total = total + weight;
            store(vertex + 8 * kStride<T>, weight);
        }
        if (plan.convex) size = total;
        Lanes3<T> moved{zero, zero, zero};
        for (int m = 0; m < plan.mover_count; ++m) {
            const typename Plan<T>::Mover& mover = plan.movers[m];
            moved = moved + load(vertices + mover.vertex + 8 * kStride<T>) * all3(mover.delta);
        }
        const Lanes<T> share = one / total;
        moved = share * moved;
        const Lanes<T> weight_error = flatness * abs(share) / (shortest * smallest_k);
        const Lanes<T> height_error = max(zero, size * first - second) * share * share;
        const Lanes<T> error =
            all(kWeightError<T>) * weight_error + all(kHeightError<T> * plan.size) * height_error;
        const LaneMask<T> good = (all(A::kEpsilon * plan.spread) * error <= all(tolerance)) &
                                 (smallest_k * smallest_k > all(1000 * A::kEpsilon));
        store(block.moved[0] + at, moved.x);
        store(block.moved[1] + at, moved.y);
        store(block.moved[2] + at, moved.z);
        store(block.verdict + at, select(good | (side < zero), side, zero));
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
        const Lanes3<T> p = load3(block.colour, at);
        Lanes<T> best = all(kNever);
        for (int s = 0; s < plan.segment_count; ++s) {
            const typename Plan<T>::Segment& segment = plan.segments[s];
            const Lanes3<T> v = all3(segment.start) - p;
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
            const Lanes3<T> v = all3(triangle.start) - p;
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
        const Lanes<T> distance = sqrt(best), size = distance + all(plan.size);
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
        const T* from = premultiplied ? block.seen[c] : block.colour[c];
        T* to = block.moved[c];
        for (int at = 0; at < count; at += Lanes<T>::kCount) {
            const Lanes<T> before = load(from + at), whole = all(strength) * load(to + at);
            const Lanes<T> step = premultiplied ? load(block.alpha + at) * whole : whole;
            store(to + at, select((step < zero) | (step > zero), before + step, before));
        }
    }
}

template <int Channels>
PALETTE4D_INLINE void spread(const float* __restrict in, int count, Block<float>& __restrict to) {
    for (int i = 0; i < count; ++i) {
        for (int c = 0; c < 3; ++c) to.colour[c][i] = in[i * Channels + c];
        if (Channels == 4) to.alpha[i] = in[i * 4 + 3];
    }
}

bool read(const float* in, int channels, int count, bool premultiplied, Block<float>& block) {
    if (channels == 3) {
        count == Block<float>::kSize ? spread<3>(in, Block<float>::kSize, block)
                                     : spread<3>(in, count, block);
    } else {
        count == Block<float>::kSize ? spread<4>(in, Block<float>::kSize, block)
                                     : spread<4>(in, count, block);
    }
    const Lanes<float> zero = all(0.0f), one = all(1.0f);
    LaneMask<float> bad = zero > zero;
    for (int at = 0; at < count; at += Lanes<float>::kCount) {
        const Lanes3<float> colour = load3(block.colour, at);
        Lanes<float> odd = zero * colour.x + zero * colour.y + zero * colour.z;
        if (premultiplied) {
            const Lanes<float> alpha = load(block.alpha + at);
            for (int c = 0; c < 3; ++c) {
                const Lanes<float> seen = load(block.colour[c] + at);
                store(block.seen[c] + at, seen);
                store(block.colour[c] + at, seen / alpha);
            }
            odd = select((alpha < zero) | (alpha > zero), odd + zero * alpha, zero / zero);
        }
        bad = bad | (select(odd >= zero, zero, one) > zero);
    }
    return !any(bad);
}

template <int Channels>
PALETTE4D_INLINE void interleave(const Block<float>& __restrict from, int count,
                                 float* __restrict out) {
    for (int i = 0; i < count; ++i) {
        for (int c = 0; c < 3; ++c) out[i * Channels + c] = from.moved[c][i];
        if (Channels == 4) out[i * 4 + 3] = from.alpha[i];
    }
}

void write(const Block<float>& block, int channels, int count, float* out) {
    if (channels == 3) {
        count == Block<float>::kSize ? interleave<3>(block, Block<float>::kSize, out)
                                     : interleave<3>(block, count, out);
    } else {
        count == Block<float>::kSize ? interleave<4>(block, Block<float>::kSize, out)
                                     : interleave<4>(block, count, out);
    }
}

constexpr palette4d::MvcKernels kKernels = {
    {&inside<float>, &closest<float>, &move<float>},
    {&inside<double>, &closest<double>, &move<double>},
    &read,
    &write,
};

}  // namespace

namespace palette4d {
const MvcKernels& MvcKernels::PALETTE4D_SET() { return kKernels; }
}  // namespace palette4d
