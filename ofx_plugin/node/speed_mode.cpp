#include "speed_mode.hpp"

#include <cstdint>
#include <locale>
#include <sstream>

namespace palette4d::node {
namespace {

/// A lattice's cost depends on how many different colours the picture has. Above this many pixels
/// it beats exact rendering for every edit (`bench_lattice.py --size`).
constexpr std::int64_t kLatticePays = 1920 * 1080;

}  // namespace

void define_mode_param(ParamDefiner& define) {
    define.choice({kParamMode, "Mode",
                   "Exact: computes every colour. Lattice: interpolates colours where that is "
                   "within 0.002 of exact, which is several times as fast in large pictures. Auto: "
                   "Lattice while the host says that it plays or renders a draft, in pictures of "
                   "1920x1080 or more that need no conversion; Exact for all else, and always in "
                   "Natron."},
                  {"Auto", "Exact", "Lattice"});
}

Mode mode_at(const Params& params, OfxTime time) {
    const int mode = params.int_at(kParamMode, time).value_or(0);
    return mode == 1 ? Mode::kExact : mode == 2 ? Mode::kLattice : Mode::kAuto;
}

Interpolation interpolation_of(const Suites& suites, Mode mode, const Properties& render_arguments,
                               const OfxRectI& picture) {
    if (mode == Mode::kLattice) return Interpolation::kAlways;
    if (mode == Mode::kExact || suites.is_natron) return Interpolation::kNever;
    const std::int64_t width = static_cast<std::int64_t>(picture.x2) - picture.x1;
    const std::int64_t height = static_cast<std::int64_t>(picture.y2) - picture.y1;
    // Divides, since the product could overflow: either may be as large as 2^32.
    if (width <= 0 || height <= (kLatticePays - 1) / width) return Interpolation::kNever;
    const auto says = [&](const char* name) {
        return render_arguments.get_int(name).value_or(0) != 0;
    };
    return says(kOfxImageEffectPropInteractiveRenderStatus) ||
                   says(kOfxImageEffectPropRenderQualityDraft)
               ? Interpolation::kWithoutConversion
               : Interpolation::kNever;
}

std::string words_of(const Lattice& lattice) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(2);
    text << "lattice, largest error measured " << lattice.largest_error() << " (limit "
         << Lattice::kTolerance << ")";
    return text.str();
}

}  // namespace palette4d::node
