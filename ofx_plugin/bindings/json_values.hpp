// Python's dicts, lists, texts and numbers as JSON trees, and back.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

#include "sidecar/json_tree.hpp"

namespace py = pybind11;

namespace palette4d::bindings {

/// Takes NumPy's arrays and numbers too. Throws SidecarError with `file` and the place for what no
/// sidecar can hold, and TypeError for what is no JSON value.
Json json_from(const py::handle& value, const std::string& file);
py::object python_from(const Json& value);

}  // namespace palette4d::bindings
