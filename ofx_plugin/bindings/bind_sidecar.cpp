// The sidecar reader for Python: Sidecar, Edits, read_sidecar and parse_sidecar.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "binders.hpp"
#include "recolour/frame_picks.hpp"
#include "sidecar/clip_name.hpp"
#include "sidecar/sidecar.hpp"

using palette4d::Edits;
using palette4d::Ramp;
using palette4d::Sidecar;
using palette4d::Vec3;

namespace {

/// Edits by index for the core, with the ids for Python.
struct NamedEdits : Edits {
    std::vector<std::string> vertex_ids, edge_ids;
};

struct BoundSidecar {
    Sidecar sidecar;
    NamedEdits edits;
    std::vector<NamedEdits> versions;
};

py::tuple as_tuple(const Vec3& rgb) { return py::make_tuple(rgb[0], rgb[1], rgb[2]); }

NamedEdits named(const Edits& edits, const palette4d::Polytope& polytope) {
    NamedEdits result;
    static_cast<Edits&>(result) = edits;
    for (const auto& vertex : polytope.vertices()) result.vertex_ids.push_back(vertex.id);
    for (const auto& edge : polytope.edges()) result.edge_ids.push_back(edge.id);
    return result;
}

std::unique_ptr<BoundSidecar> bound(Sidecar sidecar) {
    auto result = std::make_unique<BoundSidecar>();
    result->edits = named(sidecar.edits, sidecar.polytope);
    for (const auto& version : sidecar.versions) {
        result->versions.push_back(named(version.edits, sidecar.polytope));
    }
    result->sidecar = std::move(sidecar);
    return result;
}

/// The bytes of a path (str, bytes or os.PathLike) in the file system's encoding.
std::string path_bytes(const py::object& path) {
    PyObject* converted = nullptr;
    if (PyUnicode_FSConverter(path.ptr(), &converted) == 0) throw py::error_already_set();
    return std::string(py::reinterpret_steal<py::bytes>(converted));
}

/// UTF-8 of a str, or bytes unchanged. Lone surrogates pass, so that the reader refuses them.
std::string text_bytes(const py::object& text) {
    if (py::isinstance<py::bytes>(text)) return text.cast<std::string>();
    if (!py::isinstance<py::str>(text)) {
        throw py::type_error("parse_sidecar: expected the text as str or bytes");
    }
    PyObject* encoded = PyUnicode_AsEncodedString(text.ptr(), "utf-8", "surrogatepass");
    if (encoded == nullptr) throw py::error_already_set();
    return std::string(py::reinterpret_steal<py::bytes>(encoded));
}

py::dict clip_of(const BoundSidecar& self) {
    const palette4d::ClipInfo& clip = self.sidecar.clip;
    py::dict result;
    result["name"] = clip.name;
    result["source"] = clip.source;
    result["first"] = clip.first;
    result["last"] = clip.last;
    result["step"] = clip.step;
    result["rate"] = py::make_tuple(clip.rate_num, clip.rate_den);
    result["width"] = clip.width;
    result["height"] = clip.height;
    result["encoding"] = clip.encoding;
    return result;
}

const char* name_of(Ramp ramp) {
    switch (ramp) {
        case Ramp::kSmooth:
            return "smooth";
        case Ramp::kHold:
            return "hold";
        default:
            return "linear";
    }
}

py::dict vertex_ramp_of(const NamedEdits& self) {
    py::dict result;
    for (std::size_t i = 0; i < self.vertex_ramp.size(); ++i) {
        if (self.vertex_ramp[i]) {
            result[py::str(self.vertex_ids[i])] = name_of(*self.vertex_ramp[i]);
        }
    }
    return result;
}

py::dict vertex_rgb_of(const NamedEdits& self) {
    py::dict result;
    for (std::size_t i = 0; i < self.vertex_rgb.size(); ++i) {
        if (self.vertex_rgb[i]) result[py::str(self.vertex_ids[i])] = as_tuple(*self.vertex_rgb[i]);
    }
    return result;
}

py::list stops_of(const NamedEdits& self) {
    py::list result;
    for (const palette4d::Stop& stop : self.stops) {
        py::dict entry;
        entry["id"] = stop.id;
        entry["edge"] = self.edge_ids[static_cast<std::size_t>(stop.edge)];
        entry["frame"] = stop.frame;
        entry["rgb"] = as_tuple(stop.rgb);
        if (stop.ramp) entry["ramp"] = name_of(*stop.ramp);
        result.append(entry);
    }
    return result;
}

bool empty(const NamedEdits& self) {
    return std::none_of(self.vertex_rgb.begin(), self.vertex_rgb.end(),
                        [](const auto& rgb) { return rgb.has_value(); }) &&
           self.stops.empty() &&
           std::none_of(self.picks.begin(), self.picks.end(),
                        [](const palette4d::Pick& pick) { return pick.enabled && !pick.hold; });
}

/// Times between which enabled picks and holds go along lines: of their paths and ramps.
std::vector<double> pick_times_of(const NamedEdits& self) {
    std::vector<double> times;
    for (const palette4d::Pick& pick : self.picks) {
        if (!pick.enabled) continue;
        times.push_back(pick.frame);
        for (const palette4d::PathKey& key : pick.path) times.push_back(key.frame);
        const double ramp = std::max(pick.fade, self.frame_step);
        if (pick.from) times.insert(times.end(), {*pick.from - ramp, *pick.from});
        if (pick.until) times.insert(times.end(), {*pick.until, *pick.until + ramp});
    }
    return times;
}

double clamped(const BoundSidecar& self, double frame) {
    if (std::isnan(frame)) throw py::value_error("found a frame that is not a number");
    const palette4d::Polytope& polytope = self.sidecar.polytope;
    return std::clamp(frame, polytope.first_frame(), polytope.last_frame());
}

/// (name, edits) of each version.
py::list versions_of(const py::object& bound) {
    const auto& self = bound.cast<const BoundSidecar&>();
    py::list result;
    for (std::size_t i = 0; i < self.versions.size(); ++i) {
        result.append(py::make_tuple(
            self.sidecar.versions[i].name,
            py::cast(&self.versions[i], py::return_value_policy::reference_internal, bound)));
    }
    return result;
}

}  // namespace

