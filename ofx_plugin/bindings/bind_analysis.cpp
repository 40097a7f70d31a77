// The analysis' hot loops: colour bins, colour trees, losses, progressive hulls.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstring>
#include <memory>

#include "binders.hpp"
#include "palette4d/colour_bins.hpp"
#include "palette4d/colour_tree.hpp"
#include "palette4d/palette_loss.hpp"
#include "palette4d/polytope_loss.hpp"
#include "palette4d/progressive_hull.hpp"

namespace py = pybind11;
using namespace palette4d;

namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Ints = py::array_t<int, py::array::c_style | py::array::forcecast>;

template <std::size_t N>
std::vector<std::array<double, N>> rows(const Doubles& a, const char* what) {
    if (a.ndim() != 2 || a.shape(1) != static_cast<py::ssize_t>(N))
        throw py::value_error(std::string(what) + ": found an array of " +
                              std::to_string(a.ndim()) + " dimensions, expected shape (n, " +
                              std::to_string(N) + ")");
    std::vector<std::array<double, N>> out(static_cast<std::size_t>(a.shape(0)));
    if (!out.empty()) std::memcpy(out.data(), a.data(), out.size() * sizeof(out[0]));
    return out;
}

std::vector<Face> triangles(const Ints& a) {
    if (a.size() == 0) return {};
    if (a.ndim() != 2 || a.shape(1) != 3)
        throw py::value_error("faces: expected an integer array of shape (f, 3)");
    std::vector<Face> out(static_cast<std::size_t>(a.shape(0)));
    std::memcpy(out.data(), a.data(), out.size() * sizeof(Face));
    return out;
}

template <std::size_t N>
Doubles table(const std::vector<std::array<double, N>>& v) {
    Doubles out({static_cast<py::ssize_t>(v.size()), static_cast<py::ssize_t>(N)});
    if (!v.empty()) std::memcpy(out.mutable_data(), v.data(), v.size() * sizeof(v[0]));
    return out;
}

Doubles column(const std::vector<double>& v) {
    return Doubles(static_cast<py::ssize_t>(v.size()), v.data());
}

/// Rows: R, C, D, share of pixels outside, largest distance.
Doubles loss_rows(const std::vector<FrameLoss>& losses) {
    std::vector<std::array<double, 5>> out;
    for (const FrameLoss& l : losses) out.push_back({l.R, l.C, l.D, l.outside, l.max_distance});
    return table(out);
}

void check_faces(const std::vector<Face>& faces, std::size_t n) {
    for (const Face& f : faces)
        for (int v : f)
            if (v < 0 || v >= static_cast<int>(n))
                throw py::value_error("a face names vertex " + std::to_string(v) + " of " +
                                      std::to_string(n));
}

struct PolytopeLoss {
    std::vector<BlockTopology> blocks;
    std::vector<FrameColours> frames;
};

}  // namespace

