"""What the inspector shows, and the edits that give it another colour.

It knows no toolkit. A target is a handle, an edge at the playhead, a pick, or a pixel that is not
picked yet. Each edit is that of a verb: `edit set`, `track`, `palette`, `pick` or `change`.
"""

import contextlib
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palette4d.colour.oklch import Adjustment
from palette4d.grade.document import Document
from palette4d.grade.edits import Change, Edit, as_colour, new_id
from palette4d.grade.picks import Pick
from palette4d.studio.states import Place

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Target:
    """What is inspected.

    Attributes
    ----------
    id : str
        A vertex, a stop, or an edge at the playhead.
    kind : str
        "vertex", "stop" or "edge"; "pick" or "hold"; "place" is a pixel that is not picked yet.
    frame : float
        Where the colour is.
    before, after : (3,) float64
        The colour as analysed or in the clip, and as edited, in the palette's code values.
    place : Place or None
        The pixel.
    """

    id: str
    kind: Literal["vertex", "stop", "edge", "pick", "hold", "place"]
    frame: float
    before: F64
    after: F64
    place: Place | None = None

    @property
    def picked(self) -> bool:
        """Whether it is a colour of the clip, not of the palette."""
        return self.kind in ("pick", "hold", "place")


def target_of(document: Document, id_: str, frame: float) -> Target | None:
    """Return a selected handle or palette colour; None if it is not there at the playhead."""
    polytope = document.grade.core.polytope
    if id_ in polytope.vertex_ids:
        at = float(np.asarray(polytope.vertices)[polytope.vertex_ids.index(id_), 3])
        return _in_palette(document, id_, "vertex", id_, at)
    for pick in document.grade.picks:
        if pick.id == id_:
            before = np.asarray(pick.rgb)
            after = before if pick.to is None else np.asarray(pick.to)
            return Target(id_, pick.kind, pick.frame, before, after)
    setting = document.grade.settings.get(id_)
    if setting is not None and setting.edge is not None and setting.frame is not None:
        return _in_palette(document, id_, "stop", setting.edge, setting.frame)
    if id_ in polytope.edge_ids:
        found = _in_palette(document, id_, "edge", id_, frame)
        if found is not None:
            return found
        # At its ends an edge is its vertex.
        start, end = np.asarray(polytope.edges)[polytope.edge_ids.index(id_)]
        for vertex in (start, end):
            if float(np.asarray(polytope.vertices)[vertex, 3]) == frame:
                return target_of(document, polytope.vertex_ids[vertex], frame)
    return None


def _in_palette(
    document: Document,
    id_: str,
    kind: Literal["vertex", "stop", "edge"],
    place: str,
    frame: float,
) -> Target | None:
    palette = document.grade.palette(frame)
    if place not in palette.ids:
        return None
    index = palette.ids.index(place)
    return Target(id_, kind, frame, palette.rgb[index], palette.edited[index])


@dataclass(frozen=True)
class Recolour:
    """The edit that gives a colour to a handle, and the same offset to others, as one step.

    Attributes
    ----------
    target : Target
        The inspected colour, before the edit.
    ids : tuple of str
        All selected handles.
    playhead : float
        The time at which selected edges move.
    rgb : tuple of float
        The new colour.
    """

    target: Target
    ids: tuple[str, ...]
    playhead: float
    rgb: tuple[float, ...]

    def __call__(self, document: Document) -> None:
        """Do it."""
        first = target_of(document, self.target.id, self.target.frame)
        if first is None:
            return
        by = np.asarray(self.rgb) - first.after
        many: contextlib.AbstractContextManager[None] = contextlib.nullcontext()
        if len(self.ids) > 1:
            many = document.one_step(f"set {' '.join(self.ids)}")
        done = set[str]()
        with many:
            for id_ in self.ids or (self.target.id,):
                target = target_of(document, id_, self.playhead)
                if target is None or target.id in done:  # at its end a row is its vertex
                    continue
                done.add(target.id)
                own = target.id == self.target.id
                new = self.rgb if own else (target.after + by).tolist()
                if target.kind == "edge":
                    old, at = target.after.tolist(), target.frame
                    document.set_near(old, frame=at, id=target.id, rgb=new, any_value=True)
                else:
                    document.set(target.id, rgb=new, any_value=True)


@dataclass(frozen=True)
class PickTo:
    """The edit that gives a colour of the clip a new colour, while it is dragged.

    Attributes
    ----------
    target : Target
        A pick, or a pixel.
    rgb : tuple of float
        Its new colour.
    draft : Pick or None
        The pick of the pixel, with its matte; None while that is being learned.
    """

    target: Target
    rgb: tuple[float, ...]
    draft: Pick | None = None

    def __call__(self, document: Document) -> None:
        """Do it; a new pick is not followed yet, and nothing is learned."""
        target, draft = self.target, self.draft
        if target.kind == "pick":
            document.change_pick(target.id, to=self.rgb, any_value=True)
        elif target.kind == "place" and draft is not None:
            id_ = new_id("p", (pick.id for pick in document.grade.picks))
            made = replace(draft, id=id_, to=as_colour(self.rgb))
            document.apply(Edit((Change("pick", id_, None, made),), ""))


@dataclass(frozen=True)
class RecolourMany:
    """The edit of a whole track, or of the whole palette (`edit track`, `edit palette`).

    Attributes
    ----------
    target : Target
        The inspected colour, before the edit.
    track : bool
        Its track; else the palette.
    rgb : tuple of float
        Its new colour.
    change : Adjustment or None
        The change of hue, chroma and lightness; None: by as much as the inspected colour.
    """

    target: Target
    track: bool
    rgb: tuple[float, ...]
    change: Adjustment | None

    def __call__(self, document: Document) -> None:
        """Do it."""
        target = self.target
        id_ = target.id if self.track else None
        frame = target.frame if self.track and target.kind == "edge" else None
        if self.change is None:
            by = (np.asarray(self.rgb) - target.after).tolist()
            if any(by):
                document.adjust(id_, track=self.track, frame=frame, by=by)
        elif self.change != Adjustment():
            change = self.change
            document.adjust(
                id_,
                track=self.track,
                frame=frame,
                hue=change.hue,
                chroma=change.chroma,
                lightness=change.lightness,
            )
