// Sidecars for Python: Sidecar, Edits, read_sidecar and parse_sidecar.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "binders.hpp"
#include "json_values.hpp"
#include "recolour/frame_picks.hpp"
#include "sidecar/clip_name.hpp"
#include "sidecar/codec.hpp"
#include "unlocked.hpp"

using palette4d::Edits;
using palette4d::Json;
using palette4d::Polytope;
using palette4d::Ramp;
using palette4d::Sidecar;
using palette4d::Vec3;

using palette4d::bindings::json_from;
using palette4d::bindings::python_from;
using palette4d::bindings::Unlocked;

namespace {

/// Edits by index for the core, with the polytope's ids for Python.
struct NamedEdits : Edits {
    Polytope polytope;
};

struct BoundSidecar {
    Sidecar sidecar;
    NamedEdits edits;
    std::vector<NamedEdits> versions;
};

py::tuple as_tuple(const Vec3& rgb) { return py::make_tuple(rgb[0], rgb[1], rgb[2]); }

std::unique_ptr<BoundSidecar> bound(Sidecar sidecar) {
    auto result = std::make_unique<BoundSidecar>();
    result->edits = {std::move(sidecar.edits), sidecar.polytope};
    for (palette4d::NamedVersion& version : sidecar.versions) {
        result->versions.push_back({std::move(version.edits), sidecar.polytope});
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
            result[py::str(self.polytope.vertices()[i].id)] = name_of(*self.vertex_ramp[i]);
        }
    }
    return result;
}

py::dict vertex_rgb_of(const NamedEdits& self) {
    py::dict result;
    for (std::size_t i = 0; i < self.vertex_rgb.size(); ++i) {
        if (!self.vertex_rgb[i]) continue;
        result[py::str(self.polytope.vertices()[i].id)] = as_tuple(*self.vertex_rgb[i]);
    }
    return result;
}

py::list stops_of(const NamedEdits& self) {
    py::list result;
    for (const palette4d::Stop& stop : self.stops) {
        py::dict entry;
        entry["id"] = stop.id;
        entry["edge"] = self.polytope.edges()[static_cast<std::size_t>(stop.edge)].id;
        entry["frame"] = stop.frame;
        entry["rgb"] = as_tuple(stop.rgb);
        if (stop.ramp) entry["ramp"] = name_of(*stop.ramp);
        result.append(entry);
    }
    return result;
}

py::dict still_mattes(const NamedEdits& self) {
    using palette4d::MatteGrid;
    py::dict result;
    for (std::size_t i = 0; i < self.picks.size(); ++i) {
        const palette4d::Pick& pick = self.picks[i];
        if (!pick.enabled) continue;
        const palette4d::StillMatte matte = palette4d::still_matte(self, pick);
        const py::array_t<float> values(
            {MatteGrid::kSaturations, MatteGrid::kSaturations, MatteGrid::kLightnesses},
            matte.values.data());
        result[py::int_(i)] =
            py::make_tuple(pick.hold, values, matte.shares, matte.first, matte.learned);
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
        const double in = pick.ramp_in(), out = pick.ramp_out();
        if (pick.from) times.insert(times.end(), {*pick.from - in, *pick.from});
        if (pick.until) times.insert(times.end(), {*pick.until, *pick.until + out});
    }
    return times;
}

/// The ids of picks with windows that ask for something at a frame.
std::vector<std::string> windows_at(const NamedEdits& self, double frame) {
    std::vector<std::string> ids;
    for (const palette4d::Pick& pick : self.picks) {
        if (pick.enabled && pick.window && pick.strength_at(frame) > 0) {
            ids.push_back(pick.id);
        }
    }
    return ids;
}

double clamped(const BoundSidecar& self, double frame) {
    if (std::isnan(frame)) throw py::value_error("found a frame that is not a number");
    const Polytope& polytope = self.sidecar.polytope;
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

/// A file's name as UTF-8: bytes that are none, which Python has as surrogates, become escapes.
std::string utf8_of(const py::str& name) {
    const auto bytes = py::reinterpret_steal<py::bytes>(
        PyUnicode_AsEncodedString(name.ptr(), "utf-8", "backslashreplace"));
    if (!bytes) throw py::error_already_set();
    return bytes;
}

std::unique_ptr<BoundSidecar> with_members(const BoundSidecar& self, const py::dict& edits,
                                           const py::object& mattes, const py::str& called) {
    const std::string name = utf8_of(called);
    const Json own = json_from(edits, name);
    const Json grids = mattes.is_none() ? Json{{"grids", Json::object()}} : json_from(mattes, name);
    const Unlocked unlocked;
    return bound(palette4d::with_edits(self.sidecar, own, grids, name));
}

/// The core's view of a text, and its members for Python.
py::tuple decode(const py::object& text, const py::str& called) {
    const std::string bytes = text_bytes(text), name = utf8_of(called);
    Json tree;
    std::unique_ptr<BoundSidecar> sidecar;
    {
        const Unlocked unlocked;
        tree = palette4d::json_tree(bytes, name);
        sidecar = bound(palette4d::sidecar_of(tree, name));
    }
    return py::make_tuple(std::move(sidecar), python_from(tree));
}

/// The core's view of members, and their text.
py::tuple encode(const py::object& members, const py::str& called) {
    const std::string name = utf8_of(called);
    const Json tree = json_from(members, name);
    std::unique_ptr<BoundSidecar> sidecar;
    std::string text;
    {
        const Unlocked unlocked;
        sidecar = bound(palette4d::sidecar_of(tree, name));
        text = palette4d::sidecar_text(tree, name);
    }
    return py::make_tuple(std::move(sidecar), py::bytes(text));
}

}  // namespace

