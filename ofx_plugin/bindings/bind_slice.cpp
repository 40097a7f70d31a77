// Slices for Python (eqs. 5 and 6).
#include <optional>

#include "arrays.hpp"
#include "binders.hpp"
#include "model/handles.hpp"
#include "model/lineage.hpp"
#include "model/ramps.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

IntArray edge_of_each(const Slice& self) {
    IntArray array(static_cast<py::ssize_t>(self.where.size()));
    int* out = array.mutable_data();
    for (const SlicePoint& point : self.where) *out++ = point.edge;
    return array;
}

IntArray ends_of(const Slice& self) {
    IntArray array({static_cast<py::ssize_t>(self.where.size()), py::ssize_t{2}});
    int* out = array.mutable_data();
    for (const SlicePoint& point : self.where) {
        *out++ = point.from;
        *out++ = point.to;
    }
    return array;
}

DoubleArray weights_of(const Slice& self) {
    DoubleArray array(static_cast<py::ssize_t>(self.where.size()));
    double* out = array.mutable_data();
    for (const SlicePoint& point : self.where) *out++ = point.weight;
    return array;
}

/// Refuses a slice of another polytope: its indices could be out of range here.
void require_slice_of(const Polytope& polytope, const Slice& slice) {
    const int vertices = static_cast<int>(polytope.vertices().size());
    const int edges = static_cast<int>(polytope.edges().size());
    for (const SlicePoint& point : slice.where) {
        if (point.from >= vertices || point.to >= vertices || point.edge >= edges ||
            (point.edge >= 0 && (polytope.edges()[point.edge].from != point.from ||
                                 polytope.edges()[point.edge].to != point.to))) {
            throw py::value_error(
                "the slice is not one of this polytope; expected one from slice_at");
        }
    }
}

}  // namespace

void bind_slice(py::module_& module) {
    py::class_<Slice>(module, "Slice", "The polyhedral palette at one time (eq. 5).")
        .def_readonly("frame", &Slice::frame, "The frame number, within the clip.")
        .def_readonly("section", &Slice::section, "Index into Polytope.sections.")
        .def_property_readonly(
            "rgb", [](const Slice& self) { return to_array(self.rgb); },
            "(n, 3) float64 original palette colours.")
        .def_property_readonly(
            "faces", [](const Slice& self) { return to_array(self.faces); },
            "(f, 3) int32, anticlockwise from outside; (0, 3) for one or two colours.")
        .def_property_readonly(
            "edges", &edge_of_each,
            "(n,) int32 edge of each vertex, -1 when it lies on a polytope vertex.")
        .def_property_readonly("ends", &ends_of, "(n, 2) int32 polytope vertices from, to.")
        .def_property_readonly("weights", &weights_of, "(n,) float64 weight of `to` (eq. 6).");

    module.def(
        "slice_at",
        [](const Polytope& polytope, double frame) {
            const Unlocked unlocked;
            return slice_at(polytope, frame);
        },
        py::arg("polytope"), py::arg("frame"),
        "The palette at any real frame; outside the clip, the palette of its first or last frame.");
    module.def(
        "edited_colours",
        [](const Polytope& polytope, const Edits& edits, const Slice& slice) {
            std::vector<Vec3> colours;
            {
                const Unlocked unlocked;
                require_slice_of(polytope, slice);
                colours = edited_colours(polytope, edits, slice);
            }
            return to_array(colours);
        },
        py::arg("polytope"), py::arg("edits"), py::arg("slice"),
        "(n, 3) float64 edited colours of the slice's vertices.");
    module.def(
        "weight_reader",
        [](const Polytope& polytope, const Edits& edits, const Slice& slice,
           const std::string& id) {
            require_slice_of(polytope, slice);
            const int handle = find_handle(polytope, edits, id);
            if (handle < 0) throw py::value_error("id: found no vertex or stop '" + id + "'");
            return to_array(weight_reader(slice, Lineage(polytope, edits, handle)));
        },
        py::arg("polytope"), py::arg("edits"), py::arg("slice"), py::arg("id"),
        "(n, 3) float64 edited colours whose Recolourer draws a handle's matte.");
    module.def(
        "surface_reader", [](const Slice& slice) { return to_array(surface_reader(slice)); },
        py::arg("slice"), "(n, 3) float64 edited colours whose Recolourer draws what is outside.");
}
