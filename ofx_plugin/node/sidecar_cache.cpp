#include "sidecar_cache.hpp"

#if !defined(_WIN32)
#include <sys/stat.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <thread>
#include <tuple>
#include <utility>

#include "model/lineage.hpp"
#include "model/ramps.hpp"
#include "paths.hpp"
#include "windows.hpp"

namespace palette4d::node {
namespace {

namespace fs = std::filesystem;
using Clock = fs::file_time_type::clock;

/// Prepared frames kept: more than the instances of a project render at a time.
std::size_t most_frames() {
    // Called for every tile, and counting processors is a system call.
    static const std::size_t most =
        std::max<std::size_t>(256, 4 * std::thread::hardware_concurrency());
    return most;
}
constexpr std::size_t kMaxSidecars = 32;
constexpr std::size_t kMaxTexts = 8;
// File times may be as coarse as two seconds (FAT), so newer files may change unnoticed.
constexpr auto kSettled = std::chrono::seconds(3);

/// A file's identity and times; the file is reloaded when any of them changes. Copy tools can
/// preserve a file's time and size, but not the time of its status change.
struct Stamp {
    fs::file_time_type modified{};
    std::uintmax_t bytes = 0;
    std::uintmax_t device = 0, inode = 0;               ///< 0 where the file system has none
    std::int64_t change_seconds = 0, change_nanos = 0;  ///< likewise; since 1970
    bool operator==(const Stamp& other) const {
        const auto all = [](const Stamp& s) {
            return std::tie(s.modified, s.bytes, s.device, s.inode, s.change_seconds,
                            s.change_nanos);
        };
        return all(*this) == all(other);
    }
};

/// Adds what the standard library does not report.
void identify(Stamp& stamp, const fs::path& path) {
#if defined(_WIN32)
    const HANDLE file =
        CreateFileW(path.c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                    nullptr, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (file == INVALID_HANDLE_VALUE) return;
    BY_HANDLE_FILE_INFORMATION about{};
    if (GetFileInformationByHandle(file, &about)) {
        stamp.device = about.dwVolumeSerialNumber;
        stamp.inode = std::uintmax_t{about.nFileIndexHigh} << 32 | about.nFileIndexLow;
    }
    FILE_BASIC_INFO times{};
    if (GetFileInformationByHandleEx(file, FileBasicInfo, &times, sizeof times)) {
        // In units of 100 ns since 1601.
        const std::int64_t changed = times.ChangeTime.QuadPart - 116444736000000000;
        stamp.change_seconds = changed / 10000000;
        stamp.change_nanos = changed % 10000000 * 100;
    }
    CloseHandle(file);
#else
    struct stat about{};
    if (::stat(path.c_str(), &about) != 0) return;
#if defined(__APPLE__)
    const timespec& changed = about.st_ctimespec;
#else
    const timespec& changed = about.st_ctim;
#endif
    stamp.device = static_cast<std::uintmax_t>(about.st_dev);
    stamp.inode = static_cast<std::uintmax_t>(about.st_ino);
    stamp.change_seconds = changed.tv_sec;
    stamp.change_nanos = changed.tv_nsec;
#endif
}

using SteadyClock = std::chrono::steady_clock;

/// The latest load of one path. Its mutex ensures that only one thread loads a new file.
struct Entry {
    std::mutex mutex;
    bool read = false;
    Stamp stamp;
    SteadyClock::time_point stamped{};  ///< when this stamp was first seen
    bool settled = false;  ///< the stamp was old enough to be trusted when the file was read
    std::string text;      ///< kept until settled, to see whether the content really changed
    SidecarResult result;
    std::uint64_t last_use = 0;
};

struct Cache {
    std::mutex mutex;
    std::map<std::string, std::shared_ptr<Entry>> entries;
    std::list<std::pair<std::string, SidecarResult>> texts;  ///< copies from projects
    std::uint64_t uses = 0;
};

Cache& cache() {
    static Cache instance;
    return instance;
}

std::optional<Stamp> stamp_of(const fs::path& path, std::string& problem) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (status.type() == fs::file_type::not_found) {
        problem = "the file does not exist";
        return std::nullopt;
    }
    if (!error && status.type() != fs::file_type::regular) {
        problem = "it is not a file";
        return std::nullopt;
    }
    Stamp stamp;
    if (!error) stamp.modified = fs::last_write_time(path, error);
    if (!error) stamp.bytes = fs::file_size(path, error);
    if (!error) identify(stamp, path);
    if (error) {
        problem = "the file cannot be examined (" + error.message() + ")";
        return std::nullopt;
    }
    if (stamp.bytes > kMaxSidecarBytes) {
        problem = "found " + std::to_string(stamp.bytes) + " bytes, expected at most " +
                  std::to_string(kMaxSidecarBytes);
        return std::nullopt;
    }
    return stamp;
}

/// The file's text, at most one byte longer than the limit, which the parser then refuses.
std::optional<std::string> text_of(const fs::path& path) {
    return bytes_of(path, kMaxSidecarBytes + 1);
}

SidecarResult parse(const std::string& text, const std::string& path) {
    SidecarResult result;
    try {
        result.loaded =
            std::make_shared<LoadedSidecar>(parse_sidecar(text, path), revision_of(text));
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        result.problem = error.what();
    }
    return result;
}

/// Updates an entry from its file; the caller holds its mutex.
void refresh(Entry& entry, const fs::path& path, const std::string& name) {
    std::string problem;
    for (int attempt = 0; attempt < 3; ++attempt) {
        const std::optional<Stamp> before = stamp_of(path, problem);
        if (!before) break;
        const bool same = entry.read && *before == entry.stamp;
        if (same && entry.settled) return;
        // A time may lie in the future: of another clock, or because somebody chose it.
        const bool settled = (Clock::now() - before->modified > kSettled &&
                              std::time(nullptr) - before->change_seconds > kSettled.count()) ||
                             (same && SteadyClock::now() - entry.stamped > kSettled);
        std::optional<std::string> text = text_of(path);
        if (!text) {
            problem = "the file cannot be read";
            break;
        }
        // The file changed while it was read, so the text may mix two versions.
        const std::optional<Stamp> after = stamp_of(path, problem);
        if (!after) break;
        if (!(*after == *before)) {
            if (attempt < 2) continue;
        }
        if (!(entry.read && *text == entry.text && !entry.settled)) {
            entry.result = parse(*text, name);
        }
        if (!entry.read || !(*after == entry.stamp)) entry.stamped = SteadyClock::now();
        entry.read = true;
        entry.stamp = *after;
        entry.settled = settled && *after == *before;
        entry.text = entry.settled ? std::string() : std::move(*text);
        return;
    }
    entry.read = false;
    entry.settled = false;
    entry.text.clear();
    entry.result = {nullptr, name + ": " + problem};
}

Edits all_of(const Sidecar& sidecar, const AppliedEdits& edits) {
    return with_colours(sidecar.polytope, sidecar.edits, edits.sidecar, edits.host);
}

std::shared_ptr<Entry> entry_of(const std::string& key) {
    Cache& all = cache();
    const std::lock_guard<std::mutex> lock(all.mutex);
    std::shared_ptr<Entry>& entry = all.entries[key];
    if (!entry) entry = std::make_shared<Entry>();
    const std::shared_ptr<Entry> wanted = entry;
    wanted->last_use = ++all.uses;
    while (all.entries.size() > kMaxSidecars) {
        auto oldest = all.entries.begin();
        for (auto it = all.entries.begin(); it != all.entries.end(); ++it) {
            if (it->second->last_use < oldest->second->last_use) oldest = it;
        }
        all.entries.erase(oldest);
    }
    return wanted;
}

}  // namespace

/// 64-bit FNV-1a in hexadecimal digits.
std::string revision_of(const std::string& text) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    std::string digits;
    for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[hash >> shift & 15];
    return digits + "-" + std::to_string(text.size());
}

