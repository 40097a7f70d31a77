// Recolours 64 colours at a time: the data, prepared by recolour_plan.cpp, and the kernels of one
// instruction set. Plain data and pointers only: sources compiled for other processors include this
// (see lanes.hpp).
#pragma once

#include <cstddef>

namespace palette4d {

/// A rotation. Its last row is the direction of the rays that test whether a colour is inside. No
/// edge of a real palette is parallel to it.
constexpr double kTurn[3][3] = {{-0.48, 0.6, 0.64}, {0.8, 0, 0.6}, {0.36, 0.8, -0.48}};

/// A block of colours on their way through a kernel, channel by channel.
template <class T>
struct Block {
    static constexpr int kSize = 64;
    alignas(64) T colour[3][kSize];
    alignas(64) T seen[3][kSize];  ///< the colours as in a premultiplied picture, and their alpha
    alignas(64) T alpha[kSize];
    alignas(64) T place[2][kSize];  ///< for windows of picks: x and y, in pixels of the clip
    /// Result: the displacement at strength 1, or what is seen then.
    alignas(64) T moved[3][kSize];
    alignas(64) T verdict[kSize];  ///< result, see Kernels
};

/// Numbers of T from one register in scratch memory to the next, whatever their size.
template <class T>
constexpr int kStride = 64 / static_cast<int>(sizeof(T));

/// One palette and its edit, rounded to T, as the formulas of mvc.cpp need them.
template <class T>
struct Plan {
    /// What a vertex and an edge take of scratch memory; references are places there.
    static constexpr int kVertex = 9 * kStride<T>, kEdge = 3 * kStride<T>;

    struct Vertex {
        T at[3];
        T ray[3];  ///< position from the first vertex, rotated; see Face::ray_normal
    };
    struct Mover {
        std::size_t vertex;
        T delta[3];  ///< its displacement
    };
    struct Edge {
        std::size_t a, b;
    };
    /// Corners in ascending order i < j < k, so that every edge has one direction.
    struct Face {
        std::size_t i, j, k;
        std::size_t jk, ik, ij;
        T area[3];  ///< the normal, outwards, times twice the area
        T twice_area;
        /// The normal, rotated so that no edge of a real palette is parallel to the rays (third
        /// axis). It points up where ray_sign is +1.
        T ray_normal[3];
        T ray_sign;  ///< +1 when a ray upwards leaves the body through the face, -1 when it enters
    };
    /// An edge of the surface: its start, direction, and displacement along it.
    struct Segment {
        T start[3], along[3];
        T inverse_length2;
        T delta[3], change[3];
        T slope;  ///< largest displacement per unit of length
    };
    /// A face of the surface: its first corner and the gradients of the other two corners' weights.
    struct Triangle {
        T start[3], normal[3], gradient_j[3], gradient_k[3];
        T delta[3], change_j[3], change_k[3];
        T slope;
    };

    const Vertex* vertices;
    const Mover* movers;
    const Edge* edges;
    const Face* faces;  ///< without faces too thin to have a normal
    const Segment* segments;
    const Triangle* triangles;
    int vertex_count, mover_count, edge_count, face_count;
    int segment_count, triangle_count;
    bool convex;  ///< faces' heights test for the inside; otherwise rays do
    bool solid;   ///< false for one or two colours and flat palettes: every colour is outside
    T size;       ///< diagonal of the bounding box, or the largest coordinate if that is more
    T steepness;  ///< estimate of the largest displacement per unit of length
    T spread;     ///< largest difference between two vertices' displacements, channel by channel
};

/// The kernels of one instruction set and one type. They read and write `count` colours, rounded up
/// to whole registers; the padding must hold numbers, not NaN. `scratch` has scratch_size(plan)
/// parts, aligned to 64 bytes. Each colour's result depends on that colour only.
template <class T>
struct Kernels {
    /// Mean value coordinates of colours inside a solid body. verdict: 1 when the displacement is
    /// within `tolerance` of the exact one, 0 when that is not guaranteed, -1 outside. It is also 0
    /// when a non-convex body bends too close by to decide, or its surface is closer than `shell`.
    void (*inside)(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T shell,
                   T* scratch);
    /// The closest point on the surface. verdict: 1 or 0.
    void (*closest)(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T* scratch);
    /// Sets moved to the seen colour plus `strength` times moved, times alpha where premultiplied.
    /// Channels that do not move keep their bits, even a negative zero.
    void (*move)(Block<T>& block, int count, T strength, bool premultiplied);
};

/// Size of the scratch memory in kStride<T> values, enough for any instruction set.
template <class T>
std::size_t scratch_size(const Plan<T>& plan) {
    const int inside = 12 * plan.vertex_count + 3 * plan.edge_count + plan.face_count;
    const int closest = 2 * plan.segment_count + 3 * plan.triangle_count;
    return static_cast<std::size_t>(inside > closest ? inside : closest);
}

struct MvcKernels {
    Kernels<float> single;
    Kernels<double> twofold;
    /// Takes `count` pixels of 3 or 4 channels apart: colours, alpha and, where premultiplied, what
    /// is seen. False when some pixel is not recolourable().
    bool (*read)(const float* in, int channels, int count, bool premultiplied, Block<float>& block);
    /// Puts moved and alpha together again.
    void (*write)(const Block<float>& block, int channels, int count, float* out);

    /// One for each instruction set in this build.
    static const MvcKernels& baseline();
    static const MvcKernels& avx2();
    static const MvcKernels& avx512();
};

}  // namespace palette4d
