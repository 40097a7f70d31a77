"""The session: the open document and clip, where the user is in them, and what he does.

It knows no toolkit. Views call its methods and listen to its events. An edit is a function of a
`Document`, the same that a verb of `palette4d edit` calls, so that both leave the same bytes.
While something is dragged, the edit is tried on a copy; only its last form reaches the document.
"""

import contextlib
import dataclasses
import hashlib
import itertools
import os
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.files import same_file
from palette4d.common.folders import state_folder
from palette4d.grade import edits, later, unread_steps
from palette4d.grade.document import Document, OfClip
from palette4d.grade.edits import Edit as Step
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.grade.later import Readings, Unread
from palette4d.media.clip import Clip, open_clip
from palette4d.media.source_clip import find_clip
from palette4d.studio import texts
from palette4d.studio.display import Display
from palette4d.studio.drafts import Drafts
from palette4d.studio.following import Follower, Job
from palette4d.studio.player import Player

Edit = Callable[[Document], object]
T = TypeVar("T")

#: Seconds between the last edit and its save, and the most while edits go on. More would leave too
#: little of the two seconds within which an edit is on disk.
SAVE_AFTER, SAVE_AT_MOST = 0.1, 1.0
#: Seconds until a save that failed is tried again.
TRY_AGAIN = 5.0


