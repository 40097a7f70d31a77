// The drawing on GPUs, for Python: the kernel's text, and a frame's tables.
#include <array>
#include <map>
#include <string>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "gpu/frame_table.hpp"
#include "gpu/text.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

std::string text(const std::string& part) {
    using namespace palette4d::gpu;
    static const std::map<std::string, const char* (*)()> parts = {{"frame", &frame_text},
                                                                   {"clip", &clip_text},
                                                                   {"clip_picks", &clip_picks_text},
                                                                   {"clip_main", &clip_main_text},
                                                                   {"sampled", &sampled_text},
                                                                   {"opencl", &opencl_text},
                                                                   {"metal", &metal_text}};
    const auto found = parts.find(part);
    if (found == parts.end()) {
        throw py::value_error("part: found '" + part + "'");
    }
    return found->second();
}

py::tuple table(const std::shared_ptr<const Recolourer>& map, const std::string& output,
                double strength, double keep_lightness, const Vec3& lightness, double mix,
                bool matte_in_alpha, double outside_at, bool premultiplied,
                const ColourConversion* conversion, double clean_up,
                const std::array<int, 2>& size) {
    static const std::map<std::string, Output> outputs = {{"recoloured", Output::kRecoloured},
                                                          {"weight", Output::kWeight},
                                                          {"outside", Output::kOutside},
                                                          {"pick", Output::kPick}};
    const auto found = outputs.find(output);
    if (found == outputs.end()) {
        throw py::value_error("output: found '" + output +
                              "', expected 'recoloured', 'weight', 'outside' or 'pick'");
    }
    Drawing drawing;
    drawing.options = {found->second,  matte_in_alpha, outside_at, strength,
                       keep_lightness, lightness,      mix,        clean_up};
    (drawing.options.is_matte() ? drawing.reader : drawing.edit) = map;
    if (conversion && !conversion->identity()) {
        drawing.conversion = {std::shared_ptr<void>(), conversion};  // Python owns it
    }
    const std::string problem = gpu::lacks(drawing);
    if (!problem.empty()) throw py::value_error("the kernel cannot draw " + problem);
    const Area picture{0, 0, size[1], size[0]};
    const int cell = clean_up_cell(1, clip_lines(drawing));
    const CleanUp::Place place{picture, picture, picture, picture, cell, cell};
    const gpu::FrameTable made = gpu::frame_table(drawing, premultiplied, &place);
    const auto array = [](const std::vector<float>& values) {
        return py::array_t<float>(static_cast<py::ssize_t>(values.size()), values.data());
    };
    return py::make_tuple(array(made.table), array(made.grids));
}

}  // namespace

void bind_gpu(py::module_& module) {
    module.def(
        "kernel_text", &text, py::arg("part"),
        "The GPU kernel's text: 'frame', 'clip', 'clip_picks', 'clip_main', 'sampled', 'opencl' or "
        "'metal'.");
    module.def(
        "kernel_table", &table, py::arg("map").none(false), py::kw_only(),
        py::arg("output") = "recoloured", py::arg("strength") = 1.0,
        py::arg("keep_lightness") = 0.0, py::arg("lightness") = Vec3{0, 0, 0}, py::arg("mix") = 1.0,
        py::arg("matte_in_alpha") = false, py::arg("outside_at") = 0.05,
        py::arg("premultiplied") = false, py::arg("conversion") = py::none(),
        py::arg("clean_up") = 0.0, py::arg("size") = std::array<int, 2>{0, 0},
        "What the kernel reads for a frame: the table and the grids, float32. `size`: rows and "
        "columns of the picture that is cleaned up, whose first row is its lowest.");
}
