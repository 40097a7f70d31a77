// Colour statistics of a frame, from pixels as they are stored to colour trees.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <memory>

#include "arrays.hpp"
#include "binders.hpp"
#include "fit/colour_bins.hpp"
#include "fit/colour_tree.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

/// The array itself if samples are packed in each row, else a packed copy.
template <class Sample>
py::array_t<Sample> packed_rows(const py::array& array) {
    py::ssize_t step = sizeof(Sample);
    for (py::ssize_t axis = array.ndim() - 1; axis > 0; --axis) {
        if (array.strides(axis) != step)
            return py::array_t<Sample, py::array::c_style | py::array::forcecast>(array);
        step *= array.shape(axis);
    }
    return py::array_t<Sample>(array);
}

template <class Sample>
Rows<Sample> rows_of(const py::array_t<Sample>& array) {
    return {array.data(), static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
            array.ndim() == 3 ? static_cast<int>(array.shape(2)) : 1, array.strides(0)};
}

template <class Sample>
bool holds(const py::array& array) {
    return array.dtype().equal(py::dtype::of<Sample>());
}

void add_image(ColourBinner& self, const py::array& image, int bits, bool premultiplied) {
    if (image.ndim() != 3)
        throw py::value_error("image: found shape " + shape_text(image) +
                              ", expected three dimensions, (h, w, 3 or 4)");
    if (holds<std::uint8_t>(image)) {
        const auto packed = packed_rows<std::uint8_t>(image);
        const auto rows = rows_of(packed);
        const Unlocked unlocked;
        self.add(rows, premultiplied);
    } else if (holds<std::uint16_t>(image)) {
        const auto packed = packed_rows<std::uint16_t>(image);
        const auto rows = rows_of(packed);
        const Unlocked unlocked;
        self.add(rows, bits, premultiplied);
    } else if (holds<float>(image)) {
        const auto packed = packed_rows<float>(image);
        const auto rows = rows_of(packed);
        const Unlocked unlocked;
        self.add(rows, premultiplied);
    } else {
        throw py::value_error("image: found dtype " + std::string(py::str(image.dtype())) +
                              ", expected uint8, uint16 or float32");
    }
}

template <class Sample>
void add_planes(ColourBinner& self, const py::array (&planes)[3], const LumaChroma& how) {
    const py::array_t<Sample> packed[3] = {packed_rows<Sample>(planes[0]),
                                           packed_rows<Sample>(planes[1]),
                                           packed_rows<Sample>(planes[2])};
    const Rows<Sample> rows[3] = {rows_of(packed[0]), rows_of(packed[1]), rows_of(packed[2])};
    const Unlocked unlocked;
    self.add_luma_chroma(rows, how);
}

void add_luma_chroma(ColourBinner& self, const py::array& luma, const py::array& blue,
                     const py::array& red, double red_weight, double blue_weight, int bits,
                     bool full_range) {
    const py::array planes[3] = {luma, blue, red};
    for (const py::array& plane : planes)
        if (plane.ndim() != 2)
            throw py::value_error("luma and chroma: found shape " + shape_text(plane) +
                                  ", expected (h, w)");
    const LumaChroma how{red_weight, blue_weight, bits, full_range};
    if (holds<std::uint8_t>(luma) && holds<std::uint8_t>(blue) && holds<std::uint8_t>(red))
        add_planes<std::uint8_t>(self, planes, how);
    else if (holds<std::uint16_t>(luma) && holds<std::uint16_t>(blue) && holds<std::uint16_t>(red))
        add_planes<std::uint16_t>(self, planes, how);
    else
        throw py::value_error("luma and chroma: expected three planes of uint8 or of uint16");
}

struct Trees {
    std::shared_ptr<ColourTree> fine, coarse;
    Vec3 low, high;
};

Trees trees_of(ColourBins fine, std::size_t coarse, double scale) {
    for (double& count : fine.counts) count *= scale;
    Trees out{nullptr, nullptr, fine.rgb[0], fine.rgb[0]};
    for (const Vec3& rgb : fine.rgb)
        for (int c = 0; c < 3; ++c) {
            out.low[c] = std::min(out.low[c], rgb[c]);
            out.high[c] = std::max(out.high[c], rgb[c]);
        }
    if (fine.rgb.size() > coarse) {
        ColourBins few = thin(fine, coarse);
        out.coarse = std::make_shared<ColourTree>(std::move(few.rgb), std::move(few.counts));
    }
    out.fine = std::make_shared<ColourTree>(std::move(fine.rgb), std::move(fine.counts));
    if (!out.coarse) out.coarse = out.fine;
    return out;
}

py::object take_trees(ColourBinner& self, std::size_t colours, std::size_t coarse, double scale) {
    if (colours < 1 || coarse < 1) throw py::value_error("expected room for at least one colour");
    if (!(scale > 0) || !std::isfinite(scale))
        throw py::value_error("expected a positive scale of the counts");
    Trees trees;
    {
        const Unlocked unlocked;
        ColourBins fine = self.take(colours);
        if (!fine.rgb.empty()) trees = trees_of(std::move(fine), coarse, scale);
    }
    if (!trees.fine) return py::none();
    const DoubleArray box = to_array(std::vector<Vec3>{trees.low, trees.high});
    return py::make_tuple(trees.fine, trees.coarse, box[py::int_(0)], box[py::int_(1)]);
}

}  // namespace

void bind_bins(py::module_& m) {
    m.def("return_memory", [] {
#ifdef __GLIBC__
        const Unlocked unlocked;
        malloc_trim(0);
#endif
    });

    py::class_<ColourBinner>(m, "ColourBinner")
        .def(py::init<>())
        .def("add", &add_image, py::arg("image"), py::kw_only(), py::arg("bits") = 16,
             py::arg("premultiplied") = false)
        .def("add_luma_chroma", &add_luma_chroma, py::arg("luma"), py::arg("blue"), py::arg("red"),
             py::kw_only(), py::arg("red_weight"), py::arg("blue_weight"), py::arg("bits"),
             py::arg("full_range"))
        .def(
            "add_colours",
            [](ColourBinner& self, const py::object& rgb, const py::object& counts) {
                const std::vector<Vec3> v = colours_from(rgb, "rgb");
                const std::vector<double> n = numbers_from(counts, "counts");
                const Unlocked unlocked;
                self.add_colours(v, n);
            },
            py::arg("rgb"), py::arg("counts"))
        .def_property_readonly("pixels", &ColourBinner::pixels)
        .def_property_readonly("ignored", &ColourBinner::ignored)
        .def_property_readonly("transparent", &ColourBinner::transparent)
        .def("take", &take_trees, py::arg("colours"), py::arg("coarse"), py::arg("scale") = 1.0)
        .def("clear", &ColourBinner::clear);
}
