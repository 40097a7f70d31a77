// Picks and holds for Python: a frame's picks, and mattes over colours.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "fit/matte_learning.hpp"
#include "model/matte.hpp"
#include "recolour/frame_picks.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

using FloatArray = py::array_t<float, py::array::c_style>;
using ByteArray = py::array_t<std::uint8_t, py::array::c_style>;

const std::vector<py::ssize_t> kGridShape = {MatteGrid::kSaturations, MatteGrid::kSaturations,
                                             MatteGrid::kLightnesses};

template <class T>
std::vector<T> grid_from(const py::array_t<T, py::array::c_style>& array, const char* what) {
    if (array.ndim() != 3 || !std::equal(kGridShape.begin(), kGridShape.end(), array.shape())) {
        throw py::value_error(std::string(what) + ": found the shape " + shape_text(array) +
                              ", expected (96, 96, 16)");
    }
    return std::vector<T>(array.data(), array.data() + array.size());
}

template <class T>
py::array_t<T> grid_array(const std::vector<T>& grid) {
    py::array_t<T> array(kGridShape);
    std::memcpy(array.mutable_data(), grid.data(), grid.size() * sizeof(T));
    return array;
}

std::shared_ptr<const DisplayCurve> curve_from(const py::object& object) {
    if (object.is_none()) return nullptr;
    const auto [from, to, values] = object.cast<std::tuple<double, double, std::vector<double>>>();
    if (!(from < to) || values.size() < 2) {
        throw py::value_error("display: expected (from, to, values), from < to, 2 values or more");
    }
    return std::make_shared<const DisplayCurve>(DisplayCurve{from, to, values});
}

using GivenWindow = std::optional<std::tuple<PickWindow::Box, double, bool>>;

FramePicks frame_picks(const std::vector<std::tuple<Vec3, Vec3, double, FloatArray>>& picks,
                       const py::object& left, const py::object& display,
                       const std::vector<GivenWindow>& windows, const std::array<double, 2>& size) {
    FramePicks result;
    if (!windows.empty() && windows.size() != picks.size()) {
        throw py::value_error("windows: expected one for each pick, or none");
    }
    for (const auto& [colour, change, strength, matte] : picks) {
        result.picks.push_back({colour, change, strength,
                                std::make_shared<const FrameMatte>(grid_from(matte, "matte"))});
    }
    if (!left.is_none()) {
        result.left =
            std::make_shared<const FrameMatte>(grid_from(left.cast<FloatArray>(), "left"));
    }
    for (std::size_t i = 0; i < windows.size(); ++i) {
        if (!windows[i]) continue;
        const auto& [box, feather, inverted] = *windows[i];
        result.picks[i].window.emplace(PickWindow{feather, {{0, box}}, inverted}, 0);
    }
    result.width = size[0];
    result.height = size[1];
    result.display = curve_from(display);
    return result;
}

FramePicks with_changes(const FramePicks& self, const std::vector<Vec3>& changes) {
    if (changes.size() != self.picks.size()) {
        throw py::value_error("changes: expected one for each pick");
    }
    FramePicks result = self;
    for (std::size_t i = 0; i < changes.size(); ++i) result.picks[i].change = changes[i];
    return result;
}

FramePicks of_part(const FramePicks& self, const PickWindow::Box& part) {
    if (!(part[0] < part[2] && part[1] < part[3])) {
        throw py::value_error("part: expected left < right and top < bottom");
    }
    FramePicks result = self;
    result.width = part[2] - part[0];
    result.height = part[3] - part[1];
    for (FramePick& pick : result.picks) {
        if (!pick.window) continue;
        for (std::size_t i = 0; i < 4; ++i) {
            pick.window->box[i] = static_cast<float>(pick.window->box[i] - part[i % 2]);
        }
    }
    return result;
}

py::list windows_of(const FramePicks& self) {
    py::list result;
    for (const FramePick& pick : self.picks) {
        if (pick.window) {
            const FrameWindow& window = *pick.window;
            result.append(py::make_tuple(window.box, window.feather, window.inverted));
        } else {
            result.append(py::none());
        }
    }
    return result;
}

using GivenArea = std::tuple<std::vector<std::array<double, 2>>, double>;
using GivenFrame =
    std::tuple<py::array, Vec3, std::vector<GivenArea>, std::vector<GivenArea>, bool>;

