// Parsed sidecars, shared by all instances and threads of the process, and their recently rendered
// frames' palettes. Depends on the core only, not on OpenFX.
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

#include "model/handles.hpp"
#include "recolour/recolour.hpp"
#include "sidecar/sidecar.hpp"

namespace palette4d::node {

/// The edits that apply to a frame: the sidecar's own, overridden by new colours from the host.
struct AppliedEdits {
    bool sidecar = true;
    std::vector<HandleColour> host;  ///< finite, by ascending handle, each once
};
bool operator<(const AppliedEdits& a, const AppliedEdits& b);

/// Most memory of prepared frames, of all sidecars together, that are kept for the next tile or
/// render. The frame that was used last is kept whatever it takes.
constexpr std::size_t kMaxKeptBytes = std::size_t{512} << 20;

/// One version of a sidecar file. Immutable except for its cache of prepared frames.
class LoadedSidecar {
public:
    /// `revision` identifies the content.
    LoadedSidecar(Sidecar sidecar, std::string revision);
    ~LoadedSidecar();
    LoadedSidecar(const LoadedSidecar&) = delete;
    LoadedSidecar& operator=(const LoadedSidecar&) = delete;

    const Sidecar& sidecar() const { return sidecar_; }
    const std::string& revision() const { return revision_; }
    /// The same with a version's edits in place of the active ones; all callers share one. Null for
    /// a name that is not there.
    std::shared_ptr<LoadedSidecar> version(const std::string& name);
    /// The prepared palette at a sidecar frame (finite; clamped to the clip). Threads that ask for
    /// the same frame and edits share one. Throws what slicing throws, and std::invalid_argument
    /// for an unknown handle.
    std::shared_ptr<const Recolourer> recolourer_at(double frame, const AppliedEdits& edits = {});
    /// The same, but it adds the weight of a handle's lineage to the first channel (lineage.hpp).
    std::shared_ptr<const Recolourer> weight_at(double frame, int handle);
    /// The same, but it adds the closest colour of the palette (lineage.hpp).
    std::shared_ptr<const Recolourer> surface_at(double frame);
    /// The same, but it adds a pick's share of its change to all channels; by the pick's index.
    std::shared_ptr<const Recolourer> pick_at(double frame, int pick);
    /// The palette's original and edited colours at a frame.
    std::pair<std::vector<Vec3>, std::vector<Vec3>> palette_at(double frame,
                                                               const AppliedEdits& edits) const;

private:
    friend class RecentFrames;
    /// What a prepared palette is for.
    enum class Purpose { kEdit, kWeight, kSurface, kPick };
    using Key = std::tuple<double, Purpose, int, AppliedEdits>;
    struct Prepared;
    using Frames = std::map<Key, std::shared_ptr<Prepared>>;
    Key clamped(const Key& key) const;
    std::shared_ptr<const Recolourer> prepared(const Key& key);
    std::shared_ptr<const Recolourer> prepare(const Key& key) const;

    const Sidecar sidecar_;
    const std::string revision_;
    const std::shared_ptr<class RecentFrames> recent_;
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<LoadedSidecar>> versions_;  ///< those in use so far
    Frames frames_;                                                   ///< RecentFrames' alone
};

/// A sidecar, or a sentence that says why there is none.
struct SidecarResult {
    std::shared_ptr<LoadedSidecar> loaded;
    std::string problem;
};

/// The sidecar at a UTF-8 path, reloaded when the file's identity, size or times have changed. A
/// file written in the last seconds is compared by content, since one clock tick may hide a second
/// write. Unusable files give a problem; the only exception is std::bad_alloc.
SidecarResult load_sidecar(const std::string& path);

/// The same for text in memory; `name` replaces the file name in problems.
SidecarResult load_sidecar_text(const std::string& text, const std::string& name);
/// Identifies a text by a hash and its length.
std::string revision_of(const std::string& text);
/// A file's current text; empty when it cannot be read or is larger than a sidecar may be.
std::optional<std::string> sidecar_text(const std::string& path);

/// Frees everything that is not in use.
void purge_sidecars();

}  // namespace palette4d::node
