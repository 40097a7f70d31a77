#include "mode.hpp"

#include <locale>
#include <sstream>

namespace palette4d::plugin {

void define_mode_param(ParamDefiner& define) {
    define.choice({kParamMode, "Mode",
                   "Exact: every colour is worked out by itself. Lattice: colours are interpolated "
                   "where that is as good as exact, which is several times as fast. Auto: the "
                   "lattice where the host says that it renders for somebody who watches, or a "
                   "draft; exact for all else, such as a final render."},
                  {"Auto", "Exact", "Lattice"});
}

Mode mode_at(const Params& params, OfxTime time) {
    const int mode = params.int_at(kParamMode, time).value_or(0);
    return mode == 1 ? Mode::kExact : mode == 2 ? Mode::kLattice : Mode::kAuto;
}

bool interpolates(Mode mode, const Properties& render_arguments) {
    if (mode != Mode::kAuto) return mode == Mode::kLattice;
    const auto says = [&](const char* name) {
        return render_arguments.get_int(name).value_or(0) != 0;
    };
    return says(kOfxImageEffectPropInteractiveRenderStatus) ||
           says(kOfxImageEffectPropRenderQualityDraft);
}

std::string words_of(const Lattice& lattice) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(2);
    text << "lattice, largest error measured " << lattice.largest_error() << " (at most "
         << Lattice::kTolerance << " is wanted)";
    return text.str();
}

}  // namespace palette4d::plugin
