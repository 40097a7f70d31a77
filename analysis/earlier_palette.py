"""The palette of an earlier version of a clip, which moves to the colours of the new one.

A new search may find other handles although only the grain of the clip has changed: palettes of
nearly the same price change places in the ranking. A moved palette keeps its colours and stops.
Input: a sidecar document. Output: its `SkewPolytope`, at the times of the new version.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from palette4d.analysis.polytope import Section, SkewPolytope

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.clip_base import Clip, describe

# Factor of L', against its value on the palette's own clip, above which a note reports a worse fit.
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
            f"{Arg('like')}: the palette of {name} covers the frames {first}-{last}, and the clip "
            f"has {describe(clip.frames)}; expected as many. Leave out {Arg('like')}, and copy the "
            "grade to the new palette"
        )
    if clip.encoding != old["encoding"] and "unknown" not in (clip.encoding, old["encoding"]):
        raise Palette4dError(
            f"{Arg('like')}: the palette of {name} is in {old['encoding']}, and this one would be "
            f"in {clip.encoding}; expected the same: give the colour spaces of the earlier "
            "analysis, or none if it had none"
        )
    return _polytope(document["polytope"]).later(clip.frames[0] - first)


def _polytope(fields: Mapping[str, Any]) -> SkewPolytope:
    """Return the polytope of a sidecar's "polytope"; the inverse of `fields_of`."""
    place = {vertex["id"]: index for index, vertex in enumerate(fields["vertices"])}

    def section(fields_of_section: Mapping[str, Any], first: float, last: float) -> Section:
        tracks = tuple(
            tuple(place[vertex] for vertex in track) for track in fields_of_section["tracks"]
        )
        return Section(
            first, last, tracks, np.array(fields_of_section["faces"], np.int32).reshape(-1, 3)
        )

    blocks = tuple(section(b, float(b["first"]), float(b["last"])) for b in fields["blocks"])
    between = zip(fields["transitions"], blocks, blocks[1:], strict=False)
    return SkewPolytope(
        np.array([[*v["rgb"], v["frame"]] for v in fields["vertices"]], float),
        blocks,
        tuple(
            section(fields_of_section, before.last, after.first)
            for fields_of_section, before, after in between
        ),
    )


def fields_of(polytope: SkewPolytope, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sidecar's "polytope" of a moved palette, with the ids of the document's."""
    old = document["polytope"]
    edges = [{name: edge[name] for name in ("id", "from", "to")} for edge in old["edges"]]
    return {**polytope.fields([vertex["id"] for vertex in old["vertices"]]), "edges": edges}


def fit(document: Mapping[str, Any], loss: float) -> list[str]:
    """Return a note if L' of a moved palette, `loss`, is much more than with its own clip."""
    stages = document.get("quality", {}).get("stages") or [{}]
    own = stages[-1].get("L_prime")  # other programs need not write it
    if not isinstance(own, float) or loss <= WORSE * own:
        return []
    return [
        f"the earlier palette fits this version worse (L_prime {loss:.3f}) than its own "
        f"({own:.3f}); leave out {Arg('like')} to find a new one"
    ]
