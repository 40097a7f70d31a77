"""Where the user is in a document, and how it is shown. It knows no toolkit."""

import dataclasses
from abc import ABC, abstractmethod
from typing import Any, Literal

from palette4d.grade.answer import Answer
from palette4d.media.clip import Clip
from palette4d.studio.display import Look
from palette4d.studio.session_events import Events
from palette4d.studio.states import Place, Probe, View

Tool = Literal["", "add", "hold", "here"]


class SessionView(Events, ABC):
    """The playhead, the selection, the pointer and the look: nothing of it changes the grade.

    Attributes
    ----------
    clip : Clip or None
        The clip; None if it was not found.
    frame : int
        The playhead.
    selection : tuple of str
        The ids of the selected vertices, stops, edges, picks and holds.
    hover : str or None
        The handle, palette colour or pick under the pointer.
    probe : Probe or None
        The pixel under the pointer.
    place : Place or None
        The pixel or box that was clicked, and is not picked yet.
    tool : str
        What a drag in the picture does: "" picks, "add" adds to the selected pick, "hold" holds,
        "here" says where the selected pick is in this frame.
    answer : Answer or None
        What the selected pick takes of its frame; None until that is known.
    view : View
        How the picture is shown.
    playing : int
        Frames a step of the playback: 0 stands, 1 plays, -1 plays backwards, 2 is twice as fast.
    marks : (int, int) or None
        In and out point.
    loop : bool
        Whether playing begins again at the end.
    """

    def __init__(self) -> None:
        """Begin without a clip."""
        super().__init__()
        self.clip: Clip | None = None
        self.frame = 0
        self.selection: tuple[str, ...] = ()
        self.hover: str | None = None
        self.probe: Probe | None = None
        self.place: Place | None = None
        self.tool: Tool = ""
        self.answer: Answer | None = None
        self.view = View()
        self.playing = 0
        self.marks: tuple[int, int] | None = None
        self.loop = True

    @property
    @abstractmethod
    def frames(self) -> tuple[int, int, int]:
        """First and last frame and the step."""

    def go(self, frame: float) -> None:
        """Move the playhead to the frame nearest to a time."""
        first, last, step = self.frames
        nearest = first + round((min(max(frame, first), last) - first) / step) * step
        if nearest != self.frame:
            self.frame = min(nearest, last)
            self.emit("frame")

    def step(self, frames: int) -> None:
        """Move the playhead by so many frames."""
        self.go(self.frame + frames * self.frames[2])

    def play(self, speed: int) -> None:
        """Play, or stop with 0."""
        self.playing = speed if self.clip is not None else 0
        self.emit("playing")

    def mark(self, start: int | None = None, end: int | None = None) -> None:
        """Set the in point, the out point, or both; without either, remove them."""
        first, last, _ = self.frames
        before = self.marks or (first, last)
        if start is None and end is None:
            self.marks = None
        elif end is None:
            assert start is not None
            self.marks = (start, max(before[1], start))
        else:
            self.marks = (min(before[0] if start is None else start, end), end)
        self.emit("range")

    def select(self, *ids: str) -> None:
        """Select handles or palette colours; a pixel that was clicked is forgotten."""
        if ids != self.selection or self.place is not None:
            self.selection, self.place, self.answer = ids, None, None
            self.take("")
            self.emit("selection")

    def begin_pick(self, place: Place) -> None:
        """Inspect a pixel that was clicked; nothing else is selected."""
        self.selection, self.place, self.answer = (), place, None
        self.take("")
        self.emit("selection")

    def take(self, tool: Tool) -> None:
        """Choose what a drag in the picture does."""
        if tool != self.tool:
            self.tool = tool
            self.emit("tool")

    def show_answer(self, answer: Answer | None) -> None:
        """Tell what the selected pick takes."""
        self.answer = answer
        self.emit("answer")

    def hover_over(self, id: str | None) -> None:
        """Tell which handle, palette colour or pick is under the pointer."""
        if id != self.hover:
            self.hover = id
            self.emit("hover")

    def show_probe(self, probe: Probe | None) -> None:
        """Tell which pixel is under the pointer."""
        if probe != self.probe:
            self.probe = probe
            self.emit("probe")

    def look(self, **changes: Any) -> None:
        """Change how the picture is shown: the attributes of `View`."""
        before, self.view = self.view, dataclasses.replace(self.view, **changes)
        if before != self.view:
            self.emit(
                "wipe" if before == dataclasses.replace(self.view, wipe=before.wipe) else "view"
            )

    @property
    def looked(self) -> Look:
        """The display, view, exposure and gamma of `view`."""
        view = self.view
        return Look(view.display, view.view, view.exposure, view.gamma)
