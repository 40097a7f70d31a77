"""Moves of the structure search that remove a whole colour, and the insertion of stops.

A chain is a colour from its beginning to its end: the vertices between the clip's ends, or between
a split and a merge, each with at most one neighbour on either side in time. `without` of a polytope
removes one vertex, `without_chain` a whole chain. Every section keeps a closed mesh: the chain's
track is contracted into a neighbouring one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import hull_volume, mesh_volume
from palette4d.analysis.objective import LEAST_GAP
from palette4d.analysis.polytope import LEAST_COLOURS, Section, SkewPolytope

I32 = NDArray[np.int32]

# Number of times in a section at which candidate meshes are compared.
COMPARED = 5


def chains(polytope: SkewPolytope) -> list[tuple[int, ...]]:
    """Return the removable chains: without one, every section keeps enough colours."""
    before, after = polytope.neighbours()

    def inner(v: int) -> bool:
        return len(before[v]) <= 1 and len(after[v]) <= 1

    candidates = []
    for v in range(len(polytope.vertices)):
        # A chain begins with the clip or behind a splitting vertex.
        if not inner(v) or any(inner(u) for u in before[v]):
            continue
        if before[v] and len(after[before[v][0]]) < 2:
            continue  # behind a merging vertex, which would have no way on
        chain = [v]
        while after[chain[-1]] and inner(after[chain[-1]][0]):
            chain.append(after[chain[-1]][0])
        end = after[chain[-1]]
        if not end or len(before[end[0]]) > 1:
            candidates.append(tuple(chain))
    needed = {
        v
        for section in (*polytope.blocks, *polytope.transitions)
        if len(section.tracks) <= LEAST_COLOURS
        for track in section.tracks
        for v in track
    }
    return [chain for chain in candidates if needed.isdisjoint(chain)]


def without_chain(
    polytope: SkewPolytope, chain: tuple[int, ...], any_mesh: bool = False
) -> SkewPolytope:
    """Return the polytope without a chain of `chains`.

    With `any_mesh`, sections get the first valid mesh, for losses that do not depend on it.
    """
    gone = set(chain)
    place = np.cumsum([v not in gone for v in range(len(polytope.vertices))]) - 1

    def rest(section: Section) -> Section:
        faces, tracks = section.faces, list(section.tracks)
        index = next((i for i, track in enumerate(tracks) if not gone.isdisjoint(track)), None)
        if index is not None:
            del tracks[index]
            if len(faces) and any_mesh:
                faces = next(_contracted(faces, index))
            elif len(faces):
                faces = _least_concave(polytope, Section(section.first, section.last, tuple(tracks),
                                                         faces), index)  # fmt: skip
        renamed = tuple(tuple(int(place[v]) for v in track) for track in tracks)
        return Section(section.first, section.last, renamed, faces)

    return SkewPolytope(
        np.delete(polytope.vertices, list(chain), axis=0),
        tuple(rest(b) for b in polytope.blocks),
        tuple(rest(t) for t in polytope.transitions),
    )


def enriched(polytope: SkewPolytope) -> SkewPolytope:
    """Return the polytope with a stop in the middle of every edge, except the shortest."""
    for u, v in polytope.edges().tolist():
        start, end = polytope.vertices[[u, v]]
        stop = (start + end) / 2
        inside = any(block.first < stop[3] < block.last for block in polytope.blocks)
        if end[3] - start[3] > 4 * LEAST_GAP and inside:
            polytope = polytope.with_stop((u, v), stop.tolist())
    return polytope


def _least_concave(polytope: SkewPolytope, section: Section, gone: int) -> I32:
    """Return the least concave mesh of a section's remaining tracks."""
    times = np.linspace(section.first, section.last, COMPARED)
    colours = [polytope.colours_at(section, t) for t in times]
    solid = [(rgb, volume) for rgb in colours if (volume := hull_volume(rgb)) > 0]
    meshes = list(_contracted(section.faces, gone))
    return max(meshes, key=lambda mesh: sum(mesh_volume(rgb, mesh) / v for rgb, v in solid))


def _contracted(faces: I32, gone: int) -> Iterator[I32]:
    """Yield the meshes without the corner `gone`, contracted into each of its neighbours."""
    touches: dict[int, set[int]] = {}
    for face in faces.tolist():
        for v in face:
            touches.setdefault(v, set()).update(face)
    ring = touches[gone] - {gone}
    for target in sorted(ring):
        if len(touches[target] & ring - {target}) != 2:
            continue  # the mesh would fold onto itself
        kept = faces[~((faces == gone).any(axis=1) & (faces == target).any(axis=1))]
        kept = np.where(kept == gone, target, kept)
        yield (kept - (kept > gone)).astype(np.int32)
