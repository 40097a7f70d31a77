"""Edits of handles: the colours of vertices and stops, stops in time, and ramps.

Each function takes a grade and arguments, and returns the grade after the edit.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypedDict, Unpack

from palette4d.colour.oklch import Adjustment, adjuster
from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade import colour_moves
from palette4d.grade.edits import (
    RAMP,
    RAMP_WORDS,
    Colour,
    Key,
    Ramp,
    Setting,
    as_colour,
    as_ramp,
    new_id,
)
from palette4d.grade.grade import Grade, text_of
from palette4d.grade.handles import unknown
from palette4d.grade.palette import FAR, Near
from palette4d.grade.tracks import way_of

#: Least weight of a vertex at a frame for moving it: with less it would move too far.
LEAST_SHARE = 0.5


class How(TypedDict, total=False):
    """A change of colours, and when: the keywords of `Document.adjust`.

    Attributes
    ----------
    rgb : 3 floats or "#rrggbb", optional
        The new colour; other handles of the track move by as much, and darker ones by less.
    by : 3 floats, optional
        Offsets in code values.
    hue : float
        Degrees added to the hue, in OKLCh of the displayed colour.
    chroma, lightness : float
        Factors of 0 or more, in OKLCh of the displayed colour.
    start, until, fade, fade_out : float, optional
        Only from frame `start` to `until`, with ramps of `fade` frames (at least one)
        before and after, and nothing beyond. A range without one end goes on to that end
        of the clip. `fade_out` is the length of the ramp after it, if that differs.
    ramp : {"linear", "smooth", "step"}, optional
        The ramp of the handles that move, or of the fades of a range.
    any_value : bool
        Take colours such as 255 128 0 as they are.
    """

    rgb: Iterable[float] | str | None
    by: Iterable[float] | None
    hue: float
    chroma: float
    lightness: float
    start: float | None
    until: float | None
    fade: float | None
    fade_out: float | None
    ramp: str | None
    any_value: bool


def set_colour(grade: Grade, id: str, new: Colour) -> Grade:
    """Set the colour of a vertex or a stop."""
    after = replace(grade.setting(id), rgb=new)
    return grade.put("handle", id, after, f"set {id} to {text_of(new)}")


def stop(
    grade: Grade, edge: str, frame: float, new: Colour, ramp: Ramp | None = None
) -> tuple[Grade, str]:
    """Set the colour of an edge at a time by a colour stop; return also the stop's id."""
    grade.check_frame(frame)
    grade.check_inside(edge, frame)
    there = grade.stop_at(edge, frame)
    if there is not None:
        return set_colour(grade, there, new), there
    id_ = new_id("s", {*grade.handles.vertices, *grade.handles.edges, *grade.settings})
    setting = Setting(new, edge, float(frame), ramp)
    label = f"set {edge} at frame {frame:g} to {text_of(new)}"
    return grade.put("handle", id_, setting, label), id_


def set_near(
    grade: Grade,
    near: Iterable[float] | str,
    *,
    frame: float,
    anyway: bool = False,
    id: str | None = None,
    **how: Unpack[How],
) -> tuple[Grade, Near]:
    """Change the palette colour nearest to a given colour at a frame (`Document.set_near`)."""
    wanted = grade.checked(near, how.get("any_value", False))
    nearest = grade.near(wanted, frame=frame, id=id)
    if nearest.distance > FAR and not anyway:
        raise Palette4dError(nearest.refusal(wanted))
    if _range(grade, how) is not None:
        time = frame if nearest.id in grade.handles.edges else None
        after, _ = adjust(grade, nearest.id, frame=time, **how)
        return after, replace(nearest, handle=None)
    move, _ = _move(grade, nearest.id, frame, how)
    new = as_colour(move(nearest.rgb))
    handle, moved, ramp = nearest.handle, new, how.get("ramp")
    if handle in grade.handles.vertices and handle != nearest.id:
        ramped = grade if ramp is None else set_ramp(grade, ramp, handle)
        share = _share(ramped, handle, nearest.id, frame)
        if share < LEAST_SHARE:
            handle = None
        else:
            own, now = ramped.colour(handle), ramped.colour_on_edge(nearest.id, frame)
            moved = as_colour([o + (n - f) / share for o, n, f in zip(own, new, now, strict=True)])
    label = f"set {handle or nearest.id} at frame {frame:g} to {text_of(new)}"
    if handle is not None:
        grade = set_colour(grade, handle, moved)
    else:
        grade, handle = stop(grade, nearest.id, frame, new)
    if ramp is not None:
        grade = set_ramp(grade, ramp, handle)
    return grade.labelled(label), replace(nearest, handle=handle)


