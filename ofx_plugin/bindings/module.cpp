// palette4d._core: the compiled core for Python. Calls one binder per subject.
#include "binders.hpp"

PYBIND11_MODULE(_core, module) {
    module.doc() =
        "The compiled core: polytope slicing, mean value coordinates, recolouring, the "
        "sidecar reader.";
    module.attr("__version__") = PALETTE4D_VERSION;
    bind_errors(module);
    bind_polytope(module);
    bind_conversion(module);
    bind_picks(module);
    bind_sidecar(module);
    bind_slice(module);
    bind_mvc(module);
    bind_recolour(module);
    bind_output(module);
    bind_gpu(module);
    bind_analysis(module);
    bind_bins(module);
    bind_rgbt(module);
}
