// Converts between NumPy arrays and the core's vectors; errors say what was found.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <string>
#include <vector>

#include "model/polytope.hpp"

namespace py = pybind11;

namespace palette4d::bindings {

using DoubleArray = py::array_t<double, py::array::c_style>;
using IntArray = py::array_t<int, py::array::c_style>;

/// "(4, 3)"
std::string shape_text(const py::array& array);
/// From anything that NumPy converts to an (n, 3) array of real numbers. `what` names it in the
/// ValueError.
std::vector<Vec3> colours_from(const py::object& object, const char* what);
/// The same for (n, 4): colours and times.
std::vector<std::array<double, 4>> vertices_from(const py::object& object, const char* what);
/// From anything that NumPy converts to (n,) real numbers.
std::vector<double> numbers_from(const py::object& object, const char* what);
/// (f, 3) integers; an empty array of any shape means no faces.
std::vector<Face> faces_from(const py::object& object);
/// (n,) float64.
DoubleArray to_array(const std::vector<double>& numbers);
/// (n, 3) float64.
DoubleArray to_array(const std::vector<Vec3>& colours);
/// (n, 4) float64.
DoubleArray to_array(const std::vector<std::array<double, 4>>& vertices);
/// (f, 3) int32.
IntArray to_array(const std::vector<Face>& faces);
/// Requires (h, w, 3 or 4) float32 with packed pixels in each row; rows may have any stride. `what`
/// names the image in the ValueError.
void require_image(const py::array& image, const char* what);
/// A view of an image that require_image() accepts.
template <class View, class Pixel>
View view_of(const py::array& image, Pixel* data) {
    return {data, static_cast<int>(image.shape(1)), static_cast<int>(image.shape(0)),
            static_cast<int>(image.shape(2)), image.strides(0)};
}

}  // namespace palette4d::bindings
