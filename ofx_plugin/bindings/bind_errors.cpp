// Translates C++ exceptions to Python exceptions; no other file does.
#include <pybind11/pybind11.h>

#include <exception>
#include <stdexcept>
#include <string>

#include "binders.hpp"
#include "sidecar/sidecar.hpp"

namespace {

/// Paths may not be valid UTF-8; decodes them with surrogates, as os.fsdecode does.
py::object decoded(const std::string& text) {
    return py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape"));
}

void translate(std::exception_ptr thrown) {
    try {
        if (thrown) std::rethrow_exception(thrown);
    } catch (const palette4d::SidecarError& problem) {
        const py::object type = py::module_::import("palette4d.common.errors").attr("SidecarError");
        const py::object error = type(decoded(problem.file()), decoded(problem.pointer()),
                                      decoded(problem.found()), decoded(problem.expected()));
        PyErr_SetObject(type.ptr(), error.ptr());
    } catch (const std::invalid_argument& problem) {
        PyErr_SetString(PyExc_ValueError, problem.what());
    }
}

}  // namespace

/// palette4d.common.errors holds the classes, so that code without the core can use them.
/// SidecarError is a Palette4dError with the attributes file, pointer, found and expected.
void bind_errors(py::module_& module) {
    module.attr("SidecarError") =
        py::module_::import("palette4d.common.errors").attr("SidecarError");
    py::register_local_exception_translator(&translate);
}
