// Colour conversions for Python: matrices and curves, between a clip's numbers and its palette's.
#include <cstddef>
#include <memory>
#include <string>
#include <variant>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "convert/colour_conversion.hpp"
#include "sidecar/sidecar.hpp"
#include "unlocked.hpp"

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
    const Unlocked unlocked;
    for (std::size_t i = 0; i < count; ++i, from += 3, to += 3) {
        const Vec3 moved = (self.*by)({from[0], from[1], from[2]});
        for (std::size_t c = 0; c < 3; ++c) to[c] = moved[c];
    }
    return result;
}

py::dict step_members(const palette4d::ConversionStep& step) {
    using namespace py::literals;
    if (const auto* matrix = std::get_if<palette4d::MatrixStep>(&step)) {
        return py::dict("kind"_a = "matrix", "matrix"_a = matrix->matrix,
                        "offset"_a = matrix->offset);
    }
    if (const auto* log = std::get_if<palette4d::LogStep>(&step)) {
        return py::dict("kind"_a = "log", "base"_a = log->base, "log_slope"_a = log->log_slope,
                        "log_offset"_a = log->log_offset, "linear_slope"_a = log->linear_slope,
                        "linear_offset"_a = log->linear_offset, "start"_a = log->start,
                        "below"_a = log->below, "inverse"_a = log->inverse);
    }
    if (const auto* gamma = std::get_if<palette4d::GammaStep>(&step)) {
        return py::dict("kind"_a = "gamma", "gamma"_a = gamma->gamma, "offset"_a = gamma->offset,
                        "mirrored"_a = gamma->mirrored, "inverse"_a = gamma->inverse);
    }
    const auto& curve = std::get<palette4d::CurveStep>(step);
    py::list curves;
    for (const palette4d::SampledCurve& one : curve.curves) {
        curves.append(py::make_tuple(one.x, one.y));
    }
    return py::dict("kind"_a = "curve", "curves"_a = curves, "inverse"_a = curve.inverse);
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
        .def_property_readonly(
            "members",
            [](const ColourConversion& self) {
                py::list steps;
                for (const auto& step : self.steps()) steps.append(step_members(step));
                return steps;
            },
            "The steps, each with its kind and numbers.")
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
