#include <algorithm>
#include <set>
#include <utility>

#include "model/polytope.hpp"
#include "model/sidecar_error.hpp"

namespace palette4d {
namespace {

[[noreturn]] void fail(const std::string& pointer, const std::string& found,
                       const std::string& expected) {
    throw SidecarError("", pointer, found, expected);
}

std::string text(double number) { return decimal_text(number); }
std::string text(std::size_t count) { return std::to_string(count); }

/// Checks one section, and names its parts in error messages.
class SectionCheck {
public:
    SectionCheck(const Polytope& polytope, std::size_t index)
        : polytope_(polytope),
          section_(polytope.sections()[index]),
          place_((section_.transition ? "/transitions/" : "/blocks/") + text(index / 2)) {}

    const std::string& place() const { return place_; }
    std::size_t track_count() const { return section_.tracks.size(); }
    std::string track_place(std::size_t track) const { return place_ + "/tracks/" + text(track); }

    void tracks() const {
        const auto& tracks = section_.tracks;
        for (std::size_t i = 0; i < tracks.size(); ++i) track(i);
        std::set<std::vector<int>> seen;
        for (std::size_t i = 0; i < tracks.size(); ++i) {
            if (!seen.insert(tracks[i]).second) {
                fail(track_place(i), "the same track a second time", "each track once");
            }
        }
    }

    void faces() const {
        const std::size_t tracks = section_.tracks.size();
        const auto& faces = section_.faces;
        if (tracks < 3) {
            if (!faces.empty()) {
                fail(place_ + "/faces", text(faces.size()) + " faces",
                     "no faces in a palette of " + text(tracks) +
                         (tracks == 1 ? " colour" : " colours"));
            }
            return;
        }
        closed_surface(static_cast<int>(tracks));
        sphere(static_cast<int>(tracks));
    }

    /// Where track i crosses a boundary of the section: at a vertex (its index twice) or on an
    /// edge.
    std::pair<int, int> passage(std::size_t i, double frame) const {
        const auto& track = section_.tracks[i];
        const auto after =
            std::upper_bound(track.begin(), track.end(), frame,
                             [this](double t, int vertex) { return t < frame_of(vertex); });
        const int before = *(after - 1);  // exists: the track covers the section
        if (frame_of(before) == frame) return {before, before};
        return {before, *after};
    }

private:
    double frame_of(int vertex) const { return polytope_.vertices()[vertex].frame; }

    void track(std::size_t i) const {
        const auto& track = section_.tracks[i];
        const std::string place = track_place(i);
        for (std::size_t j = 1; j < track.size(); ++j) {
            if (polytope_.find_edge(track[j - 1], track[j]) < 0) {
                const auto& vertices = polytope_.vertices();
                fail(place + "/" + text(j),
                     "no edge from \"" + vertices[track[j - 1]].id + "\" to \"" +
                         vertices[track[j]].id + '"',
                     "an edge between each two vertices of a track, forwards in time");
            }
        }
        const double begins = frame_of(track.front()), ends = frame_of(track.back());
        if (begins > section_.first || ends < section_.last) {
            fail(place, "a track from frame " + text(begins) + " to " + text(ends),
                 "a track that covers " + text(section_.first) + " to " + text(section_.last));
        }
        if (section_.transition && track.size() != 2) {
            fail(place, "a track of " + text(track.size()) + " vertices",
                 "exactly one edge through a transition");
        }
    }

    /// Checks that indices are in range, and each directed edge occurs once, with its opposite.
    void closed_surface(int tracks) const {
        const auto& faces = section_.faces;
        std::set<std::pair<int, int>> directed;
        for (std::size_t f = 0; f < faces.size(); ++f) {
            const Face& face = faces[f];
            for (std::size_t k = 0; k < 3; ++k) {
                if (face[k] < 0 || face[k] >= tracks) {
                    fail(face_place(f) + "/" + text(k), "track index " + std::to_string(face[k]),
                         "an index below " + std::to_string(tracks));
                }
            }
            if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
                fail(face_place(f), "a corner twice", "three different tracks");
            }
            for (std::size_t k = 0; k < 3; ++k) {
                if (!directed.insert({face[k], face[(k + 1) % 3]}).second) {
                    fail(face_place(f),
                         "the side " + side(face[k], face[(k + 1) % 3]) + " a second time",
                         "each side once in each direction (faces anticlockwise from outside)");
                }
            }
        }
        for (std::size_t f = 0; f < faces.size(); ++f) {
            for (std::size_t k = 0; k < 3; ++k) {
                if (directed.count({faces[f][(k + 1) % 3], faces[f][k]}) == 0) {
                    fail(face_place(f),
                         "no neighbour across the side " + side(faces[f][k], faces[f][(k + 1) % 3]),
                         "a closed surface");
                }
            }
        }
    }

