// Mean value coordinates of a closed triangle mesh (Ju, Schaefer, Warren 2005; Floater, Kos,
// Reimers 2005) and the palette weights built on them, in double precision, one colour at a time.
// mvc_kernels.cpp has the same formulas for 64 colours at a time.
#pragma once

#include <vector>

#include "model/polytope.hpp"
#include "model/vector_bytes.hpp"

namespace palette4d {

/// The closest point of the palette's solid body.
struct Projection {
    Vec3 q;           ///< p when inside, else the closest point of the surface
    double distance;  ///< |p - q|
    bool inside;
};

/// A palette's colours and faces, with everything precomputed that does not depend on the colour.
/// Immutable: threads share it, each with its own Workspace.
class PaletteBody {
public:
    /// Memory that one thread reuses between queries.
    class Workspace {
        friend class PaletteBody;
        std::vector<Vec3> to_vertex_;
        std::vector<double> distance_;
        std::vector<Vec3> edge_cross_;
        std::vector<double> edge_dot_, edge_sine_, edge_angle_;
    };

    PaletteBody() = default;
    /// n finite colours and the faces between them. Throws std::invalid_argument for no colours, a
    /// colour that is not finite, or a bad index in a face. Also for faces among fewer than three
    /// colours, and for three or more colours without faces.
    PaletteBody(std::vector<Vec3> rgb, std::vector<Face> faces);

    const std::vector<Vec3>& rgb() const { return rgb_; }
    const std::vector<Face>& faces() const { return faces_; }
    /// Inputs of the kernels' plans (recolour_plan.hpp).
    bool convex() const { return convex_; }
    bool flat() const { return flat_; }
    double extent() const { return extent_; }
    bool degenerate(std::size_t face) const { return planes_[face].degenerate; }
    const Vec3& normal(std::size_t face) const { return planes_[face].normal; }
    const std::vector<std::size_t>& skin() const { return skin_; }
    std::size_t bytes() const { return vector_bytes(rgb_, faces_, planes_, edges_, skin_); }

    /// Weights of q(p): mean value coordinates inside, barycentric weights of the closest surface
    /// point outside. They are continuous across the surface. One colour has weight 1; for two
    /// colours q is the closest point of their segment. A flat palette is all surface. NaN weights
    /// and distance when p is not finite.
    Projection project(const Vec3& p, double* weights, Workspace& workspace) const;

private:
    struct Side {
        int edge;     ///< index into edges_
        double sign;  ///< -1 where the face runs along the edge backwards
    };
    struct Plane {
        Vec3 normal;  ///< unit, outwards
        double twice_area;
        bool degenerate;            ///< too thin for a normal
        std::array<Vec3, 3> along;  ///< the side opposite each corner, starting at the next corner
        std::array<double, 3> length2;  ///< the sides' lengths, squared
        std::array<Side, 3> sides;
    };
    struct Closest {
        Vec3 q;
        double distance;
        std::array<int, 3> corners;
        std::array<double, 3> weights;
    };

    Closest closest_on_face(const Vec3& p, std::size_t face) const;
    Closest closest_on_segment(const Vec3& p, int a, int b) const;
    Closest closest_point(const Vec3& p, bool visible_only) const;
    Vec3 within_reach(const Vec3& p) const;
    /// Mean value coordinates of p: n weights that sum to 1 and reproduce p. On a vertex, edge or
    /// face they are its barycentric weights. A triangle whose plane contains p, with p outside the
    /// triangle, adds nothing. False where the total weight vanishes (collapsed meshes).
    bool mean_value(const Vec3& p, double* weights, Workspace& workspace) const;
    void prepare_edges(Workspace& workspace) const;
    double winding_number(const Vec3& p) const;
    void spread(const Closest& closest, double* weights) const;

    std::vector<Vec3> rgb_;
    std::vector<Face> faces_;
    std::vector<Plane> planes_;
    std::vector<std::array<int, 2>> edges_;
    double extent_ = 0;     ///< diagonal of the bounding box
    double tolerance_ = 0;  ///< smaller distances count as rounding
    bool convex_ = false;
    bool flat_ = false;              ///< all colours in one plane
    std::vector<std::size_t> skin_;  ///< faces of the surface (one side of a flat body)
};

}  // namespace palette4d
