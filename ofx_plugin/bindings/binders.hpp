// One binder per subject; module.cpp calls them in the order of their types' dependencies.
#pragma once

#include <pybind11/pybind11.h>

namespace py = pybind11;

void bind_errors(py::module_& module);      ///< SidecarError, and the one exception translator
void bind_polytope(py::module_& module);    ///< Polytope
void bind_conversion(py::module_& module);  ///< ColourConversion, ClipConversion
void bind_picks(py::module_& module);       ///< FramePicks, mattes and their learning
void bind_sidecar(py::module_& module);     ///< Edits, Sidecar, read_sidecar, parse_sidecar
void bind_slice(py::module_& module);       ///< Slice, slice_at, edited_colours, readers
void bind_mvc(py::module_& module);         ///< mean value coordinates and palette weights
void bind_recolour(py::module_& module);    ///< Recolourer
void bind_output(py::module_& module);      ///< draw, scope_counts, luminance_weights
void bind_gpu(py::module_& module);         ///< the kernel's text and tables
void bind_bins(py::module_& module);        ///< ColourBinner
void bind_analysis(py::module_& module);    ///< the hot loops of palette4d.analysis
void bind_rgbt(py::module_& module);        ///< progressive hulls in RGB and time
