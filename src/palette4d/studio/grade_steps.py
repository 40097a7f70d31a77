"""What gestures do: each function is one step of the grade, with the bytes of a verb.

It knows no toolkit. The verbs are those of `palette4d edit`; tests compare both.
"""

from collections.abc import Callable
from typing import Any

from palette4d.grade.colour_moves import fades_text
from palette4d.grade.document import Document, OfClip
from palette4d.grade.edits import RAMP_WORDS, Ramp
from palette4d.grade.follow import Progress
from palette4d.grade.later import Unread
from palette4d.grade.picks import Area, Box, Pick
from palette4d.plotting import style
from palette4d.studio import texts
from palette4d.studio.session import Session
from palette4d.studio.states import Place


def handles_of(document: Document, ids: tuple[str, ...]) -> list[str]:
    """Return those ids that are vertices or stops."""
    known = {*document.grade.core.polytope.vertex_ids, *document.grade.settings}
    return [id_ for id_ in ids if id_ in known]


def reset(session: Session) -> None:
    """Reset the selected vertices, and remove the selected stops and picks (`reset`, `unpick`)."""
    document = session.document
    if document is None:
        return
    picks = [pick for pick in document.grade.picks if pick.id in session.selection]
    ids = [id_ for id_ in session.selection if id_ in document.grade.settings]
    said = texts.REMOVED if picks and not ids else texts.WAS_RESET

    def change(document: Document, clip: OfClip | None) -> None:
        if picks:
            document.unpick(*(pick.id for pick in picks), clip=clip)
        for id_ in ids:
            document.reset(id_)

    alone = not ids or (not picks and len(ids) == 1)
    both = [*(pick.id for pick in picks), *ids]
    _as_one(session, "reset", both, change, said, alone=alone, learns=bool(picks))


def reset_all(session: Session) -> None:
    """Reset everything (`reset`)."""
    session.edit(lambda document: document.reset(), texts.RESET_ALL)


def remove(session: Session, ids: list[str]) -> None:
    """Remove picks and holds, and unlock handles (`unpick`, `unlock`)."""
    document = session.document
    if document is None:
        return
    locks = [id_ for id_ in ids if id_ in document.grade.locks]
    picks = [pick for pick in document.grade.picks if pick.id in ids]
    names = [pick.id for pick in picks]

    def change(document: Document, clip: OfClip | None) -> None:
        if locks:
            document.lock(*locks, locked=False)
        if picks:
            document.unpick(*names, clip=clip)

    alone = not (locks and picks)
    both = [*locks, *names]
    _as_one(session, "remove", both, change, texts.REMOVED, alone=alone, learns=bool(picks))


def lock(session: Session) -> None:
    """Lock the selected handles, or unlock them if all are locked (`lock`, `unlock`)."""
    document = session.document
    ids = [] if document is None else handles_of(document, session.selection)
    if document is None or not ids:
        session.say(texts.SELECT_A_HANDLE, "warning")
    elif set(ids) <= set(document.grade.locks):
        session.edit(
            lambda d: d.lock(*ids, locked=False), texts.WAS_UNLOCKED.format(ids=", ".join(ids))
        )
    else:
        new = [id_ for id_ in ids if id_ not in document.grade.locks]
        session.edit(lambda d: d.lock(*new), texts.WAS_LOCKED.format(ids=", ".join(new)))


def set_ramp(session: Session, ramp: Ramp) -> None:
    """Set the ramp of the selected handles; without a selection, the clip's (`ramp`)."""
    document = session.document
    if document is None:
        return
    ids = handles_of(document, session.selection)
    if session.selection and not ids:
        session.say(texts.SELECT_A_HANDLE, "warning")
        return

    def change(document: Document) -> None:
        with document.one_step(f"ramp {RAMP_WORDS[ramp]} {' '.join(ids)}".strip()):
            for id_ in ids:
                document.set_ramp(ramp, id_)
            if not ids:
                document.set_ramp(ramp)

    session.edit(change, texts.RAMP_SET.format(ramp=texts.RAMPS[ramp]))


def enable(session: Session, id_: str, on: bool) -> None:
    """Switch a pick or hold on or off (`enable`, `disable`)."""
    document = session.document

    def change(document: Document, clip: OfClip | None) -> None:
        document.change_pick(id_, enabled=on, clip=clip)

    picks = [] if document is None else [pick for pick in document.grade.picks if pick.id == id_]
    said, verb = (texts.ENABLED, "enable") if on else (texts.DISABLED, "disable")
    _as_one(session, verb, [id_], change, said, alone=False, learns=bool(picks))


def change_pick(session: Session, id_: str, text: str, **changes: Any) -> None:
    """Change how and when a pick or hold acts, where that reads the clip again (`change`)."""

    def change(document: Document, clip: OfClip | None, progress: Progress | None) -> None:
        document.change_pick(id_, clip=clip, progress=progress, **changes)

    session.edit_later(change, text.format(id=id_))


