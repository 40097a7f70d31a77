"""The actions of the menus Edit, Palette, View and Playback.

Each action of `menu_entries.ACTIONS` is a method of its name here, or in `file_menu`, `verb_menu`
or `help_menu`.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt

from palette4d.studio import grade_steps, texts

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
        self.window, self.session, self.viewer = window, window.session, window.viewer

    # ------------------------------------------------------------------------------------ editing

    def undo(self) -> None:
        """Undo."""
        self.session.undo()

    def redo(self) -> None:
        """Redo."""
        self.session.redo()

    def cancel(self) -> None:
        """Forget a drag; else select nothing."""
        if self.session.dragging:
            self.session.cancel()
        elif self.session.tool:
            self.session.take("")
        elif self.window.isFullScreen():
            self.window.showNormal()
        else:
            self.session.select()

    def reset_selected(self) -> None:
        """Reset the selected vertices, remove stops and picks."""
        grade_steps.reset(self.session)

    def reset_all(self) -> None:
        """Reset everything."""
        grade_steps.reset_all(self.session)

    def add_stop(self) -> None:
        """Add a stop to the selected row at the playhead."""
        self.window.timeline.add_stop_at_playhead()

    def lock(self) -> None:
        """Lock or unlock the selected handles."""
        grade_steps.lock(self.session)

    def act_from(self) -> None:
        """Have the selected pick or hold begin at the playhead."""
        self._set_range(start=float(self.session.frame))

    def act_until(self) -> None:
        """Have the selected pick or hold end at the playhead."""
        self._set_range(until=float(self.session.frame))

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

    def ramp_linear(self) -> None:
        """Set the ramp."""
        grade_steps.set_ramp(self.session, "linear")

    def ramp_smooth(self) -> None:
        """Set the ramp."""
        grade_steps.set_ramp(self.session, "smooth")

    def ramp_hold(self) -> None:
        """Set the ramp."""
        grade_steps.set_ramp(self.session, "hold")

    def pick_pixel(self) -> None:
        """Pick the colour under the pointer."""
        self._at_pointer(self.viewer.on_pick)

    def hold_pixel(self) -> None:
        """Hold the colour under the pointer."""
        self._at_pointer(self.viewer.on_hold)

    def _at_pointer(self, act: Callable[[Any], object] | None) -> None:
        point = self.viewer.pointer
        if point is None or act is None:
            self.session.say(texts.POINT_AT, "warning")
            return
        place = self.viewer.place(point, point)
        if place is not None:
            act(place)

    # ----------------------------------------------------------------------------------- versions

    def save_version(self) -> None:
        """Keep the edits as the next version: A, B, C…"""
        grade_steps.keep_version(self.session)

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
        same = () if document is None else document.same_edits()
        names = ["", *(name for name in self.session.versions if name not in same)]
        now = self.session.view.version
        at = names.index(now) if now in names else 0
        name = names[(at + 1) % len(names)]
        compare = self.session.view.compare
        self.session.look(version=name, compare=compare if compare != "after" else "wipe")
        if len(names) == 1:
            text = texts.NO_OTHER_VERSION if self.session.versions else texts.NO_VERSIONS
            self.session.say(text, "warning")
        else:
            self.session.say(texts.COMPARED.format(name=name) if name else texts.COMPARED_SOURCE)

    # --------------------------------------------------------------------------------------- view

    def show_after(self) -> None:
        """Show the picture after."""
        self.session.look(compare="after")

    def show_before(self) -> None:
        """Show the picture before."""
        self.session.look(compare="before")

    def show_wipe(self) -> None:
        """Show both, divided by a line."""
        self.session.look(compare="wipe")

    def show_side(self) -> None:
        """Show both."""
        self.session.look(compare="side")

    def compare(self) -> None:
        """Show the other picture; the key does so while it is down."""
        after = self.session.view.compare != "before"
        self.session.look(compare="before" if after else "after")

    def fit(self) -> None:
        """Show the whole frame."""
        self.viewer.fit()

    def one_to_one(self) -> None:
        """Show a pixel of the frame as a pixel of the screen."""
        self.viewer.zoom_to(1.0, self.viewer.pointer)

    def zoom_in(self) -> None:
        """Zoom in."""
        self.viewer.zoom_by(ZOOM, self.viewer.pointer)

    def zoom_out(self) -> None:
        """Zoom out."""
        self.viewer.zoom_by(1 / ZOOM, self.viewer.pointer)

    def outside(self) -> None:
        """Mark colours outside of the palette."""
        self.session.look(outside=not self.session.view.outside)

    def matte(self) -> None:
        """Show the matte of the selected pick, or no more."""
        self.session.look(matte=not self.session.view.matte)

    def brighter(self) -> None:
        """Raise the exposure."""
        self.session.look(exposure=min(self.session.view.exposure + EXPOSURE_STEP, EXPOSURE))

    def darker(self) -> None:
        """Lower the exposure."""
        self.session.look(exposure=max(self.session.view.exposure - EXPOSURE_STEP, -EXPOSURE))

    def plain_look(self) -> None:
        """Reset exposure and gamma."""
        self.session.look(exposure=0.0, gamma=1.0)

    def full_screen(self) -> None:
        """Fill the screen, or no more."""
        self.window.setWindowState(self.window.windowState() ^ Qt.WindowState.WindowFullScreen)

    # ----------------------------------------------------------------------------------- playback

    def play(self) -> None:
        """Play or stop."""
        self.session.play(0 if self.session.playing else 1)

    def stop(self) -> None:
        """Stop."""
        self.session.play(0)

    def play_forwards(self) -> None:
        """Play forwards; again: faster."""
        self._shuttle(1)

    def play_backwards(self) -> None:
        """Play backwards; again: faster."""
        self._shuttle(-1)

    def _shuttle(self, way: int) -> None:
        now = self.session.playing
        self.session.play(way if now * way <= 0 else max(-FASTEST, min(FASTEST, now * 2)))

    def next_frame(self) -> None:
        """Go one frame on."""
        self._step(1)

    def previous_frame(self) -> None:
        """Go one frame back."""
        self._step(-1)

    def ten_on(self) -> None:
        """Go ten frames on."""
        self._step(10)

    def ten_back(self) -> None:
        """Go ten frames back."""
        self._step(-10)

    def _step(self, frames: int) -> None:
        if self.session.playing:
            self.session.play(0)
        self.session.step(frames)

    def next_handle(self) -> None:
        """Go to the next frame with a handle."""
        later = [frame for frame in self.handle_frames() if frame > self.session.frame]
        if later:
            self.session.go(later[0])

    def previous_handle(self) -> None:
        """Go to the frame with a handle before."""
        earlier = [frame for frame in self.handle_frames() if frame < self.session.frame]
        if earlier:
            self.session.go(earlier[-1])

    def handle_frames(self) -> list[int]:
        """Return the frames of vertices and stops, in order."""
        document = self.session.document
        if document is None:
            return []
        times = {float(t) for t in document.core.polytope.vertices[:, 3]}
        times |= {s.frame for s in document.settings.values() if s.frame is not None}
        first, last, _ = document.frames
        return sorted({round(min(max(time, first), last)) for time in times})

    def first_frame(self) -> None:
        """Go to the first frame, or to the in point."""
        self.session.go(self.window.playback.span()[0])

    def last_frame(self) -> None:
        """Go to the last frame, or to the out point."""
        self.session.go(self.window.playback.span()[1])

    def mark_in(self) -> None:
        """Set the in point."""
        self.session.mark(start=self.session.frame)

    def mark_out(self) -> None:
        """Set the out point."""
        self.session.mark(end=self.session.frame)

    def clear_marks(self) -> None:
        """Remove in and out point."""
        self.session.mark()

    def loop(self) -> None:
        """Begin again at the end, or no more."""
        self.session.loop = not self.session.loop
