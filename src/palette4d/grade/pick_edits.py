"""Edits of picks and holds: made, changed, removed.

Each function takes a grade and arguments, and returns the grade after the edit. `mattes` learns
what colours picks take, from a `ClipOfPicks`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, TypedDict, Unpack

from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.text import hex_of
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.clip_of_picks import ClipOfPicks, corrected
from palette4d.grade.colour_moves import fades_text, range_text
from palette4d.grade.edits import Key, as_colour, new_id
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.grade.mattes import Learned, odds_of
from palette4d.grade.picks import (
    MOST_AREAS,
    MOST_PICKS,
    Area,
    PathKey,
    Pick,
    Toward,
    Window,
    WindowKey,
    as_box,
    checked,
)

#: The feather of a new window, as a share of the box's shorter side.
FEATHER = 0.1


class Where(TypedDict, total=False):
    """Where a colour is picked: the keywords of `Document.correct_path`."""

    colour: Iterable[float] | str | None
    pixel: tuple[float, float] | None
    box: int
    any_value: bool


class When(Where, total=False):
    """Also when a hold acts, and what it is learned from: the keywords of `Document.hold`."""

    areas: Sequence[Area]
    follow: bool
    start: float | None
    until: float | None
    fade: float
    fade_out: float | None


class Asked(When, total=False):
    """Also the change, and what it takes: the keywords of `Document.pick`.

    Attributes
    ----------
    colour : 3 floats or "#rrggbb"
        The picked colour as it is before edits, in the palette's code values.
    pixel : (float, float)
        Instead of `colour`: a pixel of the clip's frame, x from the left, y from the top.
    box : int
        With `pixel`: the side of the box around it whose main colour is picked.
    areas : sequence of Area
        More parts of the thing: boxes and strokes.
    to, by : 3 floats
        The new colour, or the change; one of them.
    follow : bool
        Follow the colour through the clip. Without the clip, or without this, the pick is at
        the same colour in all frames.
    toward, start, until, fade, fade_out, whole_hue, reach, softness, lightness
        Attributes of `palette4d.grade.picks.Pick`.
    any_value : bool
        Take colours such as 255 128 0 as they are.
    window, feather : 4 floats, and float
        The box at `frame` that the pick changes, and how far beyond it the change fades out
        (`Document.set_window`).
    inverted : bool
        The pick changes what is outside of the window.
    """

    to: Iterable[float] | str | None
    by: Iterable[float] | None
    toward: Toward
    whole_hue: bool
    reach: float
    softness: float
    lightness: tuple[float, float]
    window: Iterable[float] | None
    feather: float | None
    inverted: bool | None


def pick(
    grade: Grade,
    clip: ClipOfPicks,
    frame: float,
    progress: Progress | None = None,
    **asked: Unpack[Asked],
) -> tuple[Grade, Pick]:
    """Change a thing's colour into another one (`Document.pick`)."""
    picked = _picked(grade, clip, frame, asked)
    to, by = asked.get("to"), asked.get("by")
    if to is not None and by is None:
        new = grade.checked(to, asked.get("any_value", False))
    elif by is not None and to is None:
        new = as_colour([a + b for a, b in zip(picked.rgb, as_colour(by, "change"), strict=True)])
    else:
        raise Palette4dError(
            f"found {'neither' if to is None else 'both'} of the new colour (to) and the "
            "change (by), expected one of them"
        )
    given: dict[str, Any] = {**asked}
    names = ("toward", "whole_hue", "reach", "softness", "lightness")
    shape = {name: given[name] for name in names if name in given}
    made = replace(picked, kind="pick", to=new, **shape)
    box, feather, inverted = asked.get("window"), asked.get("feather"), asked.get("inverted")
    if box is None and (feather is not None or inverted is not None):
        raise Palette4dError(
            f"found {Arg('feather' if inverted is None else 'inverted')} without {Arg('window')}, "
            "expected both"
        )
    if box is not None:
        key = WindowKey(frame, as_box(box), given=True)
        made = replace(made, window=_with_key(None, key, feather, inverted))
    return _add(grade, clip, made, asked, progress)


