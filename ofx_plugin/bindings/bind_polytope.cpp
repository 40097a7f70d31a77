// The 4D skew polytope for Python, read only.
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "model/polytope.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

DoubleArray vertices_of(const Polytope& self) {
    DoubleArray array({static_cast<py::ssize_t>(self.vertices().size()), py::ssize_t{4}});
    double* out = array.mutable_data();
    for (const Vertex& vertex : self.vertices()) {
        for (const double channel : vertex.rgb) *out++ = channel;
        *out++ = vertex.frame;
    }
    return array;
}

IntArray edges_of(const Polytope& self) {
    IntArray array({static_cast<py::ssize_t>(self.edges().size()), py::ssize_t{2}});
    int* out = array.mutable_data();
    for (const Edge& edge : self.edges()) {
        *out++ = edge.from;
        *out++ = edge.to;
    }
    return array;
}

template <class Named>
py::list ids_of(const std::vector<Named>& things) {
    py::list ids;
    for (const Named& thing : things) ids.append(py::str(thing.id));
    return ids;
}

py::list sections_of(const Polytope& self) {
    py::list sections;
    for (const Section& section : self.sections()) {
        py::dict entry;
        entry["first"] = section.first;
        entry["last"] = section.last;
        entry["transition"] = section.transition;
        entry["tracks"] = section.tracks;
        entry["faces"] = to_array(section.faces);
        sections.append(entry);
    }
    return sections;
}

}  // namespace

void bind_polytope(py::module_& module) {
    py::class_<Polytope>(module, "Polytope",
                         "The 4D skew polytope (section 4.1). Build one with `parse_sidecar` or "
                         "`read_sidecar`.")
        .def_property_readonly("vertices", &vertices_of,
                               "(n, 4) float64, columns r, g, b, t; t is a frame number.")
        .def_property_readonly(
            "vertex_ids", [](const Polytope& self) { return ids_of(self.vertices()); },
            "n ids, in the order of `vertices`.")
        .def_property_readonly("edges", &edges_of,
                               "(m, 2) int32 vertex indices, earlier end first.")
        .def_property_readonly(
            "edge_ids", [](const Polytope& self) { return ids_of(self.edges()); },
            "m ids, in the order of `edges`.")
        .def_property_readonly(
            "sections", &sections_of,
            "Blocks and transitions in order: first, last, transition, tracks, faces.")
        .def_property_readonly("first_frame", &Polytope::first_frame)
        .def_property_readonly("last_frame", &Polytope::last_frame);
}