def _share(grade: Grade, vertex: str, edge: str, frame: float) -> float:
    """Return the weight, 0..1, of an end of an edge in the edge's displacement at a frame."""
    red, *others = grade.colour(vertex)
    step = 1 if red < 0 else -1  # stays within what colours may be
    further = set_colour(grade, vertex, as_colour([red + step, *others]))
    return (further.colour_on_edge(edge, frame)[0] - grade.colour_on_edge(edge, frame)[0]) / step


def move(grade: Grade, stop: str, frame: float) -> Grade:
    """Move a stop in time, within its edge."""
    before = grade.settings.get(stop)
    if before is None or before.edge is None:
        if stop in grade.handles.vertices:
            raise Palette4dError(
                f"{stop} is a palette vertex, whose time the analysis found; only stops move "
                f"in time. Its colour moves with {Arg('by')}"
            )
        stops = [id_ for id_, setting in grade.settings.items() if setting.edge is not None]
        raise unknown(stop, "stop", stops)
    grade.check_frame(frame)
    grade.check_inside(before.edge, frame)
    there = grade.stop_at(before.edge, frame)
    if there not in (None, stop):
        raise Palette4dError(
            f"edge {before.edge} already has the stop {there} at frame {frame:g}; choose "
            "another frame, or reset that stop first"
        )
    after = replace(before, frame=float(frame))
    return grade.put("handle", stop, after, f"move {stop} to frame {frame:g}")


def adjust(
    grade: Grade,
    id: str | None = None,
    *,
    track: bool = False,
    frame: float | None = None,
    **how: Unpack[How],
) -> tuple[Grade, tuple[str, ...]]:
    """Move the colours of a handle, of a track or of the palette (`Document.adjust`).

    Return also the ids of the vertices and stops that changed.
    """
    if frame is not None and id is not None:
        grade.check_frame(frame)
        grade.check_inside(id, frame)
    elif id is not None and id not in grade.handles.edges:
        grade.frame_of(id, None)  # refuses unknown ids
    within = _range(grade, how)
    when = "" if within is None else colour_moves.range_text(how.get("start"), how.get("until"))
    ramp = how.get("ramp")
    known = None if ramp is None else as_ramp(ramp)
    move, what = _move(grade, id, frame, how)
    rgb = how.get("rgb")
    if rgb is not None and within is not None and within.weight(grade.frame_of(id, frame)) < 1:
        raise Palette4dError(
            f"the colour is meant at frame {grade.frame_of(id, frame):g}, outside of the "
            f"range {when}; expected a range with this frame"
        )
    own = grade.settings.get(id or "")
    if id is None:
        name, way = "palette", (set(grade.handles.vertices), set(grade.handles.edges))
    elif within is not None or track:
        name, way = f"track {id}", way_of(grade.handles, (own and own.edge) or id)
    elif id in grade.handles.edges:
        new = as_colour(move(grade.colour_on_edge(id, grade.frame_of(id, frame))))
        after, made = stop(grade, id, grade.frame_of(id, frame), new, known)
        return after, (made,)
    else:
        name, way = id, ({id}, set())
    changed = colour_moves.moved(
        *(grade.handles, grade.settings, way, move, grade.colour_on_edge),
        within=within,
        ramp=known,
        clip_ramp=grade.ramp,
        exact=None if id is None or rgb is None or frame is None else (id, frame),
    )
    if track or id is None:
        # Locked handles stay. One that is named itself moves.
        locked = {n for kind, n in grade.state if kind == "lock" and n != id}
        changed = {n: setting for n, setting in changed.items() if n not in locked}
    if within is not None:
        what += f" {when}"
    label = f"{'move' if rgb is None else 'set'} {name} {what}"
    values: dict[Key, Setting] = {("handle", n): setting for n, setting in changed.items()}
    moved = tuple(n for n, setting in changed.items() if grade.settings.get(n) != setting)
    return grade.having(values, label), moved


