// Parsed sidecars, shared by every instance and thread of the process, and the prepared palettes of
// the frames last rendered from each. Sees the core only, not OpenFX.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "lattice/lattice.hpp"
#include "model/handles.hpp"
#include "recolour/recolour.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// Which edits apply to a frame: the sidecar's own, and new colours of handles over them.
struct AppliedEdits {
    bool sidecar = true;
    std::vector<HandleColour> host;  ///< finite, by ascending handle, each once
};
bool operator<(const AppliedEdits& a, const AppliedEdits& b);

/// One version of one sidecar file, immutable but for its cache of prepared frames.
class LoadedSidecar {
public:
    /// `revision` tells one content from another.
    LoadedSidecar(Sidecar sidecar, std::string revision);

    const Sidecar& sidecar() const { return sidecar_; }
    const std::string& revision() const { return revision_; }
    /// The prepared palette at a sidecar frame (finite; clamped to the clip). Threads that ask for
    /// the same frame with the same edits share one, built once. Throws what slicing throws, and
    /// std::invalid_argument for a handle that is not there.
    std::shared_ptr<const Recolourer> recolourer_at(double frame, const AppliedEdits& edits = {});
    /// Likewise: the lattice of that. Those that were used last are kept.
    std::shared_ptr<const Lattice> lattice_at(double frame, const AppliedEdits& edits = {});
    /// The same where it is there already; else null.
    std::shared_ptr<const Lattice> ready_lattice_at(double frame, const AppliedEdits& edits = {});
    /// How many lattices are kept: of each frame that a host may render at a time, by whole
    /// pictures or by tiles, one a thread, and a few more. Each takes some ten megabytes.
    static std::size_t most_lattices();
    /// Likewise: it adds the weight of a handle's lineage to the first channel (lineage.hpp).
    std::shared_ptr<const Recolourer> weight_at(double frame, int handle);
    /// Likewise: it adds the closest colour of the palette (lineage.hpp).
    std::shared_ptr<const Recolourer> surface_at(double frame);
    /// The palette's colours at a frame: original and edited.
    std::pair<std::vector<Vec3>, std::vector<Vec3>> palette_at(double frame,
                                                               const AppliedEdits& edits) const;

private:
    /// What a prepared palette is for.
    enum class Purpose { kEdit, kWeight, kSurface };
    using Key = std::tuple<double, Purpose, int, AppliedEdits>;
    struct Prepared {
        std::mutex building;
        std::shared_ptr<const Recolourer> recolourer;
        std::shared_ptr<const Lattice> lattice;
    };
    Key clamped(const Key& key) const;
    std::shared_ptr<Prepared> entry(const Key& key);
    std::shared_ptr<const Recolourer> prepared(const Key& key);
    std::shared_ptr<const Recolourer> prepare(const Key& key) const;

    const Sidecar sidecar_;
    const std::string revision_;
    std::mutex mutex_;
    std::map<Key, std::shared_ptr<Prepared>> frames_;
    std::list<const Key*> recent_;                       ///< keys of frames_, latest first
    std::list<std::shared_ptr<Prepared>> with_lattice_;  ///< latest first
};

/// Either a sidecar or the sentence that says why there is none.
struct SidecarResult {
    std::shared_ptr<LoadedSidecar> loaded;
    std::string problem;
};

/// The sidecar at a UTF-8 path, read when it is new or has changed on disk: another file, size or
/// time of its content or of its directory entry. A file written within the last seconds is
/// compared by content, because a clock tick may hide a second write. Unusable files give a
/// problem, never an exception but std::bad_alloc.
SidecarResult load_sidecar(const std::string& path);

/// The same for text already in memory; `name` stands for the file in problems.
SidecarResult load_sidecar_text(const std::string& text, const std::string& name);
/// Tells one text from another: a hash and the length.
std::string revision_of(const std::string& text);
/// A file's text as it is now; empty when it cannot be read or is larger than a sidecar may be.
std::optional<std::string> sidecar_text(const std::string& path);

/// Forgets everything that nobody uses at the moment.
void purge_sidecars();

}  // namespace palette4d::node