void bind_sidecar(py::module_& module) {
    module.attr("SIDECAR_VERSION") = palette4d::kSidecarVersion;

    py::class_<Edits>(module, "_Edits");
    py::class_<NamedEdits, Edits>(module, "Edits",
                                  "Edited colours of vertices, colour stops on edges, and picks.")
        .def_property_readonly("vertex_rgb", &vertex_rgb_of)
        .def_property_readonly("vertex_ramp", &vertex_ramp_of)
        .def_property_readonly("stops", &stops_of)
        .def_property_readonly("ramp",
                               [](const NamedEdits& self) { return name_of(self.default_ramp); })
        .def_property_readonly("empty", &empty)
        .def_property_readonly("pick_times", &pick_times_of)
        .def(
            "picks_at",
            [](const NamedEdits& self, double frame) {
                if (std::isnan(frame)) throw py::value_error("found a frame that is not a number");
                const py::gil_scoped_release unlocked;
                return palette4d::picks_at(self, frame);
            },
            py::arg("frame"), "The picks and holds of a frame.");

    py::class_<BoundSidecar>(module, "Sidecar", "A validated sidecar file.")
        .def_property_readonly("clip", &clip_of)
        .def_property_readonly(
            "polytope", [](const BoundSidecar& self) { return &self.sidecar.polytope; },
            py::return_value_policy::reference_internal)
        .def_property_readonly(
            "edits", [](const BoundSidecar& self) { return &self.edits; },
            py::return_value_policy::reference_internal)
        .def_property_readonly("versions", &versions_of)
        .def(
            "picks_at",
            [](const BoundSidecar& self, double frame) {
                const double at = clamped(self, frame);
                const py::gil_scoped_release unlocked;
                return palette4d::picks_at(self.edits, at);
            },
            py::arg("frame"), "The picks and holds of a frame; outside the clip, at its ends.")
        .def(
            "pick_matte_at",
            [](const BoundSidecar& self, const std::string& id, double frame) {
                const double at = clamped(self, frame);
                const py::gil_scoped_release unlocked;
                return palette4d::matte_at(self.edits, id, at);
            },
            py::arg("id"), py::arg("frame"),
            "One pick or hold, which adds its share of the change to each channel.")
        .def_property_readonly("conversion", [](const BoundSidecar& self) {
            // Shared with the sidecar; Python cannot modify it.
            return std::const_pointer_cast<palette4d::ClipConversion>(self.sidecar.conversion);
        });

    module.def(
        "read_sidecar",
        [](const py::object& path) {
            const std::string bytes = path_bytes(path);
            py::gil_scoped_release unlocked;
            return bound(palette4d::read_sidecar(bytes));
        },
        py::arg("path"), "Read and validate a sidecar file; SidecarError when it is unusable.");
    module.def(
        "parse_sidecar",
        [](const py::object& text, const std::string& name) {
            const std::string bytes = text_bytes(text);
            py::gil_scoped_release unlocked;
            return bound(palette4d::parse_sidecar(bytes, name));
        },
        py::arg("text"), py::arg("name") = "<text>",
        "The same for text (str or bytes) in memory; `name` replaces the file name in errors.");
    module.def("clip_name", &palette4d::clip_name, py::arg("file_name"),
               "A media file's name without extension and frame number: that of its sidecar.");
}