/// A frame of a sidecar, which the threads that want it share.
struct LoadedSidecar::Prepared {
    std::mutex building;
    std::shared_ptr<const Recolourer> recolourer;
    std::list<std::pair<Frames*, Frames::iterator>>::iterator place;  ///< among the recent frames
    std::size_t bytes = 0;                                            ///< 0 until it is prepared
    bool kept = true;
};

/// The prepared frames of all sidecars, whose memory is bounded together.
class RecentFrames {
public:
    using Frame = LoadedSidecar::Prepared;
    using Frames = LoadedSidecar::Frames;

    /// Each sidecar shares it: at the end of a process, or when the node is unloaded, some go late.
    static std::shared_ptr<RecentFrames> of_process() {
        static const auto all = std::make_shared<RecentFrames>();
        return all;
    }

    /// The frame of a sidecar, which is now the one used last.
    std::shared_ptr<Frame> get(Frames& frames, const LoadedSidecar::Key& key) {
        Dropped dropped;
        const std::lock_guard<std::mutex> lock(mutex_);
        auto at = frames.find(key);
        if (at == frames.end()) {
            List place(1);
            at = frames.emplace(key, std::make_shared<Frame>()).first;
            place.front() = {&frames, at};
            at->second->place = place.begin();
            recent_.splice(recent_.begin(), place);
        } else {
            recent_.splice(recent_.begin(), recent_, at->second->place);
        }
        const std::shared_ptr<Frame> found = at->second;
        drop_oldest(dropped);
        return found;
    }