def shape_pick(session: Session, id_: str, dragging: bool, **changes: Any) -> None:
    """Change a pick's reach, softness or lightness, which reads nothing (`change`)."""
    do = session.drag if dragging else session.edit
    do(lambda document: document.change_pick(id_, **changes), texts.PICK_SHAPED.format(id=id_))


def hold(session: Session, place: Place) -> None:
    """Hold the colour of a pixel or a box (`hold`); a pick that is selected stays so."""
    chosen = session.picked is not None and session.picked.kind == "pick"

    def make(document: Document, clip: OfClip | None, progress: Progress | None) -> str:
        if clip is None:
            return document.hold(place.frame, colour=place.colour, any_value=True).id
        pixel = (place.x, place.y)
        return document.hold(
            place.frame, pixel=pixel, box=place.box, clip=clip, progress=progress
        ).id

    session.edit_later(
        make,
        texts.HELD,
        lambda id_: None if chosen else session.select(id_),
        Unread(place.colour),
    )


def correct_path(session: Session, id_: str, place: Place) -> None:
    """Say where a pick or hold is at another frame (`pick --with`)."""

    def correct(document: Document, clip: OfClip | None, progress: Progress | None) -> None:
        where: Any = {"pixel": (place.x, place.y), "box": place.box}
        if clip is None:
            where = {"colour": place.colour, "any_value": True}
        document.correct_path(id_, place.frame, clip=clip, progress=progress, **where)

    text = texts.CORRECTED.format(id=id_, frame=place.frame)
    session.edit_later(correct, text, unread=Unread(place.colour))


def add_area(session: Session, id_: str, area: Area) -> None:
    """Add a box or a stroke to a pick or hold (`area`)."""

    def add(document: Document, clip: OfClip | None, _: Progress | None) -> None:
        document.add_area(id_, area, clip=clip)

    session.edit_later(add, texts.AREA_ADDED.format(id=id_))


def first_box(session: Session, pick: Pick) -> tuple[float, Box]:
    """Return the frame and the box at which a window of a pick begins: around its place.

    Its sides are a quarter of the frame's smaller side, or more, so that its marks have room.
    """
    assert session.document is not None
    clip = session.document.grade.core.clip
    least = min(clip["width"], clip["height"]) / 4
    marks = [area for area in pick.marks if area.frame == pick.frame]
    ends = [(at, area.radius) for area in marks for at in area.points]
    frame, sides = pick.frame, list[tuple[float, float]]()
    if not ends:  # a colour without a place
        frame, ends = session.frame, [((clip["width"] / 2, clip["height"] / 2), 0.0)]
    for axis in (0, 1):
        low = min(at[axis] + 0.5 - radius for at, radius in ends)
        high = max(at[axis] + 0.5 + radius for at, radius in ends)
        half = max(least, high - low + least / 2) / 2
        sides.append((round((low + high) / 2 - half), round((low + high) / 2 + half)))
    (left, right), (top, bottom) = sides
    return frame, (left, top, right, bottom)


def set_window(session: Session, id_: str, frame: float, box: Box) -> None:
    """Put a pick's window somewhere at a frame, and follow it from there (`window`)."""

    def put(document: Document, clip: OfClip | None, progress: Progress | None) -> None:
        document.set_window(id_, frame, box, clip=clip, progress=progress)

    session.edit_later(put, texts.WINDOW_SET.format(id=id_, frame=style.number(frame)))


def drag_window(session: Session, id_: str, frame: float, box: Box, *, typed: bool = False) -> None:
    """Show a pick's window somewhere else, without following it yet."""
    text = texts.WINDOW_SET.format(id=id_, frame=style.number(frame))

    def keep() -> None:
        set_window(session, id_, frame, box)

    def put(document: Document) -> None:
        document.set_window(id_, frame, box, clip=Unread())

    session.drag(put, text, keep if typed else None)


def feather_window(session: Session, id_: str, feather: float, *, dragging: bool = False) -> None:
    """Let a pick's window fade out over so many pixels (`change`)."""
    text = texts.FEATHER_SET.format(id=id_, pixels=style.number(feather))
    do = session.drag if dragging else session.edit
    do(lambda document: document.change_pick(id_, feather=feather), text)


def invert_window(session: Session, id_: str, inverted: bool) -> None:
    """Let a pick change what is outside of its window, or inside (`window`)."""
    text = texts.INVERTED[inverted].format(id=id_)
    session.edit(lambda document: document.change_pick(id_, inverted=inverted), text)


def remove_window(session: Session, id_: str) -> None:
    """Let a pick change all of the picture again (`window`)."""
    text = texts.WINDOW_REMOVED.format(id=id_)
    session.edit(lambda document: document.set_window(id_, None, None), text)


