// Colour conversions for Python: matrices and curves, between a clip's numbers and its palette's.
#include <cstddef>
#include <memory>
#include <string>

#include "arrays.hpp"
#include "binders.hpp"
#include "convert/colour_conversion.hpp"
#include "sidecar/sidecar.hpp"

using palette4d::ClipConversion;
using palette4d::ColourConversion;
using palette4d::Vec3;
using namespace palette4d::bindings;

namespace {

/// Converts (..., 3) numbers to float64 of the same shape.
DoubleArray converted(const py::array_t<double, py::array::c_style | py::array::forcecast>& colours,
                      Vec3 (ColourConversion::*by)(const Vec3&) const,
                      const ColourConversion& self) {
    if (colours.ndim() < 1 || colours.shape(colours.ndim() - 1) != 3) {
        throw py::value_error("colours: found shape " + shape_text(colours) +
                              ", expected (..., 3)");
    }
    DoubleArray result(std::vector<py::ssize_t>(colours.shape(), colours.shape() + colours.ndim()));
    const double* from = colours.data();
    double* to = result.mutable_data();
    const auto count = static_cast<std::size_t>(colours.size()) / 3;
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < count; ++i, from += 3, to += 3) {
        const Vec3 moved = (self.*by)({from[0], from[1], from[2]});
        for (std::size_t c = 0; c < 3; ++c) to[c] = moved[c];
    }
    return result;
}

}  // namespace

void bind_conversion(py::module_& module) {
    py::class_<ColourConversion, std::shared_ptr<ColourConversion>>(
        module, "ColourConversion", "A chain of matrices and curves; see docs/sidecar.md.")
        .def(
            py::init([](const std::string& steps, const std::string& name) {
                return std::make_shared<ColourConversion>(palette4d::parse_conversion(steps, name));
            }),
            py::arg("steps"), py::arg("name") = "<steps>",
            "Parses the JSON text of the steps. Raises SidecarError if they are invalid.")
        .def_property_readonly("identity", &ColourConversion::identity)
        .def(
            "to_palette",
            [](const ColourConversion& self,
               const py::array_t<double, py::array::c_style | py::array::forcecast>& x) {
                return converted(x, &ColourConversion::to_palette, self);
            },
            py::arg("colours"), "(..., 3) clip numbers -> (..., 3) float64 palette numbers.")
        .def(
            "to_clip",
            [](const ColourConversion& self,
               const py::array_t<double, py::array::c_style | py::array::forcecast>& x) {
                return converted(x, &ColourConversion::to_clip, self);
            },
            py::arg("colours"), "(..., 3) palette numbers -> (..., 3) float64 clip numbers.");

    py::class_<ClipConversion, std::shared_ptr<ClipConversion>>(
        module, "ClipConversion", "How a sidecar's clip becomes what its palette is in.")
        .def_readonly("input_space", &ClipConversion::input_space)
        .def_readonly("config", &ClipConversion::config)
        .def_readonly("error", &ClipConversion::error)
        .def_property_readonly(
            "steps", [](const ClipConversion& self) { return &self.steps; },
            py::return_value_policy::reference_internal);
}
