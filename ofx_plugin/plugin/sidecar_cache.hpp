// Parsed sidecars, shared by every instance and thread of the process, and the prepared palettes of
// the frames last rendered from each. Sees the core only, not OpenFX.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "palette4d/recolour.hpp"
#include "palette4d/sidecar.hpp"

namespace palette4d::plugin {

/// One version of one sidecar file, immutable but for its cache of prepared frames.
class LoadedSidecar {
public:
    explicit LoadedSidecar(Sidecar sidecar);

    const Sidecar& sidecar() const { return sidecar_; }
    /// The prepared palette at a sidecar frame (finite; clamped to the clip). Threads that ask for
    /// the same frame share one, built once. Throws what slicing throws.
    std::shared_ptr<const Recolourer> recolourer_at(double frame);

private:
    struct Prepared {
        std::mutex building;
        std::shared_ptr<const Recolourer> recolourer;
    };
    const Sidecar sidecar_;
    std::mutex mutex_;
    std::map<double, std::shared_ptr<Prepared>> frames_;
    std::list<double> recent_;  ///< keys of frames_, latest first
};

/// Either a sidecar or the sentence that says why there is none.
struct SidecarResult {
    std::shared_ptr<LoadedSidecar> loaded;
    std::string problem;
};

/// The sidecar at a UTF-8 path, read when it is new or has changed on disk (time or size; for a
/// file written within the last seconds its content, since a clock tick may hide a second write).
/// Unusable files give a problem, never an exception but std::bad_alloc.
SidecarResult load_sidecar(const std::string& path);

/// Forgets everything that nobody uses at the moment.
void purge_sidecars();

}  // namespace palette4d::plugin
