"""The session: the open document and clip, where the user is in them, and what he does.

It knows no toolkit. Views call its methods and listen to its events. An edit is a function of a
`Document`, the same that a verb of `palette4d edit` calls, so that both leave the same bytes.
While something is dragged, the edit is tried on a copy; only its last form reaches the document.
"""

import contextlib
import dataclasses
import hashlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

from palette4d.common.errors import Palette4dError, in_words
from palette4d.grade.document import Document
from palette4d.grade.follow import Progress
from palette4d.media.clip import Clip, open_clip
from palette4d.media.source_clip import find_clip
from palette4d.studio import texts
from palette4d.studio.display import Display, Look
from palette4d.studio.player import Player
from palette4d.studio.states import Place, Probe, Status, View

Event = Literal[
    "document",  # the palette or its edits, also of every step of a drag
    "clip",  # another clip, or none
    "frame",
    "pixels",  # the frame's pixels have arrived, or the reason why they cannot
    "selection",
    "hover",
    "probe",
    "view",
    "wipe",  # the wipe alone has moved
    "playing",
    "range",
    "status",
]
Edit = Callable[[Document], object]
T = TypeVar("T")

#: Seconds between the last edit and its save, and the most while edits go on.
SAVE_AFTER, SAVE_AT_MOST = 0.4, 1.5
#: Seconds until a save that failed is tried again.
TRY_AGAIN = 5.0


