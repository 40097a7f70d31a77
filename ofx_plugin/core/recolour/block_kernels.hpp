// The recolouring of 64 colours at a time: data that recolour_plan.cpp prepares and the kernels of
// one instruction set. Plain data and pointers only: this is seen by sources that are compiled for
// other processors than the rest (see lanes.hpp).
#pragma once

#include <cstddef>

namespace palette4d {

/// A rotation; the last row is the direction of the rays that tell the inside of a body. No edge of
/// a real palette has it.
constexpr double kTurn[3][3] = {{-0.48, 0.6, 0.64}, {0.8, 0, 0.6}, {0.36, 0.8, -0.48}};

/// Colours, channel by channel, on their way through one kernel.
template <class T>
struct Block {
    static constexpr int kSize = 64;
    alignas(64) T high[3][kSize];  ///< the colours, and what their rounding to T left over
    alignas(64) T low[3][kSize];
    alignas(64) T seen[3][kSize];  ///< the colours as in a premultiplied picture, and their alpha
    alignas(64) T alpha[kSize];
    alignas(
        64) T moved[3][kSize];     ///< result: the displacement at strength 1, or what is seen then
    alignas(64) T verdict[kSize];  ///< result, see Kernels
};

/// One palette and its edit, rounded to T; what the formulas of palette_body.cpp need of it.
/// Positions are split into two numbers, so that differences to them are exact to the last place.
template <class T>
struct Plan {
    struct Vertex {
        T high[3], low[3];
        T delta[3];  ///< its displacement
        T ray[3];    ///< from the first vertex, turned; see Face::ray_normal
    };
    struct Mover {
        std::size_t vertex;
        T delta[3];  ///< its displacement
    };
    struct Edge {
        std::size_t a, b;
    };
    /// Corners in ascending order i < j < k, so that every edge is run along in one direction.
    struct Face {
        std::size_t i, j, k;
        std::size_t jk, ik, ij;
        T sign;  ///< -1 when the face runs round the other way
        /// The normal in coordinates turned so that no edge of a real palette is parallel to the
        /// third axis, along which rays are cast; positive upwards where sign says so.
        T ray_normal[3];
        T ray_sign;  ///< +1 when a ray upwards leaves the body through the face, -1 when it enters
    };
    struct Plane {
        T normal[3], offset;  ///< inside: normal . (p - first vertex) <= offset
    };
    /// An edge of the surface: its start, direction, and displacement along it.
    struct Segment {
        T high[3], low[3], along[3];
        T inverse_length2;
        T delta[3], change[3];
        T slope;  ///< most displacement a unit of length
    };
    /// A face of the surface: from its first corner, the gradients of the other two's weights.
    struct Triangle {
        T high[3], low[3], normal[3], gradient_j[3], gradient_k[3];
        T delta[3], change_j[3], change_k[3];
        T slope;
    };

    const Vertex* vertices;
    const Mover* movers;
    const Edge* edges;
    const Face* faces;  ///< without those too thin to have a normal
    const Plane* planes;
    const Segment* segments;
    const Triangle* triangles;
    int vertex_count, mover_count, edge_count, face_count, plane_count;
    int segment_count, triangle_count;
    bool convex;  ///< planes tell the inside; else rays do
    bool solid;   ///< else all is outside: one or two colours, a flat palette
    T extent;     ///< diagonal of the bounding box
    T steepness;  ///< about the most displacement a unit of length, inside and on the surface
    T spread;     ///< largest difference between two vertices' displacements, channel by channel
};

/// The kernels of one instruction set for one type. `count` colours, rounded up to whole registers,
/// are read and written; what lies behind the last must be numbers. `scratch` holds
/// scratch_size(plan) numbers, aligned to 64 bytes. Each colour's result depends on it alone.
template <class T>
struct Kernels {
    /// verdict: 1 inside, -1 outside, `at_surface` where the surface is closer than `shell`, 0
    /// where a body that is not convex seems to bend too close by to tell.
    void (*classify)(const Plan<T>& plan, Block<T>& block, int count, T shell, T at_surface,
                     T* scratch);
    /// Mean value coordinates. verdict: 1 when the displacement is within `tolerance` of the exact
    /// one, 0 when that cannot be promised.
    void (*mean_value)(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T* scratch);
    /// The closest point of the surface. verdict as above.
    void (*closest)(const Plan<T>& plan, Block<T>& block, int count, T tolerance, T* scratch);
    /// moved becomes the colour that is seen plus `strength` times moved, times alpha where
    /// premultiplied. Channels that do not move keep their bits, a negative zero included.
    void (*move)(Block<T>& block, int count, T strength, bool premultiplied);
};

/// Numbers of scratch memory that kernels of any instruction set need.
template <class T>
int scratch_size(const Plan<T>& plan) {
    constexpr int kMostLanes = 128 / static_cast<int>(sizeof(T));
    const int mean_value = 8 * plan.vertex_count + 8 * plan.edge_count;
    const int closest = 2 * plan.segment_count + 3 * plan.triangle_count;
    return kMostLanes * (mean_value > closest ? mean_value : closest);
}

struct BlockKernels {
    Kernels<float> single;
    Kernels<double> twofold;

    /// One for each set of instructions that this build has.
    static const BlockKernels& baseline();
    static const BlockKernels& avx2();
    static const BlockKernels& avx512();
};

}  // namespace palette4d
