// The member "polytope": vertices, edges, blocks and transitions.
#include <cstddef>
#include <cstdint>
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
        const auto found = vertices.find(where.id());
        return known(where, found == vertices.end() ? -1 : found->second, "vertex",
                     std::to_string(vertices.size()) + " vertices");
    }
};

void read_topology(const Cursor& where, const Ids& ids, Section& section) {
    const Cursor tracks = where.member("tracks");
    for (std::size_t i = 0, n = tracks.list("tracks"); i < n; ++i) {
        const Cursor track = tracks.element(i);
        auto& vertices = section.tracks.emplace_back();
        for (std::size_t j = 0, m = track.list("vertex ids"); j < m; ++j) {
            vertices.push_back(ids.vertex(track.element(j)));
        }
    }
    const Cursor faces = where.member("faces");
    for (std::size_t i = 0, n = faces.list("faces"); i < n; ++i) {
        const Cursor face = faces.element(i);
        if (face.list("3 track indices") != 3) face.wrong("a list of 3 track indices");
        Face corners{};
        for (std::size_t j = 0; j < 3; ++j) {
            const auto most = static_cast<std::int64_t>(section.tracks.size()) - 1;
            const Cursor corner = face.element(j);
            if (most < 0) corner.wrong("no faces without tracks");
            corners[j] = static_cast<int>(corner.integer(0, most));
        }
        section.faces.push_back(corners);
    }
}

}  // namespace

int known(const Cursor& where, int index, const char* kind, const std::string& all) {
    if (index < 0) {
        where.fail("the unknown " + std::string(kind) + ' ' + in_quotes(where.id()),
                   "the id of one of the polytope's " + all);
    }
    return index;
}

void claim(std::set<std::string>& taken, const Cursor& where, const std::string& id) {
    if (!taken.insert(id).second) {
        where.fail("the id " + in_quotes(id) + " a second time", "an id of its own");
    }
}

Polytope read_polytope(const Cursor& where, const ClipInfo& clip, const std::string& file) {
    Ids ids;
    where.require_members({"vertices", "edges", "blocks", "transitions"});

    std::vector<Vertex> vertices;
    const Cursor vertex_list = where.member("vertices");
    for (std::size_t i = 0, n = vertex_list.list("vertices"); i < n; ++i) {
        const Cursor entry = vertex_list.element(i);
        entry.require_members({"id", "frame", "rgb"}, {"name"});
        const Cursor id = entry.member("id");
        Vertex vertex{id.id(), entry.member("rgb").rgb(), entry.member("frame").frame()};
        if (entry.has("name")) vertex.name = entry.member("name").name();
        claim(ids.taken, id, vertex.id);
        ids.vertices.emplace(vertex.id, static_cast<int>(i));
        vertices.push_back(std::move(vertex));
    }

    std::vector<Edge> edges;
    const Cursor edge_list = where.member("edges");
    for (std::size_t i = 0, n = edge_list.list("edges"); i < n; ++i) {
        const Cursor entry = edge_list.element(i);
        entry.require_members({"id", "from", "to"});
        const Cursor id = entry.member("id");
        Edge edge{id.id(), ids.vertex(entry.member("from")), ids.vertex(entry.member("to"))};
        claim(ids.taken, id, edge.id);
        edges.push_back(std::move(edge));
    }

    const Cursor blocks = where.member("blocks");
    const Cursor transitions = where.member("transitions");
    const std::size_t block_count = blocks.list("blocks");
    if (block_count == 0) blocks.wrong("at least one block");
    if (transitions.list("transitions") != block_count - 1) {
        transitions.wrong("a list of " + std::to_string(block_count - 1) +
                          ", one transition between each two blocks");
    }
    std::vector<Section> sections;
    for (std::size_t i = 0; i < block_count; ++i) {
        const Cursor block = blocks.element(i);
        block.require_members({"first", "last", "tracks", "faces"});
        Section section{block.member("first").frame(), block.member("last").frame(), false, {}, {}};
        if (i == 0 && section.first != static_cast<double>(clip.first)) {
            block.member("first").wrong("the clip's first frame " + std::to_string(clip.first));
        }
        if (i + 1 == block_count && section.last != static_cast<double>(clip.last)) {
            block.member("last").wrong("the clip's last frame " + std::to_string(clip.last));
        }
        read_topology(block, ids, section);
        sections.push_back(std::move(section));
        if (i + 1 == block_count) break;
        const Cursor transition = transitions.element(i);
        transition.require_members({"tracks", "faces"});
        // A transition has no frames of its own: it fills the time between its two blocks.
        const Cursor next = blocks.element(i + 1);
        next.require_members({"first", "last", "tracks", "faces"});
        Section between{sections.back().last, next.member("first").frame(), true, {}, {}};
        read_topology(transition, ids, between);
        sections.push_back(std::move(between));
    }

    try {
        return Polytope(std::move(vertices), std::move(edges), std::move(sections));
    } catch (const SidecarError& problem) {
        throw SidecarError(file, "/polytope" + problem.pointer(), problem.found(),
                           problem.expected());
    }
}

}  // namespace palette4d