class Session(Drafts):
    """The state that all views share.

    Attributes
    ----------
    document : Document or None
        The document as the views show it: while something is dragged, a copy with the drag's edit.
    player : Player or None
        Reads the clip's frames.
    display : Display or None
        How code values of the clip become colours on the screen.
    revision : int
        Rises with every change of what `document` shows.
    held, waived : bool
        A button of the pointer is down where it drags; Escape took back what it does until then.
    """

    def __init__(self) -> None:
        """Begin without a document."""
        super().__init__()
        self._document: Document | None = None
        self._trial: Document | None = None
        self._dragged: tuple[Edit, str] | None = None
        self._typed: Callable[[], object] | None = None  # keeps a drag that no pointer holds
        self.held = self.waived = False
        self._copy: Path | None = None  # has the edits that could not be saved
        self._real = Path()  # where links led when the file was opened: its disk may go
        self._stamp: tuple[int, int, int] | None = None
        self._edited_at: float | None = None  # the first edit that is not on disk
        self._last_edit = self._next_try = 0.0
        self.player: Player | None = None
        self.display: Display | None = None
        self.revision = 0
        self._follower = Follower(self)
        self._looked_at: tuple[object, object] = (None, None)
        self._left: list[tuple[Grade, Grade, Step]] = []  # what is unread of it

    # -------------------------------------------------------------------------------------- files

    @property
    def document(self) -> Document | None:
        """The document as the views show it."""
        return self._trial or self._document

    @property
    def versions(self) -> tuple[str, ...]:
        """The names of the document's versions."""
        return () if self._document is None else self._document.grade.versions

    @property
    def path(self) -> Path | None:
        """The sidecar's file."""
        return None if self._document is None else self._document.path

    def open_sidecar(self, path: str | os.PathLike[str], clip: str | None = None) -> None:
        """Open a sidecar and its clip; a missing clip is a warning.

        Raises
        ------
        Palette4dError
            The sidecar is unusable, the clip that was named cannot be opened, or the edits of the
            document before cannot be saved.
        """
        document = Document.load(path)
        found = find_clip(Path(path), document.grade.core.clip, clip)
        own = self.path
        self._leave()
        if own is not None and same_file(own, Path(path)):
            document = Document.load(path)  # with the edits that were saved just now
        self._document, self._real = document, Path(os.path.realpath(path))
        self._stamp = _stamp(Path(path))
        first, last, step = document.grade.frames
        self.frame = first + (last - first) // (2 * step) * step
        self._set_clip(found)
        self._changed()
        self.emit("frame")
        if found is None:
            source = document.grade.core.clip["source"] or document.grade.core.clip["name"]
            self.say(texts.CLIP_MISSING.format(source=source), "warning")
        else:
            self.say(self.fit() or texts.OPENED.format(name=Path(path).name))

    def open_clip(self, spec: str, *, frames: str | None = None) -> None:
        """Open a clip without a palette.

        Raises
        ------
        Palette4dError
            The clip cannot be opened, or the edits of the document before cannot be saved.
        """
        found = open_clip(spec, frames=frames, skip_bad_frames=True)
        self._leave()
        self.frame = found.frames[0]
        self._set_clip(found)
        self._changed()
        self.emit("frame")
        self.say(texts.OPENED.format(name=found.name))

    def find_clip(self, spec: str) -> None:
        """Use another clip with the document, where the stored path leads nowhere."""
        self._set_clip(open_clip(spec, skip_bad_frames=True))
        self.emit("frame")
        self.say(self.fit() or texts.OPENED.format(name=Path(spec).name))

    def fit(self) -> str:
        """Return what is odd about the clip for this document: its size, or frames that it lacks.

        Frames of the clip that the document does not have are not shown.
        """
        document, clip = self._document, self.clip
        if document is None or clip is None:
            return ""
        found = []
        width, height = document.grade.core.clip["width"], document.grade.core.clip["height"]
        if (width, height) != (clip.width, clip.height):
            own, other = f"{width}x{height}", f"{clip.width}x{clip.height}"
            found.append(texts.OTHER_SIZE.format(own=own, found=other))
        first, last, step = document.grade.frames
        wanted = range(first, last + 1, step)
        held = {frame for frame in clip.frames if frame in wanted}
        if lacks := len(wanted) - len(held):
            missing = next(frame for frame in wanted if frame not in held)
            found.append(texts.LACKS_FRAMES.format(count=lacks, first=missing))
        return "; ".join(found)

    @property
    def frames(self) -> tuple[int, int, int]:
        """First and last frame and the step: the document's, else the clip's."""
        if self._document is not None:
            return self._document.grade.frames
        if self.clip is not None:
            return self.clip.frames[0], self.clip.frames[-1], max(self.clip.step, 1)
        return 0, 0, 1

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

    def _arrived(self, frame: int) -> None:
        """Tell the views that a frame was read; called by the player's threads."""
        self.post(lambda: self.emit("pixels"))

    def _leave(self) -> None:
        """Close; what cannot be saved stays open, so that nothing is lost."""
        self.keep_typed()
        if self.following:
            raise Palette4dError(texts.STILL_FOLLOWING)
        if not self.saved and not self.save():
            raise Palette4dError(self.status.text)
        self.close()

    def close(self) -> None:
        """Save and close the document and the clip."""
        if self._document is not None:
            self.save()
        if self.player is not None:
            self.player.close()
        self._follower.clear()
        self._document = self._trial = self._dragged = self._typed = None
        self._copy = None
        self.clip = self.player = self._stamp = self.probe = self.hover = self.place = None
        self.selection, self.playing, self.marks = (), 0, None
        self.tool, self.answer = "", None
        # What is opened next is seen as it is graded.
        compare = "after" if self.view.compare == "before" else self.view.compare
        self._edited_at = None
        self.view = dataclasses.replace(self.view, version="", after="", compare=compare)

    # -------------------------------------------------------------------------------------- edits

    def edit(self, operation: Callable[[Document], T], text: str = "") -> T | None:
        """Do an edit, as a verb does it; an error becomes the status, and None is returned."""
        self.keep_typed()
        document = self._document
        if document is None:
            return None
        dragged, self._trial, self._dragged = self.dragging, None, None
        before = document.history.done
        try:
            result = operation(document)
        except (Palette4dError, OSError) as error:
            if dragged:
                self._changed()
            self.report(error)
            return None
        self._note_edit()
        done = document.history.done
        changes = done[-1].changes if done else ()
        forced = [c.id for c in changes if c.kind == "handle" and c.id in document.grade.locks]
        if forced and len(done) > len(before):
            locked = texts.LOCKED_MOVED.format(ids=", ".join(forced))
            self.say(f"{text}; {locked}" if text else locked, "warning")
        elif text:
            self.say(text)
        self._changed()
        return result

    def edit_later(
        self,
        operation: Callable[[Document, OfClip | None, Progress | None], T],
        text: str,
        then: Callable[[T], object] = lambda _: None,
        unread: Unread | None = None,
    ) -> None:
        """Do an edit that reads the clip: at once without that, and complete it in a thread.

        `then` gets the operation's result. `unread` has what is known of the clip.
        """
        self.keep_typed()
        document, clip = self._document, self.clip
        if document is None:
            return
        before, made = document.grade, list[T]()

        def at_once(document: Document) -> Step | None:
            first = None if clip is None else unread or Unread()
            made.append(operation(document, first, None))
            changes = edits.difference(before.state, document.grade.state).undoable().changes
            if clip is None or not changes or document.history.done[-1].changes != changes:
                return None
            document.history = unread_steps.as_unread(document.history)
            return document.history.done[-1]

        step = self.edit(at_once, text)
        if not made:
            return
        then(made[0])
        if clip is not None and step is not None:
            self._follower.add(Job(operation, clip.source, text, before, document.grade, step))

    @property
    def following(self) -> int:
        """How many edits are still reading the clip."""
        return len(self._follower)

    @property
    def unfollowed(self) -> list[str]:
        """The picks that nobody reads the clip for: the program ended, or it could not."""
        document = self._document
        if document is None or self.clip is None or self.following:
            return []
        key = document.grade, document.history
        if any(a is not b for a, b in zip(key, self._looked_at, strict=True)):
            self._looked_at, self._left = key, [*unread_steps.unread(*key)]
        left = [step for _, _, step in self._left]
        return sorted(
            {pick.id for step in left for pick in unread_steps.readers(step, document.grade)}
        )

    def follow(self) -> None:
        """Read the clip for the picks that are `unfollowed`."""
        document, clip = self._document, self.clip
        if document is None or clip is None:
            return
        self._follower.again(
            Job(None, clip.source, texts.FOLLOWED.format(step=step.label), before, after, step)
            for before, after, step in unread_steps.unread(document.grade, document.history)
        )

    def complete(
        self, steps: tuple[Step, Step], readings: Readings, mattes: Mapping[str, str]
    ) -> bool:
        """Put what was found in the clip into a step, and go on with what is being dragged.

        Return whether the step is done: it may have been undone meanwhile.
        """
        document, dragged = self._document, self._dragged
        assert document is not None
        document.grade, document.history = later.completed(
            document.grade, document.history, steps, readings, mattes
        )
        self._note_edit()
        if dragged is None:
            self._changed()
        else:
            self._show(*dragged)
        return any(later.same(step, steps[1]) for step in document.history.done)

    def take_mattes(self, trial: Document) -> None:
        """Have the mattes that were learned for a copy of the document."""
        if self._document is not None:
            own = self._document
            own.grade = own.grade.with_mattes(trial.grade.mattes)

    def drag(
        self, operation: Edit, text: str = "", typed: Callable[[], object] | None = None
    ) -> None:
        """Show an edit without doing it; each call replaces the last.

        `typed` does one that no pointer holds: soon, but before any other edit or save.
        """
        if typed is None and self.held and self.waived:
            return
        if typed is None:
            self.keep_typed()
        self._show(operation, text)
        self._typed = typed

    def keep_typed(self) -> None:
        """Do an edit that was typed and is only shown yet."""
        keep, self._typed = self._typed, None
        if keep is not None and self.dragging:
            keep()

    def _show(self, operation: Edit, text: str) -> None:
        if self._document is None:
            return
        trial = Document(self._document.grade)
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
            self.edit(*self._dragged)

    def cancel(self) -> None:
        """Forget the edit that is being dragged, also if the pointer moves on."""
        self._typed, self.waived = None, self.held
        if self._dragged is not None:
            self._trial = self._dragged = None
            self._changed()

    @property
    def dragging(self) -> bool:
        """Whether something is being dragged."""
        return self._dragged is not None

    def undo(self) -> None:
        """Take the last edit back, and read the clip for what it had replaced."""
        self.edit(lambda document: document.undo(), texts.UNDONE)
        self.follow()

    def redo(self) -> None:
        """Do the last undone edit again."""
        self.edit(lambda document: document.redo(), texts.REDONE)
        self.follow()

    def _changed(self) -> None:
        self.revision += 1
        self.emit("document")

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
        if document is None or document.path is None:
            return
        now = time.monotonic() if now is None else now
        if now < self._next_try:
            return
        due = self._edited_at is not None and (
            now - self._last_edit >= SAVE_AFTER or now - self._edited_at >= SAVE_AT_MOST
        )
        if due:
            self._save(now)
        elif self.saved and not self.dragging and _stamp(document.path) != self._stamp:
            self._reload()

    def save(self) -> bool:
        """Save now; return whether everything is on disk. Errors become the status."""
        self.keep_typed()
        return self._save(time.monotonic())

    def _save(self, now: float) -> bool:
        document = self._document
        if document is None or document.path is None:
            return document is None
        before = document.grade.state
        try:
            document.save()
        except Exception as error:  # whatever fails, the edits stay, and the window says so
            self._next_try = now + TRY_AGAIN
            self._keep_copy(error)
            return False
        self._edited_at = None
        self._stamp = _stamp(document.path)
        if self._copy is not None:
            self._drop_copy()
            self.say(texts.SAVED_NOW)
        if document.grade.state != before:
            self.say(texts.MERGED)
            if self._dragged is None:
                self._changed()
            else:
                self._show(*self._dragged)
        self.emit("status")
        return True

    def _keep_copy(self, error: Exception) -> None:
        """Say why a save failed, and keep the edits in a file of the user's state folder."""
        assert self._document is not None
        assert self._document.path is not None
        try:
            copy = self._copy or next(p for p in recovery_files(self._real) if not p.exists())
            copy.parent.mkdir(parents=True, exist_ok=True)
            self._elsewhere(self._document).save(copy, on_edits="drop")
            self._copy = copy
            kept = texts.KEPT_IN.format(copy=copy)
        except Exception:
            kept = texts.KEPT_HERE
        why = in_words(error) or type(error).__name__
        self.say(f"{texts.NOT_SAVED} {why}. {kept}", "error", "not saved")

    def _drop_copy(self) -> None:
        """Remove the copy of this session, not what another one could not save."""
        if self._copy is not None:
            with contextlib.suppress(OSError):
                self._copy.unlink(missing_ok=True)
        self._copy = None

    @staticmethod
    def _elsewhere(document: Document) -> Document:
        """Return a document to save in another folder: it finds its clip from there."""
        fields = document.fields()
        source = fields["clip"]["source"]
        if source and document.path is not None:
            fields["clip"]["source"] = str(document.path.absolute().parent / source)
        return Document(fields)

    def save_as(self, path: str | os.PathLike[str]) -> bool:
        """Save under another name and go on with that file; return whether it worked."""
        self.keep_typed()
        if self._document is None:
            return False
        try:
            self._elsewhere(self._document).save(path, on_edits="drop")
            loaded = Document.load(path)
        except (Palette4dError, OSError) as error:
            self.report(error)
            return False
        self._document, self._trial, self._dragged, self._typed = loaded, None, None, None
        self._edited_at, self._stamp = None, _stamp(Path(path))
        if self._copy is not None and not same_file(self._copy, Path(path)):
            self._drop_copy()
        self._copy, self._real = None, Path(os.path.realpath(path))
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
        former = None if self._document is None else self._document.grade.core.clip
        self._document, self._trial, self._dragged, self._typed = loaded, None, None, None
        self._stamp, self._edited_at = stamp, None
        clip = loaded.grade.core.clip
        of_clip = ("source", "first", "last")
        if former is not None and all(clip[name] == former[name] for name in of_clip):
            self._find_display()
        else:  # an analysis of another clip or of more frames, or one that was undone
            self._set_clip(find_clip(self.path, clip, None))
        self.say(texts.RELOADED)
        self._changed()
        self.go(self.frame)