def hold(
    grade: Grade,
    clip: ClipOfPicks,
    frame: float,
    progress: Progress | None = None,
    **asked: Unpack[When],
) -> tuple[Grade, Pick]:
    """Keep a thing's colour as it is (`Document.hold`)."""
    return _add(grade, clip, _picked(grade, clip, frame, asked), asked, progress)


def correct_path(
    grade: Grade,
    clip: ClipOfPicks,
    id: str,
    frame: float,
    progress: Progress | None = None,
    **where: Unpack[Where],
) -> Grade:
    """Say where the colour of a pick or hold is at another frame (`Document.correct_path`)."""
    picked = _picked(grade, clip, frame, where)
    changed = corrected(grade.pick(id), picked.frame, picked.rgb)
    changed = replace(changed, path=clip.path(changed, changed.path, progress))
    return _learned(grade, clip, changed, f"correct {id}: {hex_of(picked.rgb)} at frame {frame:g}")


def add_area(grade: Grade, clip: ClipOfPicks, id: str, area: Area) -> Grade:
    """Say that a box or a stroke belongs to a pick or hold too (`Document.add_area`)."""
    old = grade.pick(id)
    if old.whole_hue:
        raise Palette4dError(
            f"{id} takes all of its hue, and learns nothing from areas: change it with "
            f"{Arg('whole_hue', False)} first, or pick there too"
        )
    grade.check_frame(area.frame)
    if clip.missing:
        raise Palette4dError(
            f"the clip {grade.members['clip']['source']!r} is not there, so that nothing can be "
            f"learned from its pixels; give {Arg('clip')}"
        )
    clip.check_places(area.frame, area.points)
    what = "a box" if len(area.points) == 1 else "a stroke"
    label = f"add {what} at frame {area.frame:g} to {id}"
    new = checked(replace(old, areas=(*old.areas, area)), grade.frames)
    return _learned(grade, clip, new, label)


def set_window(
    grade: Grade,
    clip: ClipOfPicks,
    id: str,
    frame: float | None,
    box: Iterable[float] | None,
    *,
    feather: float | None = None,
    inverted: bool | None = None,
    follow: bool = True,
    progress: Progress | None = None,
) -> Grade:
    """Limit a pick to a box that moves over time, or to none (`Document.set_window`)."""
    old = grade.pick(id)
    if old.kind == "hold":
        raise Palette4dError(
            f"{id} is a hold, which has no window; expected a pick: holds keep their colours "
            "everywhere"
        )
    if box is None and old.window is None:
        raise Palette4dError(f"{id} has no window; expected a box, to give it one")
    if box is None:
        if feather is not None or inverted is not None:
            shape = Arg("feather" if feather is not None else "inverted")
            raise Palette4dError(f"found {shape} without a box of the window, expected both")
        new = replace(old, window=None if frame is None else _without_key(old, frame))
        text = _window_text(new) if new.window is None else f"no box at frame {frame:g}"
    else:
        if frame is None:
            raise Palette4dError("found a box of a window without its frame, expected both")
        grade.check_frame(frame)
        clip.check_places(frame, ())
        key = WindowKey(frame, as_box(box), given=True)
        new = replace(old, window=_with_key(old.window, key, feather, inverted))
        text = _window_text(new, frame)
    new = checked(new, grade.frames)
    if follow:
        new = _window_followed(clip, new, progress)
    return grade.put("pick", id, new, f"change {id}: {text}")


def _without_key(pick: Pick, frame: float) -> Window | None:
    """Return the given keys of a pick's window but for that of a frame; None without any."""
    assert pick.window is not None
    given = pick.window.given.keys
    kept = tuple(key for key in given if key.frame != frame)
    if kept == given:
        known = ", ".join(f"{key.frame:g}" for key in given)
        raise Palette4dError(
            f"the window of {pick.id} has no box at frame {frame:g} that was given; expected one "
            f"of {known}"
        )
    return replace(pick.window, keys=kept) if kept else None