class Session:
    """The state that all views share.

    Attributes
    ----------
    document : Document or None
        The document; while something is dragged, a copy with the drag's edit.
    clip : Clip or None
        The clip; None if it was not found.
    player : Player or None
        Reads the clip's frames.
    display : Display or None
        How code values of the clip become colours on the screen.
    frame : int
        The playhead.
    selection : tuple of str
        The ids of the selected vertices, stops and edges.
    hover : str or None
        The handle or palette colour under the pointer.
    probe : Probe or None
        The pixel under the pointer.
    place : Place or None
        The pixel or box that was clicked, and is not picked yet.
    view : View
        How the picture is shown.
    playing : int
        Frames a step of the playback: 0 stands, 1 plays, -1 plays backwards, 2 is twice as fast.
    marks : (int, int) or None
        In and out point.
    loop : bool
        Whether playing begins again at the end.
    status : Status
        What the last action did.
    post : callable
        Runs a function on the views' thread; the window sets it.
    later : callable
        Runs a panel's function soon, when the picture is shown; the window sets it.
    """

    def __init__(self) -> None:
        """Begin without a document."""
        self._document: Document | None = None
        self._trial: Document | None = None
        self._dragged: tuple[Edit, str] | None = None
        self._callbacks: dict[str, list[tuple[Callable[[], object], bool]]] = {}
        self._stamp: tuple[int, int, int] | None = None
        self._edited_at: float | None = None  # the first edit that is not on disk
        self._last_edit = self._next_try = 0.0
        self.clip: Clip | None = None
        self.player: Player | None = None
        self.display: Display | None = None
        self.frame = 0
        self.selection: tuple[str, ...] = ()
        self.hover: str | None = None
        self.probe: Probe | None = None
        self.place: Place | None = None
        self.view = View()
        self.playing = 0
        self.marks: tuple[int, int] | None = None
        self.loop = True
        self.status = Status()
        self.revision = 0  #: rises with every change of what `document` shows
        self.post: Callable[[Callable[[], object]], object] = lambda call: call()
        self.later: Callable[[Callable[[], object]], object] = lambda call: call()

    # ------------------------------------------------------------------------------------- events

    def on(self, event: Event, callback: Callable[[], object], *, panel: bool = False) -> None:
        """Call a function after every event of this kind.

        A panel is told later while something is dragged or frames go by: the picture comes first.
        """
        self._callbacks.setdefault(event, []).append((callback, panel))

    def emit(self, event: Event) -> None:
        """Tell the views."""
        moving = event == "frame" or (event == "document" and self.dragging)
        for callback, panel in tuple(self._callbacks.get(event, ())):
            if panel and moving:
                self.later(callback)
            else:
                callback()

    def say(self, text: str, level: Literal["info", "warning", "error"] = "info") -> None:
        """Set the status."""
        self.status = Status(text, level)
        self.emit("status")

    def report(self, error: Exception) -> None:
        """Show an error as the status."""
        self.say(in_words(error), "error")

    # -------------------------------------------------------------------------------------- files

    @property
    def document(self) -> Document | None:
        """The document as the views show it."""
        return self._trial or self._document

    @property
    def versions(self) -> tuple[str, ...]:
        """The names of the document's versions."""
        return () if self._document is None else self._document.versions

    @property
    def path(self) -> Path | None:
        """The sidecar's file."""
        return None if self._document is None else self._document.path

    def open_sidecar(self, path: str | os.PathLike[str], clip: str | None = None) -> None:
        """Open a sidecar and its clip; a missing clip is a warning.

        Raises
        ------
        Palette4dError
            The sidecar is unusable, or the clip that was named cannot be opened.
        """
        document = Document.load(path)
        found = find_clip(Path(path), document.core.clip, clip)
        self.close()
        self._document = document
        self._stamp = _stamp(Path(path))
        first, last, step = document.frames
        self.frame = first + (last - first) // (2 * step) * step
        self._set_clip(found)
        self._changed()
        self.emit("frame")
        if found is None:
            source = document.core.clip["source"] or document.core.clip["name"]
            self.say(texts.CLIP_MISSING.format(source=source), "warning")
        else:
            self.say(self._fit() or texts.OPENED.format(name=Path(path).name))

    def open_clip(self, spec: str, *, frames: str | None = None) -> None:
        """Open a clip without a palette.

        Raises
        ------
        Palette4dError
            The clip cannot be opened.
        """
        found = open_clip(spec, frames=frames, skip_bad_frames=True)
        self.close()
        self.frame = found.frames[0]
        self._set_clip(found)
        self._changed()
        self.emit("frame")

    def find_clip(self, spec: str) -> None:
        """Use another clip with the document, where the stored path leads nowhere."""
        self._set_clip(open_clip(spec, skip_bad_frames=True))
        self.emit("frame")
        self.say(self._fit() or texts.OPENED.format(name=Path(spec).name))

    def _fit(self) -> str:
        """Return what is odd about the clip for this document."""
        if self._document is None or self.clip is None:
            return ""
        from palette4d.grade.rendering import mismatches

        return "; ".join(mismatches(self._document, self.clip, True))

    def _set_clip(self, clip: Clip | None) -> None:
        if self.player is not None:
            self.player.close()
        self.clip = clip
        self.player = None if clip is None else Player(clip, self._arrived)
        self.marks = None
        self._find_display()
        self.emit("clip")

    def _find_display(self) -> None:
        """Choose the display for the clip's encoding; it stays if the encoding does."""
        encoding = "unknown" if self.clip is None else self.clip.encoding
        found = Display.wanted(self._document, encoding)
        if self.display is None or (self.display.space, self.display.asked) != found:
            self.display = Display(*found)

    @property
    def looked(self) -> Look:
        """The display, view, exposure and gamma of `view`."""
        view = self.view
        return Look(view.display, view.view, view.exposure, view.gamma)

    def _arrived(self, frame: int) -> None:
        """Tell the views that a frame was read; called by the player's threads."""
        self.post(lambda: self.emit("pixels"))

    def close(self) -> None:
        """Save and close the document and the clip."""
        if self._document is not None:
            self.save()
        if self.player is not None:
            self.player.close()
        self._document = self._trial = self._dragged = None
        self.clip = self.player = self._stamp = self.probe = self.hover = self.place = None
        self.selection, self.playing, self.marks = (), 0, None
        self._edited_at, self.view = None, dataclasses.replace(self.view, version="")

    # -------------------------------------------------------------------------------------- edits

    def edit(self, operation: Callable[[Document], T], text: str = "") -> T | None:
        """Do an edit, as a verb does it; an error becomes the status, and None is returned."""
        if self._document is None:
            return None
        self.cancel()
        try:
            result = operation(self._document)
        except (Palette4dError, OSError) as error:
            self.report(error)
            return None
        self._note_edit()
        if text:
            self.say(text)
        self._changed()
        return result

    def edit_later(
        self,
        operation: Callable[[Document, Progress], T],
        text: str,
        then: Callable[[T], object] = lambda _: None,
    ) -> None:
        """Do an edit that reads the clip: in a thread on a copy, and then here.

        What is being dragged stays visible until then. `then` gets the operation's result.
        """
        document = self._document
        if document is None:
            return
        trial = document.trial()

        def say(done: int, total: int) -> None:
            words = texts.FOLLOWING.format(done=done, total=total)
            self.post(lambda: self.say(words))

        def finish(result: T) -> None:
            if self._document is document:
                self.edit(repeat, text)
                then(result)

        def repeat(own: Document) -> None:
            for step in trial.history:
                own.apply(step)

        def fail(error: Exception) -> None:
            self.cancel()
            self._changed()  # a view may show what was wanted
            self.report(error)

        def work() -> None:
            try:
                result = operation(trial, say)
            except Exception as error:  # whatever fails, the window stays
                failed = error
                self.post(lambda: fail(failed))
            else:
                self.post(lambda: finish(result))

        threading.Thread(target=work, name="palette4d edit", daemon=True).start()

    def drag(self, operation: Edit, text: str = "") -> None:
        """Show an edit without doing it; each call replaces the last."""
        if self._document is None:
            return
        trial = self._document.trial()
        try:
            operation(trial)
        except (Palette4dError, OSError) as error:
            self.report(error)
            return
        self._trial, self._dragged = trial, (operation, text)
        self._changed()

    def drop(self) -> None:
        """Do the edit that was dragged last."""
        if self._dragged is not None:
            operation, text = self._dragged
            self._trial = self._dragged = None
            self.edit(operation, text)

    def cancel(self) -> None:
        """Forget the edit that is being dragged."""
        if self._trial is not None:
            self._trial = self._dragged = None
            self._changed()

    @property
    def dragging(self) -> bool:
        """Whether something is being dragged."""
        return self._trial is not None

    def undo(self) -> None:
        """Take the last edit back."""
        self.edit(lambda document: document.undo(), texts.UNDONE)

    def redo(self) -> None:
        """Do the last undone edit again."""
        self.edit(lambda document: document.redo(), texts.REDONE)

    def _changed(self) -> None:
        self.revision += 1
        self.emit("document")

    # --------------------------------------------------------------------------------- where he is

    @property
    def frames(self) -> tuple[int, int, int]:
        """First and last frame and the step: the document's, else the clip's."""
        if self._document is not None:
            return self._document.frames
        if self.clip is not None:
            return self.clip.frames[0], self.clip.frames[-1], max(self.clip.step, 1)
        return 0, 0, 1

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
            self.selection, self.place = ids, None
            self.emit("selection")

    def begin_pick(self, place: Place) -> None:
        """Inspect a pixel that was clicked; nothing else is selected."""
        self.selection, self.place = (), place
        self.emit("selection")

    def hover_over(self, id: str | None) -> None:
        """Tell which handle or palette colour is under the pointer."""
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

    # ------------------------------------------------------------------------------------- saving

    @property
    def saved(self) -> bool:
        """Whether everything is on disk."""
        return self._document is None or not self._document.changed

    def _note_edit(self) -> None:
        now = time.monotonic()
        self._last_edit = now
        if self._edited_at is None:
            self._edited_at = now

    def tick(self, now: float | None = None) -> None:
        """Save what is due, and take over what another program wrote; call it often."""
        document = self._document
        if document is None or document.path is None or self._dragged is not None:
            return
        now = time.monotonic() if now is None else now
        if now < self._next_try:
            return
        due = self._edited_at is not None and (
            now - self._last_edit >= SAVE_AFTER or now - self._edited_at >= SAVE_AT_MOST
        )
        if due:
            self.save(now)
        elif self._edited_at is None and _stamp(document.path) != self._stamp:
            self._reload()

    def save(self, now: float | None = None) -> bool:
        """Save now; return whether everything is on disk. Errors become the status."""
        document = self._document
        if document is None or document.path is None:
            return document is None
        before = document.state
        try:
            document.save()
        except (Palette4dError, OSError) as error:
            self._next_try = (time.monotonic() if now is None else now) + TRY_AGAIN
            self._keep_copy(error)
            return False
        self._edited_at = None
        self._stamp = _stamp(document.path)
        with contextlib.suppress(OSError):
            recovery_file(document.path).unlink(missing_ok=True)
        if document.state != before:
            self.say(texts.MERGED)
            self._changed()
        self.emit("status")
        return True

    def _keep_copy(self, error: Exception) -> None:
        """Say why a save failed, and keep the edits in a file of the user's state folder."""
        assert self._document is not None
        assert self._document.path is not None
        copy = recovery_file(self._document.path)
        try:
            copy.parent.mkdir(parents=True, exist_ok=True)
            self._document.trial().save(copy, on_edits="drop")
            kept = texts.KEPT_IN.format(copy=copy)
        except (Palette4dError, OSError):
            kept = texts.KEPT_HERE
        self.say(f"{texts.NOT_SAVED} {in_words(error)}. {kept}", "error")

    def save_as(self, path: str | os.PathLike[str]) -> bool:
        """Save under another name and go on with that file; return whether it worked."""
        if self._document is None:
            return False
        try:
            document = Document(self._document.fields())
            document.save(path, on_edits="drop")
            loaded = Document.load(path)
        except (Palette4dError, OSError) as error:
            self.report(error)
            return False
        self._document, self._trial, self._dragged = loaded, None, None
        self._edited_at, self._stamp = None, _stamp(Path(path))
        self.say(texts.SAVED_AS.format(name=Path(path).name))
        self._changed()
        return True

    def revert(self) -> None:
        """Drop what is not on disk, and load the file again."""
        if self.path is not None:
            self._reload()

    def _reload(self) -> None:
        """Take over the file that another program wrote."""
        assert self.path is not None
        stamp = _stamp(self.path)
        try:
            loaded = Document.load(self.path)
        except (Palette4dError, OSError) as error:
            # What the user sees stays; nothing is written until he edits again.
            self._stamp = stamp
            self.say(f"{texts.BROKEN} {in_words(error)}", "error")
            return
        self._document, self._trial, self._dragged = loaded, None, None
        self._stamp, self._edited_at = stamp, None
        self._find_display()
        self.say(texts.RELOADED)
        self._changed()


def recovery_file(sidecar: Path) -> Path:
    """Return where edits are kept when the sidecar cannot be written."""
    state = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    name = hashlib.sha256(os.path.realpath(sidecar).encode()).hexdigest()[:12]
    return Path(state) / "palette4d" / "recovery" / f"{name}-{sidecar.name}"


def _stamp(path: Path) -> tuple[int, int, int] | None:
    """Return what changes when a file is replaced or written."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
