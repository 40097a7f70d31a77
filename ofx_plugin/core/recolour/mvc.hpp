// Mean value coordinates for closed triangle meshes (Ju, Schaefer, Warren 2005; Floater, Kos,
// Reimers 2005), and the palette weights built on them.
#pragma once

#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Mean value coordinates of p: n weights that sum to 1 and reproduce p. On a vertex, edge or face
/// they are its barycentric weights. A triangle whose plane contains p, with p outside the
/// triangle, adds nothing. Where the total weight vanishes (far outside, or collapsed meshes), the
/// weights are those of the closest surface point. The mesh must have faces.
void mean_value_coordinates(const Vec3& p, const std::vector<Vec3>& rgb,
                            const std::vector<Face>& faces, double* weights);

/// The closest point of the palette's solid body.
struct Projection {
    Vec3 q;           ///< p when inside, else the closest point of the surface
    double distance;  ///< |p - q|
    bool inside;
};

/// Weights of q(p): mean value coordinates inside, barycentric weights of the closest surface point
/// outside. They are continuous across the surface. One colour has weight 1; for two colours q is
/// the closest point of their segment. A flat palette is all surface.
Projection palette_weights(const Vec3& p, const std::vector<Vec3>& rgb,
                           const std::vector<Face>& faces, double* weights);

}  // namespace palette4d