    /// Counts the memory of a frame that has just been prepared.
    void weigh(Frame& frame) {
        Dropped dropped;
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!frame.kept) return;
        frame.bytes = frame.recolourer->bytes();
        bytes_ += frame.bytes;
        drop_oldest(dropped);
    }

    /// Forgets the frames of a sidecar that goes.
    void forget(const Frames& frames) {
        const std::lock_guard<std::mutex> lock(mutex_);
        for (const auto& [key, frame] : frames) {
            bytes_ -= frame->bytes;
            frame->kept = false;
            recent_.erase(frame->place);
        }
    }

private:
    using List = std::list<std::pair<Frames*, Frames::iterator>>;
    /// Freed after the mutex: that may take a while.
    using Dropped = std::vector<std::shared_ptr<Frame>>;

    void drop_oldest(Dropped& dropped) {
        while (recent_.size() > 1 && (recent_.size() > most_frames() || bytes_ > kMaxKeptBytes)) {
            const auto [frames, at] = recent_.back();
            dropped.push_back(at->second);
            bytes_ -= at->second->bytes;
            at->second->kept = false;
            recent_.pop_back();
            frames->erase(at);
        }
    }

    std::mutex mutex_;
    List recent_;  ///< the one used last first
    std::size_t bytes_ = 0;
};

LoadedSidecar::LoadedSidecar(Sidecar sidecar, std::string revision)
    : sidecar_(std::move(sidecar)),
      revision_(std::move(revision)),
      recent_(RecentFrames::of_process()) {}

LoadedSidecar::~LoadedSidecar() { recent_->forget(frames_); }

std::shared_ptr<LoadedSidecar> LoadedSidecar::version(const std::string& name) {
    for (const NamedVersion& one : sidecar_.versions) {
        if (one.name != name) continue;
        const std::lock_guard<std::mutex> lock(mutex_);
        std::shared_ptr<LoadedSidecar>& found = versions_[name];
        if (!found) {
            Sidecar copy = sidecar_;
            copy.edits = one.edits;
            found = std::make_shared<LoadedSidecar>(std::move(copy), revision_);
        }
        return found;
    }
    return nullptr;
}

bool operator<(const AppliedEdits& a, const AppliedEdits& b) {
    if (a.sidecar != b.sidecar) return a.sidecar < b.sidecar;
    return std::lexicographical_compare(a.host.begin(), a.host.end(), b.host.begin(), b.host.end(),
                                        [](const HandleColour& x, const HandleColour& y) {
                                            return x.handle != y.handle ? x.handle < y.handle
                                                                        : x.rgb < y.rgb;
                                        });
}

std::shared_ptr<const Recolourer> LoadedSidecar::recolourer_at(double frame,
                                                               const AppliedEdits& edits) {
    return prepared({frame, Purpose::kEdit, 0, edits});
}

std::shared_ptr<const Recolourer> LoadedSidecar::weight_at(double frame, int handle) {
    return prepared({frame, Purpose::kWeight, handle, {}});
}

std::shared_ptr<const Recolourer> LoadedSidecar::surface_at(double frame) {
    return prepared({frame, Purpose::kSurface, 0, {}});
}