def _with_key(
    window: Window | None, key: WindowKey, feather: float | None, inverted: bool | None
) -> Window:
    """Return a window's given keys with another one."""
    left, top, right, bottom = key.box
    before = window or Window(round(FEATHER * min(right - left, bottom - top), 1), ())
    keys = {each.frame: each for each in before.keys if each.given} | {key.frame: key}
    return Window(
        before.feather if feather is None else float(feather),
        tuple(keys[at] for at in sorted(keys)),
        before.inverted if inverted is None else bool(inverted),
    )


def _window_followed(clip: ClipOfPicks, pick: Pick, progress: Progress | None) -> Pick:
    if pick.window is None:
        return pick
    return replace(pick, window=clip.window(pick, pick.window, progress))


def change_pick(
    grade: Grade,
    clip: ClipOfPicks,
    id: str,
    *,
    by: Iterable[float] | None = None,
    follow: bool | None = None,
    any_value: bool = False,
    progress: Progress | None = None,
    **changes: Any,
) -> Grade:
    """Change a pick or hold (`Document.change_pick`)."""
    old = grade.pick(id)
    of_window = {name: changes.pop(name, None) for name in ("feather", "inverted")}
    if of_window := {name: value for name, value in of_window.items() if value is not None}:
        window = changes.get("window", old.window)
        if window is None:
            raise Palette4dError(
                f"{id} has no window, which {' and '.join(of_window)} is of; expected a box first: "
                f"`window {id} --frame T --box L,T,R,B`"
            )
        changes["window"] = replace(window, **of_window)
    if changes.get("frame", old.frame) != old.frame:  # its place is one of the frame before
        changes = {"pixel": None, "box": None, **changes}
    if changes.get("pixel") is not None and "rgb" not in changes:
        frame, box = changes.get("frame", old.frame), changes.get("box") or 1
        grade.check_frame(frame)
        changes |= {"rgb": clip.colour(frame, changes["pixel"], box), "box": box}
    if by is not None:
        base = as_colour(changes.get("rgb", old.rgb))
        changes["to"] = [a + b for a, b in zip(base, as_colour(by, "offset"), strict=True)]
    for name in ("rgb", "to"):
        if name in changes:
            changes[name] = grade.checked(changes[name], any_value)
    bad = {"to", "toward", "whole_hue", "reach", "softness", "lightness", "window"} & changes.keys()
    if old.kind == "hold" and bad:
        raise Palette4dError(f"{id} is a hold, which has no {' and no '.join(sorted(bad))}")
    new = _with_one_fade(replace(old, **changes))
    if new.enabled and not old.enabled:
        _check_room(grade)
    grade.check_frame(new.frame)
    new = checked(new, grade.frames)
    ranged = {"start", "until", "fade", "fade_out"} & changes.keys()
    moved = ranged | {"frame", "rgb"} & changes.keys()
    stays = moved == ranged and known(old.path, new, grade)
    if follow is False:
        new = replace(new, path=())
    elif follow or (moved and old.path and not stays):
        given = tuple(key for key in old.path if key.given and key.frame != old.frame)
        new = replace(new, path=clip.path(new, given, progress))
    if (window := new.window) is not None and "window" not in changes:
        if follow is False:
            new = replace(new, window=window.given)
        elif follow or (ranged and window != window.given and not known(window.keys, new, grade)):
            new = _window_followed(clip, new, progress)
    label = f"change {id}: {_changed(old, new)}"
    if old.enabled != new.enabled:
        label = f"{'enable' if new.enabled else 'disable'} {id}"
    learns = moved or {"pixel", "box", "areas", "whole_hue"} & changes.keys()
    if learns or follow is not None or old.enabled != new.enabled:
        return _learned(grade, clip, new, label)
    return grade.put("pick", id, new, label)


def known(keys: Sequence[PathKey] | Sequence[WindowKey], pick: Pick, grade: Grade) -> bool:
    """Return whether keys that were followed reach through all frames that a pick changes."""
    (first, last), step = pick.span(grade.frames), grade.frames[2]
    followed = any(not key.given for key in keys)
    return followed and keys[0].frame < first + step and last - step < keys[-1].frame


