#include "recolour/mvc.hpp"

#include "recolour/palette_body.hpp"

namespace palette4d {

void mean_value_coordinates(const Vec3& p, const std::vector<Vec3>& rgb,
                            const std::vector<Face>& faces, double* weights) {
    PaletteBody::Workspace workspace;
    PaletteBody(rgb, faces).mean_value(p, weights, workspace);
}

Projection palette_weights(const Vec3& p, const std::vector<Vec3>& rgb,
                           const std::vector<Face>& faces, double* weights) {
    PaletteBody::Workspace workspace;
    return PaletteBody(rgb, faces).project(p, weights, workspace);
}

}  // namespace palette4d