def _range(grade: Grade, how: How) -> colour_moves.Range | None:
    """Return the range that the user asked for; None: the whole clip."""
    start, until, fades = how.get("start"), how.get("until"), (how.get("fade"), how.get("fade_out"))
    return colour_moves.range_of(start, until, *fades, frames=grade.frames)


def _move(
    grade: Grade, id: str | None, frame: float | None, how: How
) -> tuple[colour_moves.Move, str]:
    """Return the move that the user asked for, and its text for people."""
    rgb, by, any_value = how.get("rgb"), how.get("by"), how.get("any_value", False)
    change = Adjustment(how.get("hue", 0.0), how.get("chroma", 1.0), how.get("lightness", 1.0))
    if [rgb is None, by is None, change == Adjustment()].count(False) != 1:
        raise Palette4dError(
            f"expected one kind of change: a new colour {Arg('rgb')}, offsets {Arg('by')}, or "
            f"{Arg('hue')}, {Arg('chroma')} and {Arg('lightness')}"
        )
    if by is not None:
        offset = grade.checked(by, any_value, "offset")
        return colour_moves.shift(offset), f"by {text_of(offset)}"
    if rgb is None:
        return adjuster(grade.encoding, change), str(change)
    if id is None:
        raise Palette4dError(
            f"the whole palette cannot get one colour; expected offsets as {Arg('by')}, or "
            "hue, chroma and lightness"
        )
    new, time = grade.checked(rgb, any_value), grade.frame_of(id, frame)
    before = grade.colour_on_edge(id, time) if id in grade.handles.edges else grade.colour(id)
    return colour_moves.shift_to(before, new), f"to {text_of(new)}"


def reset(grade: Grade, id: str | None = None) -> Grade:
    """Reset a vertex, remove a stop, or (None) reset all but versions (`Document.reset`)."""
    if id is None:
        return grade.having(dict.fromkeys(grade.active), "reset everything")
    if id not in grade.settings:
        grade.handles.vertex(id, grade.settings)
        return grade
    gone = grade.settings[id].edge is not None
    keys: list[Key] = [("handle", id), ("lock", id)] if gone else [("handle", id)]
    return grade.having(dict.fromkeys(keys), f"reset {id}")


def set_ramp(grade: Grade, ramp: str, id: str | None = None) -> Grade:
    """Set the ramp from a vertex or stop to the next handle in time, or the clip's ramp."""
    known = as_ramp(ramp)
    if id is None:
        return grade.put(*RAMP, None if known == "linear" else known, f"ramp {RAMP_WORDS[known]}")
    after = replace(grade.setting(id), ramp=known)
    return grade.put("handle", id, after, f"ramp {RAMP_WORDS[known]} from {id}")


def lock(grade: Grade, *ids: str) -> Grade:
    """Keep vertices and stops where they are when tracks or the palette move."""
    for id_ in ids:
        grade.setting(id_)  # refuses unknown ids
    return grade.having({("lock", id_): True for id_ in ids}, f"lock {' '.join(ids)}")


def unlock(grade: Grade, *ids: str) -> Grade:
    """Let tracks and the palette move these vertices and stops again."""
    for id_ in ids:
        if id_ not in grade.locks:
            raise unknown(id_, "lock", grade.locks, "`picks` or `Grade.locks`")
    return grade.having(dict.fromkeys([("lock", id_) for id_ in ids]), f"unlock {' '.join(ids)}")
