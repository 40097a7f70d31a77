// Recolouring of float32 images for Python.
#include <memory>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "output/clean_up.hpp"
#include "recolour/recolour.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

/// Whether two images share memory without being exactly the same rows.
bool overlap(const py::array& a, const py::array& b) {
    if (a.size() == 0 || b.size() == 0) return false;
    if (a.data() == b.data() && a.strides(0) == b.strides(0)) return false;
    const auto span = [](const py::array& image) {
        const auto first = reinterpret_cast<std::intptr_t>(image.data());
        const auto last = first + image.strides(0) * (image.shape(0) - 1);
        const auto row = image.shape(1) * image.shape(2) * py::ssize_t{sizeof(float)};
        return std::make_pair(std::min(first, last), std::max(first, last) + row);
    };
    const auto x = span(a), y = span(b);
    return x.first < y.second && y.first < x.second;
}

Precision precision_from(const std::string& name) {
    if (name == "single") return Precision::kSingle;
    if (name == "double") return Precision::kDouble;
    throw py::value_error("precision: found '" + name + "', expected 'single' or 'double'");
}

InstructionSet instructions_from(const std::string& name) {
    std::string names = "'best'";
    if (name == name_of(InstructionSet::kBest)) return InstructionSet::kBest;
    for (const InstructionSet set : instruction_sets()) {
        if (name == name_of(set)) return set;
        names += std::string(", '") + name_of(set) + "'";
    }
    throw py::value_error("instructions: found '" + name + "', expected one of " + names);
}

py::array apply(const Recolourer& self, const py::array& image, double strength, bool premultiplied,
                int threads, const py::object& out, const std::string& precision,
                const std::string& instructions, const ColourConversion* conversion, bool picture) {
    require_image(image, "image");
    py::array result;
    if (out.is_none()) {
        result = py::array_t<float>({image.shape(0), image.shape(1), image.shape(2)});
    } else {
        if (!py::isinstance<py::array>(out)) throw py::value_error("out: not a NumPy array");
        result = py::reinterpret_borrow<py::array>(out);
        require_image(result, "out");
        if (!result.writeable()) throw py::value_error("out: found a read-only array");
        for (py::ssize_t axis = 0; axis < 3; ++axis) {
            if (result.shape(axis) != image.shape(axis)) {
                throw py::value_error("out: found shape " + shape_text(result) +
                                      ", expected the image's, " + shape_text(image));
            }
        }
        if (overlap(image, result)) {
            throw py::value_error(
                "out: found memory that overlaps the image's, expected the same rows or separate "
                "memory");
        }
    }
    const auto in_view = view_of<ConstImageView>(image, static_cast<const float*>(image.data()));
    const auto out_view = view_of<ImageView>(result, static_cast<float*>(result.mutable_data()));
    RecolourOptions options{strength,
                            premultiplied,
                            threads,
                            precision_from(precision),
                            instructions_from(instructions),
                            conversion};
    if (picture) {
        const Area whole{0, 0, in_view.width, in_view.height};
        options.place = image_place(whole, 0, in_view.height - 1, -1, self.picks());
    }
    {
        const Unlocked unlocked;
        self.apply(in_view, out_view, options);
    }
    return result;
}

/// The straight colours of an image.
py::array_t<float> straight_colours(const py::array& image, bool premultiplied) {
    require_image(image, "image");
    py::array_t<float> result({image.shape(0), image.shape(1), py::ssize_t{3}});
    const auto from = image.unchecked<float, 3>();
    float* to = result.mutable_data();
    const bool divide = premultiplied && image.shape(2) == 4;
    const Unlocked unlocked;
    for (py::ssize_t y = 0; y < from.shape(0); ++y) {
        for (py::ssize_t x = 0; x < from.shape(1); ++x) {
            const float alpha = divide ? from(y, x, 3) : 1;
            for (py::ssize_t c = 0; c < 3; ++c) *to++ = straight(from(y, x, c), alpha);
        }
    }
    return result;
}

}  // namespace

void bind_recolour(py::module_& module) {
    py::class_<Recolourer, std::shared_ptr<Recolourer>>(
        module, "Recolourer",
        "One frame's recolouring: p' = p + strength * (h(p) sum_i w_i(q) (v'_i - v_i) + picks at "
        "p).")
        .def(py::init([](const py::object& original, const py::object& edited,
                         const py::object& faces, const FramePicks* picks) {
                 return std::make_unique<Recolourer>(
                     colours_from(original, "original"), colours_from(edited, "edited"),
                     faces_from(faces), picks ? *picks : FramePicks());
             }),
             py::arg("original"), py::arg("edited"), py::arg("faces"), py::kw_only(),
             py::arg("picks") = py::none())
        .def_property_readonly(
            "identity", [](const Recolourer& self) { return !self.moves(); },
            "True when no colour moves: apply() then copies bit for bit.")
        .def(
            "displaced",
            [](const Recolourer& self, const py::object& colours, double strength) {
                std::vector<Vec3> result = colours_from(colours, "colours");
                {
                    const Unlocked unlocked;
                    for (Vec3& colour : result) colour = self.displaced(colour, strength);
                }
                return to_array(result);
            },
            py::arg("colours"), py::kw_only(), py::arg("strength") = 1.0,
            "(n, 3) float64 in and out, in double; colours that are not finite stay.")
        .def("apply", &apply, py::arg("image"), py::kw_only(), py::arg("strength") = 1.0,
             py::arg("premultiplied") = false, py::arg("threads") = 1, py::arg("out") = py::none(),
             py::arg("precision") = "double", py::arg("instructions") = "best",
             py::arg("conversion") = py::none(), py::arg("picture") = false,
             "(h, w, 3 or 4) float32 in and out; threads 0 means one per processor. `picture`: the "
             "image is all of the clip's picture, so that windows of picks count.");
    module.def("straight_colours", &straight_colours, py::arg("image"), py::kw_only(),
               py::arg("premultiplied"),
               "(h, w, 3) float32 of (h, w, 3 or 4): divided by alpha where premultiplied.");
    module.attr("LEAST_ALPHA") = kLeastAlpha;
    module.def(
        "instruction_sets",
        [] {
            std::vector<std::string> names;
            for (const InstructionSet set : instruction_sets()) names.emplace_back(name_of(set));
            return names;
        },
        "The instruction sets that Recolourer.apply() can use here, slowest first.");
}