void bind_sidecar(py::module_& module) {
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
        .def("windows_at", &windows_at, py::arg("frame"),
             "The ids of picks with windows that ask for something at a frame.")
        .def(
            "picks_at",
            [](const NamedEdits& self, double frame) {
                if (std::isnan(frame)) throw py::value_error("found a frame that is not a number");
                const Unlocked unlocked;
                return palette4d::picks_at(self, frame);
            },
            py::arg("frame"), "The picks and holds of a frame.")
        .def(
            "with_matte_levels",
            [](NamedEdits self, int levels) {
                for (palette4d::Pick& pick : self.picks) pick.levels = levels;
                return self;
            },
            py::arg("levels"),
            "The same edits, with mattes of that many values where they were picked; 0: all.")
        .def("still_mattes", &still_mattes,
             "By the number of each enabled pick and hold: whether it is a hold, its matte where "
             "it was picked, the shares of its 16 lightnesses, the picked colour's point, and "
             "whether it was learned.")
        .def(
            "pick_moments",
            [](const NamedEdits& self, double frame) {
                std::vector<std::tuple<std::size_t, Vec3, double>> result;
                for (const palette4d::PickMoment& one : palette4d::pick_moments(self, frame)) {
                    result.emplace_back(one.pick, one.point, one.strength);
                }
                return result;
            },
            py::arg("frame"),
            "Number, point and strength of what asks for something at a frame; picks first.");

    py::class_<BoundSidecar>(module, "Sidecar", "A validated sidecar file.")
        .def_property_readonly("clip", &clip_of)
        .def_property_readonly(
            "polytope", [](const BoundSidecar& self) { return &self.sidecar.polytope; },
            py::return_value_policy::reference_internal)
        .def_property_readonly(
            "edits", [](const BoundSidecar& self) { return &self.edits; },
            py::return_value_policy::reference_internal)
        .def_property_readonly("versions", &versions_of)
        .def("with_edits", &with_members, py::arg("edits"), py::arg("mattes") = py::none(),
             py::arg("name") = "<edits>",
             "The same palette with other members \"edits\" and \"mattes\", and no versions.")
        .def(
            "picks_at",
            [](const BoundSidecar& self, double frame) {
                const double at = clamped(self, frame);
                const Unlocked unlocked;
                return palette4d::picks_at(self.edits, at);
            },
            py::arg("frame"), "The picks and holds of a frame; outside the clip, at its ends.")
        .def(
            "pick_matte_at",
            [](const BoundSidecar& self, const std::string& id, double frame) {
                const double at = clamped(self, frame);
                const Unlocked unlocked;
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
            const Unlocked unlocked;
            return bound(palette4d::read_sidecar(bytes));
        },
        py::arg("path"), "Read and validate a sidecar file; SidecarError when it is unusable.");
    module.def(
        "parse_sidecar",
        [](const py::object& text, const py::str& called) {
            const std::string bytes = text_bytes(text), name = utf8_of(called);
            const Unlocked unlocked;
            return bound(palette4d::parse_sidecar(bytes, name));
        },
        py::arg("text"), py::arg("name") = "<text>",
        "The same for text (str or bytes) in memory; `name` replaces the file name in errors.");
    module.def("clip_name", &palette4d::clip_name, py::arg("file_name"),
               "A media file's name without extension and frame number: that of its sidecar.");
    module.attr("LONGEST_NAME") = palette4d::kLongestName;
    module.def(
        "file_safe", &palette4d::file_safe, py::arg("name"),
        py::arg("longest") = palette4d::kLongestName,
        "A name (UTF-8) that is safe in files and in OpenColorIO, of so many bytes at most.");
    module.def("decode_sidecar", &decode, py::arg("text"), py::arg("name") = "<text>",
               "The same, and the members as dicts and lists.");
    module.def("encode_sidecar", &encode, py::arg("members"), py::arg("name") = "<members>",
               "The core's view of a sidecar's members, and their text as UTF-8.");
    module.def(
        "plain",
        [](const py::object& value, const std::string& name) {
            return python_from(json_from(value, name));
        },
        py::arg("value"), py::arg("name") = "<value>",
        "A deep copy with dicts, lists, texts and numbers of Python alone.");
}