    /// Checks for a sphere: every track is used and has one ring of faces (no pinched vertices),
    /// all faces connect, and vertices - edges + faces = 2. Needs a closed surface.
    void sphere(int tracks) const {
        const auto& faces = section_.faces;
        std::vector<std::vector<std::pair<int, int>>> around(static_cast<std::size_t>(tracks));
        for (const Face& face : faces) {
            for (std::size_t k = 0; k < 3; ++k) {
                around[face[k]].push_back({face[(k + 1) % 3], face[(k + 2) % 3]});
            }
        }
        for (int track = 0; track < tracks; ++track) {
            auto& ring = around[track];
            if (ring.empty()) {
                fail(track_place(static_cast<std::size_t>(track)), "a track without faces",
                     "every track in at least one face");
            }
            std::sort(ring.begin(), ring.end());
            std::size_t steps = 0;
            int at = ring.front().first;
            do {
                at = std::lower_bound(ring.begin(), ring.end(), std::make_pair(at, -1))->second;
                ++steps;
            } while (at != ring.front().first && steps <= ring.size());
            if (steps != ring.size()) {
                fail(place_ + "/faces",
                     "more than one ring of faces around track " + std::to_string(track),
                     "one ring of faces around each track");
            }
        }
        std::vector<int> pending{0};
        std::vector<bool> reached(static_cast<std::size_t>(tracks), false);
        reached[0] = true;
        int count = 1;
        while (!pending.empty()) {
            const int track = pending.back();
            pending.pop_back();
            for (const auto& [next, unused] : around[track]) {
                if (reached[next]) continue;
                reached[next] = true;
                ++count;
                pending.push_back(next);
            }
        }
        if (count != tracks) {
            fail(place_ + "/faces",
                 "faces in pieces (" + std::to_string(count) + " of " + std::to_string(tracks) +
                     " tracks hang together with track 0)",
                 "one connected surface");
        }
        // A closed mesh has 3 f / 2 edges, so v - e + f = 2 gives f = 2 v - 4.
        const std::size_t expected = 2 * static_cast<std::size_t>(tracks) - 4;
        if (faces.size() != expected) {
            fail(place_ + "/faces", text(faces.size()) + " faces",
                 text(expected) + " faces, a sphere of " + std::to_string(tracks) + " tracks");
        }
    }

    std::string face_place(std::size_t f) const { return place_ + "/faces/" + text(f); }
    static std::string side(int a, int b) { return std::to_string(a) + " to " + std::to_string(b); }

    const Polytope& polytope_;
    const Section& section_;
    std::string place_;
};

/// Tracks must match on both sides of the boundary: every transition track starts (ends) on a track
/// of the block, and every track of the block continues.
void check_continuity(const SectionCheck& block, const SectionCheck& transition, double frame) {
    const auto passages = [&](const SectionCheck& section) {
        std::vector<std::pair<int, int>> all;
        for (std::size_t i = 0; i < section.track_count(); ++i) {
            all.push_back(section.passage(i, frame));
        }
        return all;
    };
    const auto meets = [&](const SectionCheck& section, const SectionCheck& other) {
        const auto theirs = passages(other);
        const std::set<std::pair<int, int>> there(theirs.begin(), theirs.end());
        const auto own = passages(section);
        for (std::size_t i = 0; i < own.size(); ++i) {
            if (there.count(own[i]) != 0) continue;
            fail(section.track_place(i),
                 "a track that meets no track of " + other.place() + " at frame " + text(frame),
                 "the same vertex or edge on both sides of a boundary");
        }
    };
    meets(transition, block);
    meets(block, transition);
}

void check_times(const std::vector<Section>& sections) {
    for (std::size_t i = 0; i < sections.size(); ++i) {
        const Section& section = sections[i];
        if (section.transition && !(section.first < section.last)) {
            fail("/blocks/" + text(i / 2 + 1) + "/first", text(section.last),
                 "a frame after " + text(section.first) + ", the last of the block before");
        }
        if (section.first > section.last) {
            fail("/blocks/" + text(i / 2) + "/last", text(section.last),
                 "a frame at or after the block's first, " + text(section.first));
        }
    }
}

}  // namespace

void validate_edges(const std::vector<Vertex>& vertices, const std::vector<Edge>& edges) {
    std::set<std::pair<int, int>> ends;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const Vertex &from = vertices[edges[i].from], &to = vertices[edges[i].to];
        const std::string place = "/edges/" + text(i);
        if (!(from.frame < to.frame)) {
            fail(place, "an edge from frame " + text(from.frame) + " to frame " + text(to.frame),
                 "an edge forwards in time");
        }
        if (!ends.insert({edges[i].from, edges[i].to}).second) {
            fail(place, "a second edge from \"" + from.id + "\" to \"" + to.id + '"',
                 "at most one edge between two vertices");
        }
    }
}

void validate_sections(const Polytope& polytope) {
    const auto& sections = polytope.sections();
    check_times(sections);
    std::vector<SectionCheck> checks;
    for (std::size_t i = 0; i < sections.size(); ++i) {
        checks.emplace_back(polytope, i);
        checks.back().tracks();
        checks.back().faces();
    }
    for (std::size_t i = 1; i < sections.size(); i += 2) {
        check_continuity(checks[i - 1], checks[i], sections[i].first);
        check_continuity(checks[i + 1], checks[i], sections[i].last);
    }
}

}  // namespace palette4d