void bind_analysis(py::module_& m) {
    m.def(
        "bin_colours",
        [](const py::array_t<float>& image, double step, std::size_t most) {
            if (image.ndim() != 3)
                throw py::value_error("image: found " + std::to_string(image.ndim()) +
                                      " dimensions, expected (h, w, 3 or 4)");
            py::array_t<float> packed = image;
            if (image.strides(2) != static_cast<py::ssize_t>(sizeof(float)) ||
                image.strides(1) != image.shape(2) * static_cast<py::ssize_t>(sizeof(float)))
                packed = py::array_t<float, py::array::c_style | py::array::forcecast>(image);
            ColourBins bins;
            {
                const float* data = packed.data();
                const auto h = static_cast<int>(packed.shape(0));
                const auto w = static_cast<int>(packed.shape(1));
                const auto c = static_cast<int>(packed.shape(2));
                const py::ssize_t stride = packed.strides(0);
                py::gil_scoped_release release;
                bins = bin_colours(data, w, h, c, stride, step, most);
            }
            return py::make_tuple(table(bins.rgb), column(bins.counts), bins.step, bins.ignored);
        },
        py::arg("image"), py::arg("step"), py::arg("most"));

    m.def(
        "coarsen_colours",
        [](const Doubles& rgb, const Doubles& counts, double step, std::size_t most) {
            const std::vector<double> n(counts.data(), counts.data() + counts.size());
            const ColourBins bins = coarsen_colours(rows<3>(rgb, "rgb"), n, step, most);
            return py::make_tuple(table(bins.rgb), column(bins.counts), bins.step);
        },
        py::arg("rgb"), py::arg("counts"), py::arg("step"), py::arg("most"));

    py::class_<ColourTree, std::shared_ptr<ColourTree>>(m, "ColourTree")
        .def(py::init([](const Doubles& rgb, const Doubles& counts) {
                 std::vector<double> n(counts.data(), counts.data() + counts.size());
                 return std::make_shared<ColourTree>(rows<3>(rgb, "rgb"), std::move(n));
             }),
             py::arg("rgb"), py::arg("counts"))
        .def_property_readonly("rgb", [](const ColourTree& t) { return table(t.rgb()); })
        .def_property_readonly("counts", [](const ColourTree& t) { return column(t.counts()); })
        .def_property_readonly("total", &ColourTree::total)
        .def(
            "nearest_mean",
            [](const ColourTree& t, const Doubles& v, double k) {
                std::vector<Vec3> out;
                for (const Vec3& x : rows<3>(v, "v")) out.push_back(t.nearest_mean(x, k));
                return table(out);
            },
            py::arg("v"), py::arg("k"))
        .def("__len__", [](const ColourTree& t) { return t.rgb().size(); });

    m.def(
        "palette_loss",
        [](const ColourTree& colours, const Doubles& palette, const Ints& faces, double lambda,
           double k, double convexity) {
            const std::vector<Vec3> v = rows<3>(palette, "palette");
            if (v.empty())
                throw py::value_error("palette: found no colours, expected at least one");
            const std::vector<Face> f = triangles(faces);
            check_faces(f, v.size());
            std::vector<Vec3> gradient;
            FrameLoss loss;
            {
                py::gil_scoped_release release;
                loss = palette_loss(colours, v, f, {lambda, k, convexity}, &gradient);
            }
            return py::make_tuple(loss.R, loss.C, loss.D, loss.outside, loss.max_distance,
                                  table(gradient));
        },
        py::arg("colours"), py::arg("palette"), py::arg("faces"), py::arg("lambda_"), py::arg("k"),
        py::arg("convexity"));

    py::class_<PolytopeLoss>(m, "PolytopeLoss")
        .def(py::init([](const py::list& blocks, const Doubles& frames,
                         const std::vector<std::shared_ptr<ColourTree>>& colours) {
                 PolytopeLoss out;
                 for (const auto& item : blocks) {
                     const auto block = item.cast<py::tuple>();
                     out.blocks.push_back({block[0].cast<double>(), block[1].cast<double>(),
                                           block[2].cast<std::vector<std::vector<int>>>(),
                                           triangles(block[3].cast<Ints>())});
                 }
                 if (frames.size() != static_cast<py::ssize_t>(colours.size()))
                     throw py::value_error("expected one colour tree a frame");
                 for (std::size_t i = 0; i < colours.size(); ++i)
                     out.frames.push_back({frames.data()[i], colours[i]});
                 return out;
             }),
             py::arg("blocks"), py::arg("frames"), py::arg("colours"))
        .def(
            "evaluate",
            [](const PolytopeLoss& self, const Doubles& vertices, const std::vector<int>& which,
               double lambda, double k, double convexity, int threads, bool with_gradient) {
                const std::vector<Vec4> v = rows<4>(vertices, "vertices");
                std::vector<Vec4> gradient;
                std::vector<FrameLoss> losses;
                {
                    py::gil_scoped_release release;
                    losses =
                        polytope_loss(v, self.blocks, self.frames, which, {lambda, k, convexity},
                                      threads, with_gradient ? &gradient : nullptr);
                }
                return py::make_tuple(loss_rows(losses), table(gradient));
            },
            py::arg("vertices"), py::arg("which"), py::arg("lambda_"), py::arg("k"),
            py::arg("convexity"), py::arg("threads"), py::arg("gradient"));

    m.def(
        "progressive_hull",
        [](const Doubles& rgb, const Ints& faces, int target) {
            const std::vector<Vec3> v = rows<3>(rgb, "rgb");
            const std::vector<Face> f = triangles(faces);
            std::vector<Vec3> out;
            {
                py::gil_scoped_release release;
                out = progressive_hull(v, f, target);
            }
            return table(out);
        },
        py::arg("rgb"), py::arg("faces"), py::arg("target"));
}
