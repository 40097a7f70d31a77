// The analysis' hot loops: colour bins, colour trees, losses, progressive hulls, links.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>

#include "arrays.hpp"
#include "binders.hpp"
#include "fit/colour_bins.hpp"
#include "fit/colour_links.hpp"
#include "fit/colour_tree.hpp"
#include "fit/palette_loss.hpp"
#include "fit/polytope_loss.hpp"
#include "fit/progressive_hull.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

/// The extra loss terms that are minimised with the paper's.
double shape_of(const FrameLoss& loss, const LossWeights& weights) {
    return weights.convexity * loss.D + loss.S + weights.lambda * loss.E;
}

/// Rows: R, C, shape, share of pixels outside, largest distance.
DoubleArray loss_rows(const std::vector<FrameLoss>& losses, const LossWeights& weights) {
    DoubleArray rows({static_cast<py::ssize_t>(losses.size()), py::ssize_t{5}});
    double* out = rows.mutable_data();
    for (const FrameLoss& l : losses)
        for (const double x : {l.R, l.C, shape_of(l, weights), l.outside, l.max_distance})
            *out++ = x;
    return rows;
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

using BoolArray = py::array_t<bool, py::array::c_style | py::array::forcecast>;

template <class Value, class Array>
std::vector<Value> flat(const Array& array) {
    return {array.data(), array.data() + array.size()};
}

}  // namespace

