// What a frame shows, for Python: the picture, a matte, the palette below the picture.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "binders.hpp"
#include "convert/colour_spaces.hpp"
#include "output/drawing.hpp"
#include "output/scopes.hpp"
#include "unlocked.hpp"

using namespace palette4d;
using namespace palette4d::bindings;

namespace {

Output output_from(const std::string& name) {
    static const std::map<std::string, Output> all = {{"recoloured", Output::kRecoloured},
                                                      {"weight", Output::kWeight},
                                                      {"palette", Output::kPalette},
                                                      {"outside", Output::kOutside},
                                                      {"pick", Output::kPick}};
    const auto found = all.find(name);
    if (found == all.end()) {
        throw py::value_error("output: found '" + name +
                              "', expected 'recoloured', 'weight', 'palette', 'outside' or 'pick'");
    }
    return found->second;
}

/// The place of a picture in an image, x, y, width, height from the top, where y counts upwards.
Area picture_in(const std::array<int, 4>& place, int height) {
    constexpr int kMost = 1 << 24;  // sums stay far within int
    const auto [x, y, wide, high] = place;
    if (wide < 1 || high < 1 || wide > kMost || high > kMost || std::abs(std::int64_t{x}) > kMost ||
        std::abs(std::int64_t{y}) > kMost) {
        throw py::value_error(
            "picture: expected x, y and a width and height of 1 or more, in pixels");
    }
    return {x, height - y - high, x + wide, height - y};
}

py::array draw(const py::array& image, const std::string& output,
               const std::shared_ptr<const Recolourer>& map, const py::object& original,
               const py::object& edited, double strength, double keep_lightness,
               const Vec3& lightness, double mix, bool matte_in_alpha, double outside_at,
               double clean_up, bool premultiplied, int threads, const ColourConversion* conversion,
               const std::optional<std::array<int, 4>>& picture) {
    require_image(image, "image");
    if (threads < 0) throw py::value_error("threads: found less than 0, expected 0 or more");
    if (!(outside_at > 0)) throw py::value_error("outside_at: expected a number above 0");
    if (!(clean_up >= 0 && clean_up <= 1)) throw py::value_error("clean_up: expected 0 to 1");
    Drawing drawing;
    drawing.options = {output_from(output), matte_in_alpha, outside_at, strength,
                       keep_lightness,      lightness,      mix,        clean_up};
    if (drawing.options.is_matte()) {
        drawing.reader = map;
    } else if (map->moves()) {
        drawing.edit = map;
    }
    if (drawing.options.output == Output::kPalette) {
        drawing.original = colours_from(original, "original");
        drawing.edited = colours_from(edited, "edited");
        if (drawing.original.size() != drawing.edited.size()) {
            throw py::value_error("edited: expected as many colours as in original");
        }
    }
    if (conversion && !conversion->identity()) {
        drawing.conversion = {std::shared_ptr<void>(), conversion};  // Python owns it
    }
    py::array result = py::array_t<float>({image.shape(0), image.shape(1), image.shape(2)});
    const auto in_view = view_of<ConstImageView>(image, static_cast<const float*>(image.data()));
    const auto out_view = view_of<ImageView>(result, static_cast<float*>(result.mutable_data()));
    if (picture) drawing.picture = picture_in(*picture, in_view.height);
    const Unlocked unlocked;
    draw_picture(in_view, out_view, drawing, premultiplied, threads);
    return result;
}

py::tuple scope_counts(const py::array& image, int columns, double zoom, int threads) {
    require_image(image, "image");
    if (columns < 1) throw py::value_error("columns: found less than 1, expected 1 or more");
    if (!(zoom > 0)) throw py::value_error("zoom: expected a number above 0");
    if (threads < 0) throw py::value_error("threads: found less than 0, expected 0 or more");
    const auto view = view_of<ConstImageView>(image, static_cast<const float*>(image.data()));
    const ScopeCounts counts = [&] {
        const Unlocked unlocked;
        return count_scopes(view, columns, zoom, threads);
    }();
    using Counts = py::array_t<std::uint32_t>;
    return py::make_tuple(
        Counts({counts.columns, kScopeTraces, kScopeLevels}, counts.waveform.data()),
        Counts({kScopeVectors, kScopeVectors}, counts.vectors.data()));
}

}  // namespace

void bind_output(py::module_& module) {
    module.def("draw", &draw, py::arg("image"), py::arg("output"), py::arg("map").none(false),
               py::kw_only(), py::arg("original") = py::none(), py::arg("edited") = py::none(),
               py::arg("strength") = 1.0, py::arg("keep_lightness") = 0.0,
               py::arg("lightness") = Vec3{0, 0, 0}, py::arg("mix") = 1.0,
               py::arg("matte_in_alpha") = false, py::arg("outside_at") = 0.05,
               py::arg("clean_up") = 1.0, py::arg("premultiplied") = false, py::arg("threads") = 1,
               py::arg("conversion") = py::none(), py::arg("picture") = py::none(),
               "(h, w, 3 or 4) float32 in and out: what the node draws for a frame.");
    module.def("scope_counts", &scope_counts, py::arg("image"), py::kw_only(),
               py::arg("columns") = 480, py::arg("zoom") = 1.0, py::arg("threads") = 0,
               "What waveform, parade and vectorscope show of display code values, as counts.");
    module.attr("SCOPE_BELOW") = kScopeBelow;
    module.def("luminance_weights", &luminance_weights, py::arg("encoding"),
               "Weights of red, green and blue by an encoding's name; Rec.709's if unknown.");
}