std::vector<Brush> areas_from(const std::vector<GivenArea>& given) {
    std::vector<Brush> areas;
    for (const auto& [points, radius] : given) areas.push_back({points, radius});
    return areas;
}

py::dict learn(const std::vector<GivenFrame>& given, const Vec3& picked,
               const std::vector<Vec3>& holds, const py::object& display) {
    std::vector<LearningFrame> frames;
    for (const auto& [pixels, colour, object, others, seeded] : given) {
        require_image(pixels, "frame");
        if (pixels.shape(2) != 3) throw py::value_error("frame: expected 3 channels");
        frames.push_back({static_cast<const float*>(pixels.data()),
                          static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)),
                          pixels.strides(0), colour, areas_from(object), areas_from(others),
                          seeded});
    }
    const std::shared_ptr<const DisplayCurve> curve = curve_from(display);
    LearnedMatte learned;
    Matte matte;
    {
        const Unlocked unlocked;
        learned = learn_matte(frames, picked, holds, curve.get());
        matte = matte_of(learned.membership);
    }
    py::dict result;
    result["odds"] = grid_array(matte.odds);
    result["found"] = learned.found;
    return result;
}

py::list picks_of(const FramePicks& self) {
    py::list result;
    for (const FramePick& pick : self.picks) {
        result.append(
            py::make_tuple(pick.colour, pick.change, pick.strength, grid_array(*pick.matte)));
    }
    return result;
}

}  // namespace

void bind_picks(py::module_& module) {
    py::class_<FramePicks, std::shared_ptr<FramePicks>>(
        module, "FramePicks", "The picks and holds of one frame, for a Recolourer.")
        .def(py::init(&frame_picks), py::arg("picks"), py::kw_only(), py::arg("left") = py::none(),
             py::arg("display") = py::none(), py::arg("windows") = std::vector<GivenWindow>(),
             py::arg("size") = std::array<double, 2>{1, 1},
             "(colour, change, strength, (96, 96, 16) float32) of each pick; what holds leave of "
             "the palette's changes; (from, to, values) of a curve to display code values; each "
             "pick's window, or None: (left, top, right, bottom) and a feather, in pixels, and "
             "whether it is inverted; the clip's width and height.")
        .def("with_changes", &with_changes, py::arg("changes"), "The same picks with others.")
        .def("of_part", &of_part, py::arg("part"),
             "The same picks of a part of the picture: (left, top, right, bottom), in pixels.")
        .def_property_readonly("windows", &windows_of)
        .def_property_readonly("count", [](const FramePicks& self) { return self.picks.size(); })
        .def_property_readonly(
            "largest",
            [](const FramePicks& self) {
                double largest = 0;
                for (const FramePick& pick : self.picks) {
                    for (const double change : pick.change) {
                        largest = std::max(largest, pick.strength * std::abs(change));
                    }
                }
                return largest;
            },
            "The largest change of a channel that a pick asks for.")
        .def_property_readonly("picks", &picks_of)
        .def_property_readonly("left", [](const FramePicks& self) -> py::object {
            if (!self.left) return py::none();
            return grid_array(*self.left);
        });
    module.def(
        "learn_matte", &learn, py::arg("frames"), py::arg("picked"), py::kw_only(),
        py::arg("holds") = std::vector<Vec3>(), py::arg("display") = py::none(),
        "The log odds of a pick's matte, and what is known of its region in the first frame. "
        "A frame is ((h, w, 3) float32, the picked colour there, areas of the object, areas "
        "of the background, whether the object is where its areas are). An area is (points, "
        "half width).");
    module.def(
        "pick_points",
        [](const py::object& colours, const py::object& display) {
            const std::shared_ptr<const DisplayCurve> curve = curve_from(display);
            std::vector<Vec3> points = colours_from(colours, "colours");
            for (Vec3& point : points) {
                point = pick_point(displayed(point, curve.get()));
                point[2] *= kLightnessWeight;
            }
            return to_array(points);
        },
        py::arg("colours"), py::arg("display") = py::none(),
        "(n, 3): palette code values in pick space: two coordinates of saturation, and 0.4 of "
        "lightness.");
    module.def(
        "hue_matte", [](const Vec3& picked) { return grid_array(hue_matte(picked).odds); },
        py::arg("picked"), "(96, 96, 16) uint8 log odds of all colours of a display colour's hue.");
}
