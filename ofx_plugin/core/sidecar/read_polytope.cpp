// The member "polytope": vertices, edges, blocks and transitions.
#include <cstddef>
#include <utility>

#include "model/sidecar_error.hpp"
#include "sidecar/members.hpp"

namespace palette4d {
namespace {

/// The ids of vertices, and all ids, while a polytope is read.
struct Ids {
    std::unordered_map<std::string, int> vertices;
    std::set<std::string> taken;

    int vertex(const Cursor& where) const {
        const auto found = vertices.find(where.text());
        return known(where, found == vertices.end() ? -1 : found->second, "vertex",
                     std::to_string(vertices.size()) + " vertices");
    }
};

void read_topology(const Cursor& where, const Ids& ids, Section& section) {
    const Cursor tracks = where.member("tracks");
    for (std::size_t i = 0; i < tracks.size(); ++i) {
        const Cursor track = tracks.element(i);
        auto& vertices = section.tracks.emplace_back();
        for (std::size_t j = 0; j < track.size(); ++j) {
            vertices.push_back(ids.vertex(track.element(j)));
        }
    }
    for (const Json& face : where.member("faces").json()) {
        const auto corners = face.get<Vec3>();  // 1.0 is an integer, too
        section.faces.push_back({static_cast<int>(corners[0]), static_cast<int>(corners[1]),
                                 static_cast<int>(corners[2])});
    }
}

}  // namespace

int known(const Cursor& where, int index, const char* kind, const std::string& all) {
    if (index < 0) {
        where.fail("the unknown " + std::string(kind) + ' ' + in_quotes(where.text()),
                   "the id of one of the polytope's " + all);
    }
    return index;
}

void claim(std::set<std::string>& taken, const Cursor& id) {
    if (!taken.insert(id.text()).second) {
        id.fail("the " + id.name() + ' ' + in_quotes(id.text()) + " a second time",
                "each " + id.name() + " only once");
    }
}

Polytope read_polytope(const Cursor& where, const ClipInfo& clip) {
    Ids ids;
    std::vector<Vertex> vertices;
    const Cursor vertex_list = where.member("vertices");
    for (std::size_t i = 0; i < vertex_list.size(); ++i) {
        const Cursor entry = vertex_list.element(i), id = entry.member("id");
        vertices.push_back({id.text(), entry.member("rgb").three(), entry.member("frame").number(),
                            entry.json().value("name", "")});
        claim(ids.taken, id);
        ids.vertices.emplace(id.text(), static_cast<int>(i));
    }

    std::vector<Edge> edges;
    const Cursor edge_list = where.member("edges");
    for (std::size_t i = 0; i < edge_list.size(); ++i) {
        const Cursor entry = edge_list.element(i), id = entry.member("id");
        claim(ids.taken, id);
        edges.push_back(
            {id.text(), ids.vertex(entry.member("from")), ids.vertex(entry.member("to"))});
    }

    const Cursor blocks = where.member("blocks"), transitions = where.member("transitions");
    if (transitions.size() != blocks.size() - 1) {
        transitions.wrong("a list of " + std::to_string(blocks.size() - 1) +
                          ", one transition between each two blocks");
    }
    std::vector<Section> sections;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        const Cursor block = blocks.element(i);
        const Cursor first = block.member("first"), last = block.member("last");
        if (i > 0) {  // A transition has no frames of its own: it fills the time between blocks.
            Section between{sections.back().last, first.number(), true, {}, {}};
            read_topology(transitions.element(i - 1), ids, between);
            sections.push_back(std::move(between));
        } else if (first.number() != static_cast<double>(clip.first)) {
            first.wrong("the clip's first frame " + std::to_string(clip.first));
        }
        if (i + 1 == blocks.size() && last.number() != static_cast<double>(clip.last)) {
            last.wrong("the clip's last frame " + std::to_string(clip.last));
        }
        Section section{first.number(), last.number(), false, {}, {}};
        read_topology(block, ids, section);
        sections.push_back(std::move(section));
    }

    try {
        return Polytope(std::move(vertices), std::move(edges), std::move(sections));
    } catch (const SidecarError& problem) {
        where.fail_inside(problem);
    }
}

}  // namespace palette4d
