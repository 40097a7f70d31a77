// Mean value coordinates and palette weights for Python, many colours a call.
#include "arrays.hpp"
#include "binders.hpp"
#include "model/slice.hpp"
#include "recolour/mvc.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

DoubleArray table(std::size_t rows, std::size_t columns) {
    return DoubleArray({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(columns)});
}

py::tuple palette_weight_table(const py::object& points, const py::object& rgb,
                               const py::object& faces) {
    const std::vector<Vec3> p = colours_from(points, "points");
    const PaletteBody body(colours_from(rgb, "rgb"), faces_from(faces));
    const std::size_t n = body.rgb().size();
    DoubleArray weights = table(p.size(), n);
    DoubleArray distances(static_cast<py::ssize_t>(p.size()));
    double* out = weights.mutable_data();
    double* distance = distances.mutable_data();
    {
        const Unlocked unlocked;
        PaletteBody::Workspace workspace;
        for (std::size_t i = 0; i < p.size(); ++i) {
            distance[i] = body.project(p[i], out + i * n, workspace).distance;
        }
    }
    return py::make_tuple(weights, distances);
}

/// W_p W_t of eq. 7: distributes the slice's weights to the two ends of each edge.
DoubleArray polytope_weight_table(const py::object& points, const Polytope& polytope,
                                  double frame) {
    const std::vector<Vec3> p = colours_from(points, "points");
    const std::size_t columns = polytope.vertices().size();
    DoubleArray weights = table(p.size(), columns);
    double* out = weights.mutable_data();
    const Unlocked unlocked;
    const Slice slice = slice_at(polytope, frame);
    const PaletteBody body(slice.rgb, slice.faces);
    PaletteBody::Workspace workspace;
    std::vector<double> row(slice.rgb.size());
    std::fill(out, out + p.size() * columns, 0.0);
    for (std::size_t i = 0; i < p.size(); ++i) {
        body.project(p[i], row.data(), workspace);
        for (std::size_t k = 0; k < row.size(); ++k) {
            const SlicePoint& at = slice.where[k];
            out[i * columns + at.from] += row[k] * (1 - at.weight);
            out[i * columns + at.to] += row[k] * at.weight;
        }
    }
    return weights;
}

}  // namespace

void bind_mvc(py::module_& module) {
    module.def("palette_weights", &palette_weight_table, py::arg("points"), py::arg("rgb"),
               py::arg("faces"),
               "(m, 3), (n, 3), (f, 3) -> (m, n) weights of q(p) and (m,) distances |p - q|, 0 "
               "inside. Points that are not finite give NaN.");
    module.def("polytope_weights", &polytope_weight_table, py::arg("points"), py::arg("polytope"),
               py::arg("frame"),
               "Eq. 7: (m, 3) colours at one time -> (m, N) weights of the N polytope vertices.");
}