def remove_box(session: Session, id_: str, frame: float) -> None:
    """Remove the box of a pick's window at a frame, and follow it from the others (`window`)."""

    def remove(document: Document, clip: OfClip | None, progress: Progress | None) -> None:
        document.set_window(id_, frame, None, clip=clip, progress=progress)

    session.edit_later(remove, texts.BOX_REMOVED.format(id=id_, frame=style.number(frame)))


def set_fades(session: Session, id_: str, before: float, after: float) -> None:
    """Let a pick or hold fade over so many frames before and after its range (`change`)."""
    text = f"{id_}: {fades_text(before, after)}"
    change_pick(session, id_, text, fade=before, fade_out=after)


def pick_tip(session: Session, pick: Pick) -> str:
    """Return the frames in which a pick acts, for a tip."""
    start, until = map(style.number, range_of(session, pick))
    return texts.PICK_TIP.format(start, until, fades_text(*pick.fades))


def range_of(session: Session, pick: Pick) -> tuple[float, float]:
    """Return the first and last frame at which a pick or hold acts fully."""
    first, last, _ = session.frames
    start, until = pick.start, pick.until
    return float(first if start is None else start), float(last if until is None else until)


def acts_at(session: Session, pick: Pick, frame: float) -> bool:
    """Return whether a frame is in a pick's range or its fades."""
    start, until = range_of(session, pick)
    before, after = pick.fades
    return start - before <= frame <= until + after


def set_range(session: Session, id_: str, start: float, until: float) -> None:
    """Give a pick or hold a range; at the clip's ends it has no limit (`change`)."""
    first, last, _ = session.frames
    text = texts.RANGE_SET.format(id=id_, start=style.number(start), until=style.number(until))
    begin, end = None if start <= first else start, None if until >= last else until
    change_pick(session, id_, text, start=begin, until=end)


def move_stop(session: Session, id_: str, frame: float, *, dragging: bool = False) -> None:
    """Move a stop in time (`move`)."""
    text = texts.STOP_MOVED.format(id=id_, frame=style.number(frame))
    do = session.drag if dragging else session.edit
    do(lambda document: document.move(id_, frame=frame), text)


def keep_version(session: Session) -> None:
    """Keep the edits as the next version: A, B, C…, then A2, B2… (`version save`)."""
    document = session.document
    if document is None:
        return
    rounds = ("", *map(str, range(2, len(document.grade.versions) + 3)))
    names = (letter + again for again in rounds for letter in map(chr, range(65, 91)))
    name = next(each for each in names if each not in document.grade.versions)
    text = texts.KEPT_VERSION.format(name=name)
    session.edit(lambda document: document.save_version(name), text)


def use_version(session: Session, name: str) -> None:
    """Use a version (`version use`)."""
    text = texts.USES_VERSION.format(name=name)
    session.edit(lambda document: document.use_version(name), text)


def rename_version(session: Session, name: str, new: str) -> None:
    """Give a version another name (`version rename`); what shows it goes on with that name."""
    shown = {part: new for part in ("version", "after") if getattr(session.view, part) == name}
    session.edit(
        lambda document: document.change_version(name, rename=new),
        texts.RENAMED_VERSION.format(name=name, new=new),
    )
    if new in session.versions:
        session.look(**shown)


def note_version(session: Session, name: str, note: str) -> None:
    """Say something about a version (`version note`)."""
    session.edit(
        lambda document: document.change_version(name, note=note), texts.NOTED.format(name=name)
    )


def remove_versions(session: Session, names: list[str]) -> None:
    """Remove versions (`version remove`), as one step."""

    def change(document: Document, _: OfClip | None) -> None:
        for name in names:
            document.remove_version(name)

    text = texts.REMOVED_VERSION.format(names=", ".join(names))
    _as_one(session, "remove versions", names, change, text, alone=len(names) == 1)


def source_of(session: Session) -> str | None:
    """Return the clip that edits read."""
    return None if session.clip is None else session.clip.source


def _as_one(
    session: Session,
    verb: str,
    ids: list[str],
    change: Callable[[Document, OfClip | None], object],
    text: str,
    *,
    alone: bool,
    learns: bool = False,
) -> None:
    """Do a change of several as one step; alone it is one step by itself.

    With `learns` it reads the clip: picks and holds change what the others are learned from.
    """

    def whole(document: Document, clip: OfClip | None, _: Progress | None = None) -> None:
        if alone:
            change(document, clip)
            return
        with document.one_step(f"{verb} {' '.join(ids)}"):
            change(document, clip)

    said = text.format(ids=", ".join(ids))
    if ids and learns:
        session.edit_later(whole, said)
    elif ids:
        session.edit(lambda document: whole(document, None), said)