def recovery_files(sidecar: Path) -> Iterator[Path]:
    """Yield where edits are kept when the sidecar cannot be written: each session takes another."""
    folder, name = _recovery(sidecar)
    # At most 255 bytes: two names may begin alike, their hashes do not.
    short = os.fsencode(sidecar.name)[-200:].decode("utf-8", "ignore")
    return (folder / f"{name}-{number}-{short}" for number in itertools.count(1))


def recovered(sidecar: Path) -> Path | None:
    """Return the newest edits of a sidecar that could not be saved."""
    kept: list[tuple[int, Path]] = []
    with contextlib.suppress(OSError, RuntimeError):  # no such folder; a user without a home
        folder, name = _recovery(sidecar)
        for path in folder.glob(f"{name}-*"):
            with contextlib.suppress(OSError):  # another session has saved it meanwhile
                if path.is_file():
                    kept.append((path.stat().st_mtime_ns, path))
    return max(kept, default=(0, None))[1]


def _recovery(sidecar: Path) -> tuple[Path, str]:
    """Return the folder of what could not be saved, and how the names of a sidecar's begin."""
    name = hashlib.sha256(os.fsencode(os.path.realpath(sidecar))).hexdigest()[:12]
    return state_folder() / "palette4d" / "recovery", name


def _stamp(path: Path) -> tuple[int, int, int] | None:
    """Return what changes when a file is replaced or written."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