void bind_analysis(py::module_& m) {
    py::class_<ColourTree, std::shared_ptr<ColourTree>>(m, "ColourTree")
        .def(py::init([](const py::object& rgb, const py::object& counts) {
                 std::vector<Vec3> v = colours_from(rgb, "rgb");
                 std::vector<double> n = numbers_from(counts, "counts");
                 const Unlocked unlocked;
                 return std::make_shared<ColourTree>(std::move(v), std::move(n));
             }),
             py::arg("rgb"), py::arg("counts"))
        .def_property_readonly("rgb",
                               [](const ColourTree& t) {
                                   std::vector<Vec3> rgb;
                                   rgb.reserve(t.size());
                                   for (std::size_t i = 0; i < t.size(); ++i)
                                       rgb.push_back(t.rgb(static_cast<int>(i)));
                                   return to_array(rgb);
                               })
        .def_property_readonly(
            "counts",
            [](const ColourTree& t) {
                return to_array(std::vector<double>(t.counts(), t.counts() + t.size()));
            })
        .def_property_readonly("total", &ColourTree::total)
        .def(
            "nearest_mean",
            [](const ColourTree& t, const py::object& v, double k) {
                std::vector<Vec3> colours = colours_from(v, "v");
                {
                    const Unlocked unlocked;
                    for (Vec3& x : colours) x = t.nearest_mean(x, k);
                }
                return to_array(colours);
            },
            py::arg("v"), py::arg("k"))
        .def("__len__", [](const ColourTree& t) { return t.size(); });

    py::class_<LossWeights>(m, "LossWeights")
        .def(py::init([](double lambda, double k, double convexity, double separation, double reach,
                         double slight) {
                 return LossWeights{lambda, k, convexity, separation, reach, slight};
             }),
             py::arg("lambda_"), py::arg("k"), py::arg("convexity") = 0.0,
             py::arg("separation") = 0.0, py::arg("reach") = 0.0,
             py::arg("slight") = LossWeights{}.slight);

    m.def(
        "palette_loss",
        [](const ColourTree& colours, const py::object& palette, const py::object& faces,
           const LossWeights& weights, bool with_gradient) {
            const std::vector<Vec3> v = colours_from(palette, "palette");
            if (v.empty())
                throw py::value_error("palette: found no colours, expected at least one");
            const std::vector<Face> f = faces_from(faces);
            check_faces(f, v.size());
            std::vector<Vec3> gradient;
            FrameLoss loss;
            {
                const Unlocked unlocked;
                loss = palette_loss(colours, v, f, weights, with_gradient ? &gradient : nullptr);
            }
            return py::make_tuple(loss.R, loss.C, shape_of(loss, weights), loss.outside,
                                  loss.max_distance, to_array(gradient));
        },
        py::arg("colours"), py::arg("palette"), py::arg("faces"), py::arg("weights"),
        py::arg("gradient") = true);

    py::class_<PolytopeLoss>(m, "PolytopeLoss")
        .def(py::init([](const py::list& blocks, const py::object& frames,
                         const std::vector<std::shared_ptr<ColourTree>>& colours) {
                 PolytopeLoss out;
                 const std::vector<double> times = numbers_from(frames, "frames");
                 for (const auto& item : blocks) {
                     const auto block = item.cast<py::tuple>();
                     out.blocks.push_back({block[0].cast<double>(), block[1].cast<double>(),
                                           block[2].cast<std::vector<std::vector<int>>>(),
                                           faces_from(block[3])});
                 }
                 if (times.size() != colours.size())
                     throw py::value_error("colours: found " + std::to_string(colours.size()) +
                                           " colour trees, expected one for each of " +
                                           std::to_string(times.size()) + " frames");
                 for (std::size_t i = 0; i < colours.size(); ++i)
                     out.frames.push_back({times[i], colours[i]});
                 return out;
             }),
             py::arg("blocks"), py::arg("frames"), py::arg("colours"))
        .def(
            "evaluate",
            [](const PolytopeLoss& self, const py::object& vertices, const std::vector<int>& which,
               const LossWeights& weights, int threads, bool with_gradient) {
                const std::vector<Vec4> v = vertices_from(vertices, "vertices");
                std::vector<Vec4> gradient;
                std::vector<FrameLoss> losses;
                {
                    const Unlocked unlocked;
                    losses = polytope_loss(v, self.blocks, self.frames, which, weights, threads,
                                           with_gradient ? &gradient : nullptr);
                }
                return py::make_tuple(loss_rows(losses, weights), to_array(gradient));
            },
            py::arg("vertices"), py::arg("which"), py::arg("weights"), py::arg("threads"),
            py::arg("gradient"));

    m.def(
        "smoothness",
        [](const py::object& vertices, const IntArray& edges, double length,
           const py::object& weights) {
            const std::vector<Vec4> v = vertices_from(vertices, "vertices");
            const std::vector<double> factors = numbers_from(weights, "weights");
            const py::ssize_t count = static_cast<py::ssize_t>(factors.size());
            if (edges.ndim() != 2 || edges.shape(0) != count || edges.shape(1) != 2)
                throw py::value_error("edges: found shape " + shape_text(edges) + ", expected (" +
                                      std::to_string(count) + ", 2): one for each weight");
            std::vector<TimeEdge> list;
            list.reserve(factors.size());
            for (py::ssize_t i = 0; i < count; ++i)
                list.push_back({edges.at(i, 0), edges.at(i, 1), factors[i]});
            std::vector<Vec4> gradient;
            const double k = smoothness(v, list, length, &gradient);
            return py::make_tuple(k, to_array(gradient));
        },
        py::arg("vertices"), py::arg("edges"), py::arg("length"), py::arg("weights"));

    m.def(
        "progressive_hull",
        [](const py::object& rgb, const py::object& faces, int target) {
            const std::vector<Vec3> v = colours_from(rgb, "rgb");
            const std::vector<Face> f = faces_from(faces);
            std::vector<Vec3> out;
            {
                const Unlocked unlocked;
                out = progressive_hull(v, f, target);
            }
            return to_array(out);
        },
        py::arg("rgb"), py::arg("faces"), py::arg("target"));

    m.def(
        "find_links",
        [](const DoubleArray& distance, const BoolArray& allowed, const BoolArray& near_first,
           const BoolArray& near_second, std::vector<int> order, bool strict, double bound,
           double broken_cost, int most_nodes) {
            if (distance.ndim() != 2)
                throw py::value_error("distance: found shape " + shape_text(distance) +
                                      ", expected (n, m)");
            const LinkProblem problem{static_cast<int>(distance.shape(0)),
                                      static_cast<int>(distance.shape(1)),
                                      flat<double>(distance),
                                      flat<std::uint8_t>(allowed),
                                      flat<std::uint8_t>(near_first),
                                      flat<std::uint8_t>(near_second),
                                      std::move(order),
                                      strict,
                                      bound,
                                      broken_cost,
                                      most_nodes};
            ColourLinks out;
            {
                const Unlocked unlocked;
                out = find_links(problem);
            }
            return py::make_tuple(out.links, out.broken, out.complete);
        },
        py::arg("distance"), py::arg("allowed"), py::arg("near_first"), py::arg("near_second"),
        py::arg("order"), py::kw_only(), py::arg("strict"), py::arg("bound"),
        py::arg("broken_cost"), py::arg("most_nodes"));
}
