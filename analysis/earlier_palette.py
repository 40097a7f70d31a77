"""The palette of an earlier version of a clip, which moves to the colours of the new one.

A new search may end at other handles although only the grain of the clip has changed: palettes of
nearly the same price change places. A moved palette keeps its colours and stops. Input: a sidecar
document. Output: its `SkewPolytope`, at the times of the new version.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from palette4d.analysis.polytope import Section, SkewPolytope

from palette4d.common.errors import Palette4dError
from palette4d.media.clip_base import Clip, describe

# A palette fits worse if L' is so many times that of its own clip.
WORSE = 1.25


def read(document: Mapping[str, Any], clip: Clip) -> SkewPolytope:
    """Return the palette of a sidecar document, at the times of a clip of the same length.

    Raises
    ------
    Palette4dError
        When the clip has another length, or its palette would have another encoding.
    """
    old = document["clip"]
    name, first, last = old["name"], old["frames"]["first"], old["frames"]["last"]
    if last - first != clip.frames[-1] - clip.frames[0]:
        raise Palette4dError(
            f"like=…: the palette of {name} covers the frames {first}-{last}, and the clip has "
            f"{describe(clip.frames)}; expected as many. Leave out like=…, and copy the grade to "
            "the new palette"
        )
    if clip.encoding != old["encoding"] and "unknown" not in (clip.encoding, old["encoding"]):
        raise Palette4dError(
            f"like=…: the palette of {name} is in {old['encoding']}, and this one would be in "
            f"{clip.encoding}; expected the same: give the colour spaces of the earlier analysis, "
            "or none if it had none"
        )
    return _polytope(document["polytope"]).later(clip.frames[0] - first)


def _polytope(fields: Mapping[str, Any]) -> SkewPolytope:
    """Return the polytope of a sidecar's "polytope"; the inverse of `fields_of`."""
    place = {vertex["id"]: at for at, vertex in enumerate(fields["vertices"])}

    def section(of: Mapping[str, Any], first: float, last: float) -> Section:
        tracks = tuple(tuple(place[one] for one in track) for track in of["tracks"])
        return Section(first, last, tracks, np.array(of["faces"], np.int32).reshape(-1, 3))

    blocks = tuple(section(b, float(b["first"]), float(b["last"])) for b in fields["blocks"])
    between = zip(fields["transitions"], blocks, blocks[1:], strict=False)
    return SkewPolytope(
        np.array([[*v["rgb"], v["frame"]] for v in fields["vertices"]], float),
        blocks,
        tuple(section(of, before.last, after.first) for of, before, after in between),
    )


def fields_of(polytope: SkewPolytope, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sidecar's "polytope" of a moved palette, with the ids of the document's."""
    old, fields = document["polytope"], polytope.fields(by_time=False)
    pairs = zip(fields["vertices"], old["vertices"], strict=True)
    ids = {new["id"]: vertex["id"] for new, vertex in pairs}

    def named(sections: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return [{**s, "tracks": [[ids[v] for v in t] for t in s["tracks"]]} for s in sections]

    return {
        "vertices": [{**v, "id": ids[v["id"]]} for v in fields["vertices"]],
        "edges": [{name: edge[name] for name in ("id", "from", "to")} for edge in old["edges"]],
        "blocks": named(fields["blocks"]),
        "transitions": named(fields["transitions"]),
    }


def fit(document: Mapping[str, Any], new: Mapping[str, Any], loss: float) -> list[str]:
    """Return notes if the palette of a document fits a new version, with the `loss` L', worse.

    `new` is the document of the new version.
    """
    notes = []
    before, after = (
        d["clip"].get("conversion", {}).get("input_space", "the palette's space")
        for d in (document, new)
    )
    if before != after:
        notes.append(f"this version is read as {after}, the earlier one was as {before}")
    options, now = (d.get("quality", {}).get("options", {}) for d in (document, new))
    stages = document.get("quality", {}).get("stages") or [{}]
    own = stages[-1].get("L_prime")  # other programs need not write it
    same = all(options.get(name) == now.get(name) for name in ("lambda", "k", "gamma"))
    if same and isinstance(own, float) and loss > WORSE * own:
        notes.append(
            f"the earlier palette fits this version worse (L_prime {loss:.3f}) than its own "
            f"({own:.3f}); leave out like=… to find a new one"
        )
    return notes