def unpick(grade: Grade, clip: ClipOfPicks, *ids: str) -> Grade:
    """Remove picks and holds; the mattes of the other kind are learned again."""
    removed = [grade.pick(id_) for id_ in ids]
    keys: list[Key] = [("pick", id_) for id_ in ids]
    grade = grade.having(dict.fromkeys(keys))
    return with_mattes(grade, clip, removed).labelled(f"remove {' '.join(ids)}")


def warnings(grade: Grade, clip: ClipOfPicks, id: str) -> tuple[str, ...]:
    """Return what speaks against the clip of a pick or hold, and its colour."""
    pick = grade.pick(id)
    known = ClipColours(grade.core.polytope, grade.members)
    stored = [known.colours_at(pick.frame), *known.colours] if known.colours else []
    lines = clip.warnings(pick, stored)
    outside = pick.to is not None and not all(-0.05 <= value <= 1.05 for value in pick.to)
    if outside and not grade.scene_linear:
        lines += (f"the new colour of {id} lies far outside 0..1; most files clip it",)
    return lines


def _picked(grade: Grade, clip: ClipOfPicks, frame: float, where: Where) -> Pick:
    """Return a hold of a colour at a frame."""
    grade.check_frame(frame)
    colour, pixel, box = where.get("colour"), where.get("pixel"), where.get("box", 1)
    if colour is not None and pixel is None:
        rgb = grade.checked(colour, where.get("any_value", False))
        return Pick("", "hold", frame, rgb)
    if colour is None and pixel is not None:
        rgb = clip.colour(frame, pixel, box)
        return Pick("", "hold", frame, rgb, pixel=pixel, box=box)
    raise Palette4dError(
        f"found {'neither' if colour is None else 'both'} of a colour and a pixel, expected "
        "one of them"
    )


def _check_room(grade: Grade) -> None:
    """Refuse one more enabled pick or hold than a sidecar may have."""
    enabled = sum(other.enabled for other in grade.picks)
    if enabled >= MOST_PICKS:
        raise Palette4dError(
            f"there are {enabled} picks and holds, and at most {MOST_PICKS} can be "
            "enabled; remove or disable some (`unpick`, `disable`)"
        )


def _add(
    grade: Grade, clip: ClipOfPicks, made: Pick, asked: When, progress: Progress | None
) -> tuple[Grade, Pick]:
    _check_room(grade)
    given: dict[str, Any] = {**asked, "areas": tuple(asked.get("areas", ()))}
    when = ("areas", "start", "until", "fade", "fade_out")
    made = _with_one_fade(replace(made, **{name: given[name] for name in when if name in given}))
    grade.check_frame(made.frame)
    made = checked(made, grade.frames)
    for area in made.areas:
        clip.check_places(area.frame, area.points)
    if asked.get("follow", True):
        made = replace(made, path=clip.path(made, progress=progress))
        made = _window_followed(clip, made, progress)
    for other in grade.picks:
        if _same(replace(other, path=()) if clip.unread else other, made):
            off = "" if other.enabled else f", disabled: `enable {other.id}`"
            raise Palette4dError(f"{other.id} is this {made.kind} already{off}; nothing was added")
    made = replace(made, id=new_id("p", [other.id for other in grade.picks]))
    grade = _learned(grade, clip, made, f"{made.kind} {made.id}: {asked_text(made)}")
    return grade, grade.pick(made.id)


def _learned(grade: Grade, clip: ClipOfPicks, pick: Pick, label: str) -> Grade:
    """Set a pick or hold with a new matte; picks and holds change each other's mattes."""
    grade = grade.put("pick", pick.id, pick)
    if (areas := sum(len(each.areas) for each in grade.picks)) > MOST_AREAS:
        raise Palette4dError(
            f"found {areas} areas of picks and holds, expected at most {MOST_AREAS}; remove some "
            "picks (`unpick`), and pick again with fewer"
        )
    return with_mattes(grade, clip, [pick]).labelled(label)


