// The progressive hull in RGB and time (palette4d.analysis.baselines.rgbt_hull).
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "binders.hpp"
#include "fit/progressive_hull.hpp"
#include "unlocked.hpp"

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

DoubleArray simplified(const Array<double>& points, const Array<int>& simplices, int target,
                       const Array<double>& limits) {
    const auto p = rows_of<double, 4>(points, "points");
    const auto s = rows_of<int, 4>(simplices, "simplices");
    std::vector<HalfSpace<4>> bounds;
    for (const auto& row : rows_of<double, 5>(limits, "limits"))
        bounds.push_back({{row[0], row[1], row[2], row[3]}, row[4]});
    std::vector<std::array<double, 4>> hull;
    {
        const Unlocked unlocked;
        hull = progressive_hull_4d(p, s, target, bounds);
    }
    DoubleArray out({static_cast<py::ssize_t>(hull.size()), py::ssize_t{4}});
    double* to = out.mutable_data();
    for (const auto& row : hull) to = std::copy(row.begin(), row.end(), to);
    return out;
}

}  // namespace

void bind_rgbt(py::module_& m) {
    m.def("progressive_hull_4d", &simplified, py::arg("points"), py::arg("simplices"),
          py::arg("target"), py::arg("limits"));
}
