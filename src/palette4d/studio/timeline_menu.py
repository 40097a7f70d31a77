"""The menus of the timeline: what can be done with the thing under the pointer."""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from PySide6.QtWidgets import QMenu

from palette4d.grade.edits import RAMPS
from palette4d.grade.picks import Pick
from palette4d.plotting import style
from palette4d.studio import grade_steps, texts
from palette4d.studio.menu_entries import VIEW
from palette4d.studio.session import Session
from palette4d.studio.timeline_places import Hit

if TYPE_CHECKING:
    from palette4d.studio.timeline_view import TimelineView

#: Fades of picks in the menu, in frames.
FADES = (0.0, 2.0, 5.0, 10.0, 25.0)


def menu_for(view: "TimelineView", hit: Hit, x: float) -> QMenu:
    """Return the menu of something under the pointer, at x; it gets selected."""
    session, places, menu = view.session, view.places, QMenu(view)
    if hit.id and hit.id not in session.selection:
        session.select(hit.id)
    disc = places.disc(hit.id) if hit.what == "disc" else None
    if disc is not None:
        _add_go(menu, session, disc.frame)
        menu.addAction(
            texts.REMOVE_STOP if hit.stop else texts.RESET, lambda: grade_steps.reset(session)
        )
        _add_ramps(menu, session)
        locked = session.document is not None and hit.id in session.document.grade.locks
        menu.addAction(texts.UNLOCK if locked else texts.LOCK, lambda: grade_steps.lock(session))
        menu.addSeparator()
    elif hit.what == "pick":
        pick = next(pick for pick, _ in places.lanes() if pick.id == hit.id)
        _add_pick(menu, session, pick)
        boxes = () if pick.window is None else pick.window.given.keys
        if len(boxes) > 1:
            near = min((key.frame for key in boxes), key=lambda at: abs(places.x_of(at) - x))
            text = texts.REMOVE_BOX.format(frame=style.number(near))
            menu.addAction(text, lambda: grade_steps.remove_box(session, pick.id, near))
        menu.addAction(texts.REMOVE, lambda: grade_steps.remove(session, list(session.selection)))
        menu.addSeparator()
    elif hit.what == "band":
        frame = places.frame_at(x)
        text = texts.ADD_STOP_AT.format(frame=style.number(frame))
        menu.addAction(text, lambda: view.add_stop(hit.id, frame))
        menu.addSeparator()
    menu.addActions(view.menu_actions[VIEW])
    return menu


def _add_go(menu: QMenu, session: Session, frame: float) -> None:
    menu.addAction(texts.GO_THERE.format(frame=style.number(frame)), lambda: session.go(frame))


def _add_pick(menu: QMenu, session: Session, pick: Pick) -> None:
    """Add what can be changed of a pick or hold."""

    def entry(where: QMenu, text: str, on: bool, change: Callable[[], object]) -> None:
        made = where.addAction(text)
        made.setCheckable(True)
        made.setChecked(on)
        made.triggered.connect(lambda _=False: change())

    def changed(text: str, **changes: Any) -> Callable[[], object]:
        return lambda: grade_steps.change_pick(session, pick.id, text, **changes)

    _add_go(menu, session, pick.frame)
    switch = not pick.enabled
    entry(menu, texts.ACTS, pick.enabled, lambda: grade_steps.enable(session, pick.id, switch))
    if pick.kind == "pick":
        said = texts.ITS_COLOURS if pick.whole_hue else texts.ITS_HUE
        hue = changed(said, whole_hue=not pick.whole_hue)
        entry(menu, texts.WHOLE_HUE, pick.whole_hue, hue)
        same = pick.toward == "colour"
        said = texts.SAME_SHIFT if same else texts.SAME_EVERYWHERE
        toward = changed(said, toward="shift" if same else "colour")
        entry(menu, texts.SAME_COLOUR, same, toward)
    fades = menu.addMenu(texts.FADE)
    for fade in sorted({*FADES, *pick.fades}):
        name = texts.FADE_OF.format(frames=style.number(fade)) if fade else texts.NO_FADE
        both = float(fade), float(fade)
        faded = functools.partial(grade_steps.set_fades, session, pick.id, *both)
        entry(fades, name, both == pick.fades, faded)


def _add_ramps(menu: QMenu, session: Session) -> None:
    """Add the ramps of the selected handles."""
    document = session.document
    if document is None:
        return
    ids = grade_steps.handles_of(document, session.selection)
    ramps = menu.addMenu(texts.RAMP)
    for ramp in RAMPS:
        entry = ramps.addAction(texts.RAMPS[ramp])
        entry.triggered.connect(lambda _=False, ramp=ramp: grade_steps.set_ramp(session, ramp))
        entry.setCheckable(True)
        own = [document.grade.settings[id_].ramp for id_ in ids if id_ in document.grade.settings]
        entry.setChecked(bool(own) and all(each == ramp for each in own))
