"""The actions of the menus.

Each action of `menu_entries.ACTIONS` is in `MenuActions.calls`, or a method of its name here, in
`file_menu`, `verb_menu` or `help_menu`.
"""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt

from palette4d.studio import grade_steps, texts
from palette4d.studio.preferences import Preferences

if TYPE_CHECKING:
    from palette4d.studio.window import Window

#: The step of the exposure, and its limits, in stops.
EXPOSURE_STEP, EXPOSURE = 0.25, 10.0
#: The step of the viewer's zoom.
ZOOM = 1.5
#: The fastest playing.
FASTEST = 8


class MenuActions:
    """What the menus do with the session and the views of a window."""

    def __init__(self, window: "Window") -> None:
        session, viewer = window.session, window.viewer
        self.window, self.session, self.viewer = window, session, viewer
        #: The actions of one call.
        self.calls: dict[str, Callable[[], object]] = {
            **{f"version_{n}": functools.partial(self.use_version, n) for n in range(1, 10)},
            "next_shot": lambda: window.shots.step(1),
            "previous_shot": lambda: window.shots.step(-1),
            "quit": window.close,
            "undo": lambda: window.verbs.former.undo(),
            "redo": lambda: window.verbs.former.redo(),
            "reset_selected": lambda: grade_steps.reset(session),
            "reset_all": lambda: grade_steps.reset_all(session),
            "add_stop": lambda: window.timeline.add_stop_at_playhead(),
            "lock": lambda: grade_steps.lock(session),
            "preferences": lambda: Preferences(window).show(),
            "cross": viewer.cross.switch,
            "act_from": lambda: self._set_range(start=float(session.frame)),
            "act_until": lambda: self._set_range(until=float(session.frame)),
            "ramp_linear": lambda: grade_steps.set_ramp(session, "linear"),
            "ramp_smooth": lambda: grade_steps.set_ramp(session, "smooth"),
            "ramp_hold": lambda: grade_steps.set_ramp(session, "hold"),
            "pick_pixel": lambda: self._at_pointer(viewer.on_pick),
            "hold_pixel": lambda: self._at_pointer(viewer.on_hold),
            "save_version": lambda: grade_steps.keep_version(session),
            "switch": self._switch,
            "show_after": lambda: session.look(compare="after"),
            "show_before": lambda: session.look(compare="before"),
            "show_wipe": lambda: session.look(compare="wipe"),
            "show_side": lambda: session.look(compare="side"),
            "compare": self._switch,  # the key does so while it is down
            "fit": viewer.fit,
            "one_to_one": lambda: viewer.zoom_to(1.0, viewer.pointer),
            "zoom_in": lambda: viewer.zoom_by(ZOOM, viewer.pointer),
            "zoom_out": lambda: viewer.zoom_by(1 / ZOOM, viewer.pointer),
            "outside": lambda: session.look(outside=not session.view.outside),
            "matte": lambda: session.look(matte=not session.view.matte),
            "brighter": lambda: session.look(
                exposure=min(session.view.exposure + EXPOSURE_STEP, EXPOSURE)
            ),
            "darker": lambda: session.look(
                exposure=max(session.view.exposure - EXPOSURE_STEP, -EXPOSURE)
            ),
            "plain_look": lambda: session.look(exposure=0.0, gamma=1.0),
            "scopes": lambda: window.show_or_hide("scopes"),
            "full_screen": lambda: window.setWindowState(
                window.windowState() ^ Qt.WindowState.WindowFullScreen
            ),
            "play": lambda: session.play(0 if session.playing else 1),
            "stop": lambda: session.play(0),
            "play_forwards": lambda: self._shuttle(1),
            "play_backwards": lambda: self._shuttle(-1),
            "next_frame": lambda: self._step(1),
            "previous_frame": lambda: self._step(-1),
            "ten_on": lambda: self._step(10),
            "ten_back": lambda: self._step(-10),
            "next_handle": lambda: self._to_handle(1),
            "previous_handle": lambda: self._to_handle(-1),
            "go_to_selected": self.go_to_selected,
            "reset_layout": window.reset_layout,
            "first_frame": lambda: session.go(window.playback.span()[0]),
            "last_frame": lambda: session.go(window.playback.span()[1]),
            "mark_in": lambda: session.mark(start=session.frame),
            "mark_out": lambda: session.mark(end=session.frame),
            "clear_marks": session.mark,
        }

    def cancel(self) -> None:
        """Forget a drag; else select nothing."""
        if self.session.dragging or self.session.held:
            self.session.cancel()
        elif self.session.tool:
            self.session.take("")
        elif self.window.isFullScreen():
            self.window.showNormal()
        elif self.session.view.version or self.session.view.after:
            self.session.look(version="", after="", compare="after")
            self.session.say(texts.COMPARED_SOURCE)
        else:
            self.session.select()

    def _switch(self) -> None:
        before = self.session.view.compare == "before"
        self.session.look(compare="after" if before else "before")

    def _set_range(self, start: float | None = None, until: float | None = None) -> None:
        pick = self.session.picked
        if pick is None:
            self.session.say(texts.SELECT_A_PICK, "warning")
            return
        begin, end = grade_steps.range_of(self.session, pick)
        begin, end = begin if start is None else start, end if until is None else until
        if until is not None:
            begin = min(begin, end)
        grade_steps.set_range(self.session, pick.id, begin, max(begin, end))

    def _at_pointer(self, act: Callable[[Any], object] | None) -> None:
        point = self.viewer.pointer
        if point is None or act is None:
            self.session.say(texts.POINT_AT, "warning")
            return
        place = self.viewer.place(point, point)
        if place is not None:
            act(place)

    def use_version(self, number: int) -> None:
        """Use the n-th version."""
        names = self.session.versions
        if number > len(names):
            self.session.say(texts.NO_VERSION.format(number=number), "warning")
        else:
            grade_steps.use_version(self.session, names[number - 1])

    def compare_version(self) -> None:
        """Compare with the next version that differs; after the last with the source."""
        document = self.session.document
        same = () if document is None else document.grade.same_edits
        names = ["", *(name for name in self.session.versions if name not in same)]
        now = self.session.view.version
        at = names.index(now) if now in names else 0
        name = names[(at + 1) % len(names)]
        compare = self.session.view.compare
        self.session.look(version=name, after="", compare=compare if compare != "after" else "wipe")
        if len(names) == 1:
            text = texts.NO_OTHER_VERSION if self.session.versions else texts.NO_VERSIONS
            self.session.say(text, "warning")
        else:
            self.session.say(texts.COMPARED.format(name=name) if name else texts.COMPARED_SOURCE)

    def _shuttle(self, way: int) -> None:
        now = self.session.playing
        self.session.play(way if now * way <= 0 else max(-FASTEST, min(FASTEST, now * 2)))

    def _step(self, frames: int) -> None:
        if self.session.playing:
            self.session.play(0)
        self.session.step(frames)

    def _to_handle(self, way: int) -> None:
        frames = self.handle_frames()[::way]
        beyond = (frame for frame in frames if (frame - self.session.frame) * way > 0)
        if (frame := next(beyond, None)) is not None:
            self.session.go(frame)

    def go_to_selected(self) -> None:
        """Go to the frame of the first selected handle, pick or hold."""
        session, places = self.session, self.window.timeline.places
        picks = {pick.id: pick for pick, _ in places.lanes()}
        for id_ in session.selection:
            found = places.disc(id_) or picks.get(id_)
            if found is not None:
                session.go(found.frame)
                return
        session.say(texts.SELECT_ONE, "warning")

    def handle_frames(self) -> list[int]:
        """Return the frames of vertices and stops, in order."""
        document = self.session.document
        if document is None:
            return []
        times = {float(t) for t in document.grade.core.polytope.vertices[:, 3]}
        times |= {s.frame for s in document.grade.settings.values() if s.frame is not None}
        first, last, _ = document.grade.frames
        return sorted({round(min(max(time, first), last)) for time in times})

    def loop(self) -> None:
        """Begin again at the end, or no more."""
        self.session.loop = not self.session.loop
