// The progressive hull in RGB and time (palette4d.analysis.baselines.rgbt_hull).
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "arrays.hpp"
#include "binders.hpp"
#include "fit/progressive_hull_4d.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

template <class Number>
using Array = py::array_t<Number, py::array::c_style | py::array::forcecast>;

/// The rows of an (n, M) array.
template <class Number, std::size_t M>
std::vector<std::array<Number, M>> rows_of(const Array<Number>& array, const char* what) {
    if (array.ndim() != 2 || array.shape(1) != static_cast<py::ssize_t>(M))
        throw py::value_error(std::string(what) + ": found shape " + shape_text(array) +
                              ", expected (n, " + std::to_string(M) + ")");
    std::vector<std::array<Number, M>> out(static_cast<std::size_t>(array.shape(0)));
    const Number* from = array.data();
    for (auto& row : out)
        for (Number& x : row) x = *from++;
    return out;
}

template <int N>
DoubleArray simplify(const Array<double>& points, const Array<int>& simplices, int target,
                     const Array<double>& limits) {
    const auto p = rows_of<double, N>(points, "points");
    const auto s = rows_of<int, N>(simplices, "simplices");
    std::vector<Limit<N>> bounds;
    for (const auto& row : rows_of<double, N + 1>(limits, "limits")) {
        Limit<N> bound{};
        for (int i = 0; i < N; ++i) bound.a[i] = row[i];
        bound.b = row[N];
        bounds.push_back(bound);
    }
    std::vector<std::array<double, N>> hull;
    {
        py::gil_scoped_release release;
        hull = progressive_hull_nd<N>(p, s, target, bounds);
    }
    DoubleArray out({static_cast<py::ssize_t>(hull.size()), static_cast<py::ssize_t>(N)});
    double* to = out.mutable_data();
    for (const auto& row : hull)
        for (const double x : row) *to++ = x;
    return out;
}

}  // namespace

void bind_rgbt(py::module_& m) {
    m.def(
        "progressive_hull_nd",
        [](const Array<double>& points, const Array<int>& simplices, int target,
           const Array<double>& limits) {
            const py::ssize_t dimensions = points.ndim() == 2 ? points.shape(1) : 0;
            switch (dimensions) {
                case 2:
                    return simplify<2>(points, simplices, target, limits);
                case 3:
                    return simplify<3>(points, simplices, target, limits);
                case 4:
                    return simplify<4>(points, simplices, target, limits);
                default:
                    throw py::value_error("points: found shape " + shape_text(points) +
                                          ", expected (n, 2), (n, 3) or (n, 4)");
            }
        },
        py::arg("points"), py::arg("simplices"), py::arg("target"), py::arg("limits"));
}
