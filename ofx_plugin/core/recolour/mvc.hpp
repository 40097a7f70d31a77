// Mean value coordinates for closed triangle meshes (Ju, Schaefer, Warren 2005; Floater, Kos,
// Reimers 2005), and the palette weights built on them.
#pragma once

#include <vector>

#include "model/polytope.hpp"

namespace palette4d {

/// Mean value coordinates of p, n weights that sum to 1 and reproduce p. On a vertex, edge or face
/// they are that simplex's barycentric weights; a triangle in whose plane p lies outside it adds
/// nothing. Where the weights' total vanishes (far outside, in collapsed meshes) they are those of
/// the closest surface point. Needs a mesh with faces.
void mean_value_coordinates(const Vec3& p, const std::vector<Vec3>& rgb,
                            const std::vector<Face>& faces, double* weights);

/// The palette's solid body and where a colour lies in it.
struct Projection {
    Vec3 q;           ///< p when inside, else the closest point of the palette's surface
    double distance;  ///< |p - q|
    bool inside;
};

/// Weights of q(p): mean value coordinates inside, barycentric weights of the closest surface point
/// outside (continuous across the surface). A palette of one colour gives weight 1, of two colours
/// the closest point of their segment; a flat palette is all surface.
Projection palette_weights(const Vec3& p, const std::vector<Vec3>& rgb,
                           const std::vector<Face>& faces, double* weights);

}  // namespace palette4d