def with_mattes(grade: Grade, clip: ClipOfPicks, changed: Sequence[Pick]) -> Grade:
    """Learn the mattes of changed picks or holds that are still there, and of the other kind.

    Picks are background for holds, and holds for picks. A colour that both have is whose it more
    certainly is. What cannot be learned, without the clip, keeps its matte.
    """
    ids, kinds = {pick.id for pick in changed}, {pick.kind for pick in changed}
    again = [pick for pick in grade.picks if pick.id in ids or kinds - {pick.kind}]
    mattes: dict[str, Learned] = {}
    for pick in again:
        rivals = [p for p in grade.picks if p.kind != pick.kind and p.enabled]
        learned = None if pick.whole_hue else clip.learn(pick, rivals, grade.display())
        if learned is not None:
            mattes[pick.id] = learned
    odds = {p.id: odds_of(grade.mattes[p.matte]) for p in grade.picks if p.matte and p.enabled}
    odds |= {id_: learned.odds for id_, learned in mattes.items() if grade.pick(id_).enabled}
    for pick in again:
        if pick.whole_hue:
            grade = grade.put("pick", pick.id, replace(pick, matte=None))
        if pick.id not in mattes:
            continue
        rivals = [p for p in grade.picks if p.kind != pick.kind and p.id in odds]
        matte = mattes[pick.id].against([odds[rival.id] for rival in rivals])
        grade = grade.with_mattes({matte.id: matte.text})
        grade = grade.put("pick", pick.id, replace(pick, matte=matte.id if matte.seen else None))
    return grade


def _same(old: Pick, new: Pick) -> bool:
    """Return whether two picks ask for the same, whatever their paths and mattes are."""
    rest: dict[str, Any] = {"id": "", "enabled": True, "path": (), "matte": None}
    asked = [replace(pick, **rest, window=pick.window and pick.window.given) for pick in (old, new)]
    return bool(old.path) == bool(new.path) and asked[0] == asked[1]


def _changed(old: Pick, new: Pick) -> str:
    """Return what is new of a pick, for people: "to #803020, fades of 4 frames"."""
    texts = [
        (
            f"{hex_of(pick.rgb)} at frame {pick.frame:g}",
            "" if pick.to is None else f"to {hex_of(pick.to)}",
            "all frames"
            if pick.start is None and pick.until is None
            else range_text(pick.start, pick.until),
            fades_text(*pick.fades),
            f"the same {'new colour' if pick.toward == 'colour' else 'change'} at all frames",
            "all of its hue" if pick.whole_hue else "learned colours",
            f"reach {pick.reach:g}",
            f"softness {pick.softness:g}",
            f"lightness {pick.lightness[0]:g} to {pick.lightness[1]:g}",
            "followed" if pick.path else "not followed",
            _window_text(pick),
        )
        for pick in (old, new)
    ]
    changes = [after for before, after in zip(*texts, strict=True) if before != after]
    return ", ".join(changes) or asked_text(new)


def _window_text(pick: Pick, frame: float | None = None) -> str:
    """Return a pick's window for people, at a frame or at its first given one."""
    if pick.window is None:
        return "no window"
    if frame is None:
        frame = next((key.frame for key in pick.window.keys if key.given), pick.frame)
    box = ",".join(f"{side:g}" for side in pick.window.box_at(frame))
    outside = "outside of " if pick.window.inverted else ""
    return f"{outside}window {box} at frame {frame:g}, feather {pick.window.feather:g}"


def _with_one_fade(pick: Pick) -> Pick:
    """Return a pick without a fade of its own after the range, where it is the one before."""
    return replace(pick, fade_out=None) if pick.fade_out == pick.fade else pick


def asked_text(pick: Pick) -> str:
    """Return what a pick asks for, for people: "#5ca832 to #803020 at frame 30"."""
    text = hex_of(pick.rgb)
    if pick.to is not None:
        text += f" to {hex_of(pick.to)}"
    text += f" at frame {pick.frame:g}"
    if pick.start is not None or pick.until is not None:
        text += f", {range_text(pick.start, pick.until)}"
    if any(pick.fades):
        text += f", {fades_text(*pick.fades)}"
    if pick.window is not None:
        text += f", {_window_text(pick)}"
    return text