std::shared_ptr<const Recolourer> LoadedSidecar::pick_at(double frame, int pick) {
    return prepared({frame, Purpose::kPick, pick, {}});
}

std::pair<std::vector<Vec3>, std::vector<Vec3>> LoadedSidecar::palette_at(
    double frame, const AppliedEdits& edits) const {
    Slice slice = slice_at(sidecar_.polytope, frame);
    return {slice.rgb, edited_colours(sidecar_.polytope, all_of(sidecar_, edits), slice)};
}

LoadedSidecar::Key LoadedSidecar::clamped(const Key& wanted) const {
    Key key = wanted;
    double& frame = std::get<double>(key);
    // All times before the clip show its first frame, all times after it the last.
    const Polytope& polytope = sidecar_.polytope;
    if (frame < polytope.first_frame()) frame = polytope.first_frame();
    if (frame > polytope.last_frame()) frame = polytope.last_frame();
    return key;
}

std::shared_ptr<const Recolourer> LoadedSidecar::prepared(const Key& wanted) {
    const Key key = clamped(wanted);
    const std::shared_ptr<Prepared> prepared = recent_->get(frames_, key);
    // Only threads that want this frame wait for it.
    const std::lock_guard<std::mutex> lock(prepared->building);
    if (!prepared->recolourer) {
        prepared->recolourer = prepare(key);
        recent_->weigh(*prepared);
    }
    return prepared->recolourer;
}

std::shared_ptr<const Recolourer> LoadedSidecar::prepare(const Key& key) const {
    const auto& [frame, purpose, handle, edits] = key;
    Slice slice = slice_at(sidecar_.polytope, frame);
    std::vector<Vec3> edited;
    FramePicks picks;
    switch (purpose) {
        case Purpose::kEdit: {
            const Edits all = all_of(sidecar_, edits);
            edited = edited_colours(sidecar_.polytope, all, slice);
            picks = picks_at(all, slice.frame);
            break;
        }
        case Purpose::kWeight:
            edited = weight_reader(slice, Lineage(sidecar_.polytope, sidecar_.edits, handle));
            break;
        case Purpose::kSurface:
            edited = surface_reader(slice);
            break;
        case Purpose::kPick:
            edited = slice.rgb;
            picks =
                matte_at(sidecar_.edits, sidecar_.edits.picks[static_cast<std::size_t>(handle)].id,
                         slice.frame);
            break;
    }
    return std::make_shared<const Recolourer>(std::move(slice.rgb), edited, std::move(slice.faces),
                                              std::move(picks));
}

SidecarResult load_sidecar(const std::string& path) {
    try {
        const fs::path given = reachable(native(path));
        std::error_code error;
        fs::path canonical = fs::weakly_canonical(given, error);
        if (error) canonical = given;
        const std::shared_ptr<Entry> entry = entry_of(canonical.u8string());
        const std::lock_guard<std::mutex> lock(entry->mutex);
        refresh(*entry, reachable(canonical), path);
        return entry->result;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        return {nullptr, path + ": " + error.what()};
    }
}

SidecarResult load_sidecar_text(const std::string& text, const std::string& name) {
    Cache& all = cache();
    {
        const std::lock_guard<std::mutex> lock(all.mutex);
        for (const auto& [known, result] : all.texts) {
            if (known == text) return result;
        }
    }
    const SidecarResult result = parse(text, name);
    const std::lock_guard<std::mutex> lock(all.mutex);
    for (const auto& [known, other] : all.texts) {
        if (known == text) return other;  // another thread was faster: share its result
    }
    all.texts.emplace_front(text, result);
    if (all.texts.size() > kMaxTexts) all.texts.pop_back();
    return result;
}

std::optional<std::string> sidecar_text(const std::string& path) {
    std::string problem;
    const fs::path file = reachable(native(path));
    return stamp_of(file, problem) ? text_of(file) : std::nullopt;
}

void purge_sidecars() {
    Cache& all = cache();
    std::map<std::string, std::shared_ptr<Entry>> dropped;
    std::list<std::pair<std::string, SidecarResult>> texts;
    const std::lock_guard<std::mutex> lock(all.mutex);
    dropped.swap(all.entries);
    texts.swap(all.texts);
}

}  // namespace palette4d::node
