"""The document: a grade, the steps that led to it, and its file.

It is loaded, edited, applied and saved. Edits are the functions of `handle_edits`, `pick_edits`,
`versions` and `copying`: each takes a grade and gives the grade after it, which becomes a step.
"""

import contextlib
import os
from collections.abc import Generator, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeVar, Unpack

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.files import beside, link_target, same_file
from palette4d.common.locking import locked
from palette4d.common.text import counted
from palette4d.grade import (
    answer,
    copying,
    edits,
    handle_edits,
    pick_edits,
    reanalysis,
    recolouring,
    sidecar,
    unread_steps,
    versions,
)
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.correspondence import Time
from palette4d.grade.edits import Edit
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.grade.handle_edits import How
from palette4d.grade.history import File, History, merged
from palette4d.grade.members import Fields, bounded, history_of
from palette4d.grade.palette import Near
from palette4d.grade.pick_edits import Asked, When, Where
from palette4d.grade.picks import Area, Pick
from palette4d.grade.recolouring import F32
from palette4d.grade.sidecar import OnEdits

PathLike = str | os.PathLike[str]
#: A clip, or what stands for it.
OfClip = PathLike | ClipOfPicks
Made = TypeVar("Made")


class Document:
    """A clip's palette with its edits.

    Get one with `palette4d.load` or `palette4d.analyze`. Colours are three code values of the
    palette or "#rrggbb"; 0..1 is the usual range, and any finite value is allowed. Integers of 8
    bits or more, such as 255 128 0, are refused unless `any_value` is true. Frames are the clip's
    frame numbers; fractions are times between frames. A method that fails raises `Palette4dError`
    and changes nothing.

    Parameters
    ----------
    content : mapping or Grade
        The members of a sidecar (docs/sidecar.md), or a grade.
    notes : iterable of str
        Notes of the analysis about the palette.
    report : mapping, optional
        Figures of the analysis, as `palette4d analyze --json` prints them.

    Attributes
    ----------
    grade : Grade
        The palette and its edits, as they are now: a value that never changes.
    history : History
        The steps that led there.
    notes : tuple of str
        As above.
    report : dict
        As above; empty for a loaded sidecar.
    """

    def __init__(
        self,
        content: Mapping[str, Any] | Grade,
        notes: Iterable[str] = (),
        report: Mapping[str, Any] | None = None,
    ) -> None:
        if isinstance(content, Grade):
            self.grade, self.history = content, History()
        else:
            core, _ = _core.encode_sidecar(content, "<document>")
            fields = sidecar.up_to_date(_core.plain(content))
            self.grade, self.history = _read(core, fields, None)
        self._file: File | None = None
        self.notes = tuple(notes)
        self.report = dict(report or {})

    @classmethod
    def load(cls, path: PathLike, *, version: str = "") -> "Document":
        """Load a sidecar (*.p4d.json), or a version in it (`Document.version`).

        Raises
        ------
        SidecarError
            There is no such file, or it is unusable.
        Palette4dError
            There is no such version.
        """
        data = sidecar.read_bytes(path)
        grade, history = _read(*sidecar.decoded(data, os.fspath(path)), Path(path))
        document = cls(grade)
        document._saved(grade, history, data)
        return document.version(version)

    def _saved(self, grade: Grade, history: History, data: bytes) -> None:
        self.grade, self.history = grade, history
        self._file = File(data, grade.state, history)

    def __repr__(self) -> str:
        """Return one line: the clip, its frames, and the numbers of edits."""
        grade, (first, last, _) = self.grade, self.grade.frames
        return (
            f"<Document {grade.members['clip']['name']!r}: frames {first} to {last}, "
            f"{counted(len(grade.handles.vertices), 'vertex', 'vertices')}, "
            f"{counted(len(grade.active), 'edit')}>"
        )

    # -------------------------------------------------------------------------------------- steps

    def apply(self, edit: Edit) -> None:
        """Apply an edit as one step, which `undo` reverts; an edit without change is no step.

        Versions that it makes are no part of the step: they stay when it is undone.
        """
        self._take(self.grade.after(edit))

    def _take(self, after: Grade) -> None:
        """Go on with the grade after an edit; what it changes is one step."""
        step = edits.difference(self.grade.state, after.state, after.label).undoable()
        self.grade, self.history = after, self.history.with_step(step)

    def _made(self, edit: tuple[Grade, Made]) -> Made:
        """Go on with the grade after an edit; return what it made."""
        after, made = edit
        self._take(after)
        return made

    @contextlib.contextmanager
    def one_step(self, label: str) -> Generator[None]:
        """Make all edits in a ``with`` block one step; an error in it reverts them all."""
        grade, history = self.grade, self.history
        try:
            yield
        except BaseException:
            self.grade, self.history = grade, history
            raise
        after, self.grade, self.history = self.grade, grade, history
        self._take(after.labelled(label))

    def undo(self) -> Edit:
        """Revert the last step, and return it. Steps of earlier sessions can be reverted too."""
        self.grade, self.history, step = self.history.back(self.grade)
        return step

    def redo(self) -> Edit:
        """Apply the last undone step again, and return it."""
        self.grade, self.history, step = self.history.forth(self.grade)
        return step

    def forget_history(self) -> None:
        """Drop all steps, done and undone; the edits stay."""
        self.history = History()

    # ------------------------------------------------------------------------------------ handles

    def set(self, id: str, *, rgb: Iterable[float] | str, any_value: bool = False) -> None:
        """Set the colour of a vertex or a stop."""
        new = self.grade.checked(rgb, any_value)
        self._take(handle_edits.set_colour(self.grade, id, new))

    def stop(
        self, edge: str, *, frame: float, rgb: Iterable[float] | str, any_value: bool = False
    ) -> str:
        """Set the colour of an edge at a time by a colour stop; return the stop's id.

        An existing stop at that time gets the colour.
        """
        new = self.grade.checked(rgb, any_value)
        return self._made(handle_edits.stop(self.grade, edge, frame, new))

    def set_near(
        self,
        near: Iterable[float] | str,
        *,
        frame: float,
        anyway: bool = False,
        id: str | None = None,
        **how: Unpack[How],
    ) -> Near:
        """Change the palette colour nearest to a given colour at a frame.

        The stop at that time moves, or a vertex less than a frame step away, so that the colour at
        the frame is exactly the new one. Otherwise a stop is added.

        Parameters
        ----------
        near : 3 floats or "#rrggbb"
            The visible colour, after the edits so far.
        frame : float
            The time; within the clip.
        anyway : bool
            Edit the palette colour even if it is more than 0.25 away.
        id : str, optional
            The palette colour, of `Palette.ids` at the frame: several may have nearly one colour.
        **how
            The change, as in `adjust`: ``rgb=``, or others; ``any_value=``.

        Returns
        -------
        Near
            The palette colour and its distance; `handle` is the vertex or stop that now has the
            colour, or None after the change of a range.

        Raises
        ------
        Palette4dError
            The nearest palette colour is more than 0.25 away; the message names the palette colours
            that `near` is mixed from.
        """
        return self._made(
            handle_edits.set_near(self.grade, near, frame=frame, anyway=anyway, id=id, **how)
        )

    def move(self, stop: str, *, frame: float) -> None:
        """Move a stop in time, within its edge."""
        self._take(handle_edits.move(self.grade, stop, frame))

    def adjust(
        self,
        id: str | None = None,
        *,
        track: bool = False,
        frame: float | None = None,
        **how: Unpack[How],
    ) -> tuple[str, ...]:
        """Move the colours of a handle, of a track or of the whole palette, as one step.

        Give either `rgb`, or `by`, or some of `hue`, `chroma` and `lightness`.

        Parameters
        ----------
        id : str, optional
            A vertex, a stop, or an edge with its `frame`; None: the whole palette.
        track : bool
            Move every handle along the colour's way: back to all colours that it comes from, and on
            to all that it becomes. A range implies it.
        frame : float, optional
            The frame at which an edge's colour is meant.
        **how
            The change, and when: the keywords of `palette4d.grade.handle_edits.How`.

        Returns
        -------
        tuple of str
            The vertices and stops that changed.
        """
        return self._made(handle_edits.adjust(self.grade, id, track=track, frame=frame, **how))

    def reset(self, id: str | None = None) -> None:
        """Reset a vertex to its original colour, remove a stop, or (None) reset everything.

        Everything: handles, picks, locks and the clip's ramp. Versions stay.
        """
        self._take(handle_edits.reset(self.grade, id))

    def set_ramp(self, ramp: str, id: str | None = None) -> None:
        """Set the ramp from a vertex or stop to the next handle in time, or the clip's ramp.

        Parameters
        ----------
        ramp : {"linear", "smooth", "step"}
            Linear; the monotone cubic without overshoot; the handle's edit up to the next handle.
        id : str, optional
            The vertex or stop; None: all handles without a ramp of their own.
        """
        self._take(handle_edits.set_ramp(self.grade, ramp, id))

    def lock(self, *ids: str, locked: bool = True) -> None:
        """Keep vertices and stops where they are: moves of tracks and of the palette leave them.

        `locked` False lets them move again.
        """
        self._take((handle_edits.lock if locked else handle_edits.unlock)(self.grade, *ids))

    def pick(
        self,
        frame: float,
        *,
        clip: OfClip | None = None,
        progress: Progress | None = None,
        **asked: Unpack[Asked],
    ) -> Pick:
        """Change a thing's colour into another one, and nothing else.

        Which colours are the thing's is learned from the frame and from a few further frames of the
        clip: what is connected with the picked place is the thing (docs/grading.md).

        Parameters
        ----------
        frame : float
            Where the colour is picked.
        clip : path, optional
            The clip; default: the sidecar's. Without a clip the pick takes all of its hue.
        progress : callable, optional
            Called as progress(done, total) while frames are read.
        **asked
            The place, the change, when, and what it takes: the keywords of
            `palette4d.grade.pick_edits.Asked`.

        Returns
        -------
        Pick
            With its id and its path.

        Raises
        ------
        Palette4dError
            A value is out of range, or the clip does not fit.
        """
        own = self._clip(clip)
        return self._made(pick_edits.pick(self.grade, own, frame, progress, **asked))

    def hold(
        self,
        frame: float,
        *,
        clip: OfClip | None = None,
        progress: Progress | None = None,
        **asked: Unpack[When],
    ) -> Pick:
        """Keep the colour of an object as it is, whatever picks and handles do; as `pick`."""
        own = self._clip(clip)
        return self._made(pick_edits.hold(self.grade, own, frame, progress, **asked))

    def correct_path(
        self,
        id: str,
        frame: float,
        *,
        clip: OfClip | None = None,
        progress: Progress | None = None,
        **where: Unpack[Where],
    ) -> Pick:
        """Say where the colour of a pick or hold is at another frame; it is followed again.

        Between two given frames the path goes gradually from what follows the one to what follows
        the other.
        """
        own = self._clip(clip)
        self._take(pick_edits.correct_path(self.grade, own, id, frame, progress, **where))
        return self.grade.pick(id)

    def add_area(self, id: str, area: Area, *, clip: OfClip | None = None) -> Pick:
        """Add a box or a stroke of a frame to the object of a pick or hold; it is learned again."""
        self._take(pick_edits.add_area(self.grade, self._clip(clip), id, area))
        return self.grade.pick(id)

    def set_window(
        self,
        id: str,
        frame: float | None,
        box: Iterable[float] | None,
        *,
        feather: float | None = None,
        inverted: bool | None = None,
        follow: bool = True,
        clip: OfClip | None = None,
        progress: Progress | None = None,
    ) -> Pick:
        """Limit a pick to a box: beyond it the change fades out over `feather` pixels.

        The box moves with what is in it, within the pick's range, and keeps its size. More boxes at
        other frames correct it; between two of them it goes gradually from what follows the one to
        what follows the other, and its size is linear. Where it is lost it stays where it was
        (`Pick.lost`).

        Parameters
        ----------
        id : str
            A pick; a hold has no window.
        frame : float or None
            A frame of the clip.
        box : (left, top, right, bottom) or None
            In pixels from the clip's top left corner; it may lie outside. It replaces a box that
            was given at this frame. None removes that box, and without a frame the window; a
            window without boxes goes too.
        feather : float, optional
            In pixels; 0 is a hard edge. By default it stays; that of a new window is a tenth of the
            box's shorter side. `change_pick(id, feather=…)` changes it alone.
        inverted : bool, optional
            The pick changes what is outside of the box instead. By default it stays;
            `change_pick(id, inverted=…)` changes it alone.
        follow : bool
            Follow the box through the clip. Without this, or without the clip, it is linear between
            the given boxes.
        clip, progress
            As in `pick`.
        """
        own = self._clip(clip)
        how: dict[str, Any] = {"feather": feather, "inverted": inverted, "follow": follow}
        how["progress"] = progress
        self._take(pick_edits.set_window(self.grade, own, id, frame, box, **how))
        return self.grade.pick(id)

    def change_pick(self, id: str, *, clip: OfClip | None = None, **changes: Any) -> Pick:
        """Change a pick or hold: any of the attributes of `Pick` but id, kind, path and matte.

        `by` gives the new colour as offsets from the picked colour. A new `frame` or `rgb` is
        followed again, if the pick was followed. In a new range the path and the window are
        followed again, unless they are known in all of it. `follow` begins or ends that. `feather`
        and `inverted` are the window's. Where its place or a hold changes, mattes are learned
        again. `any_value` and `progress` are those of `pick`.
        """
        self._take(pick_edits.change_pick(self.grade, self._clip(clip), id, **changes))
        return self.grade.pick(id)

    def unpick(self, *ids: str, clip: OfClip | None = None) -> None:
        """Remove picks and holds; the mattes of the other kind are learned again."""
        self._take(pick_edits.unpick(self.grade, self._clip(clip), *ids))

    def answer(self, id: str, clip: OfClip | None = None) -> answer.Answer | None:
        """Return what a pick or hold takes of its frame, what else it does, and what would help.

        None where the clip is not there.
        """
        return answer.answer_to(self.grade, self.grade.pick(id), self._clip(clip))

    def pick_warnings(self, id: str, clip: OfClip | None = None) -> tuple[str, ...]:
        """Return what speaks against the clip of a pick or hold, and its colour."""
        return pick_edits.warnings(self.grade, self._clip(clip), id)

    def _clip(self, clip: OfClip | None) -> ClipOfPicks:
        return clip if isinstance(clip, ClipOfPicks) else ClipOfPicks.of(self.grade, clip)

    # ----------------------------------------------------------------------------------- versions

    def version(self, name: str) -> "Document":
        """Return a document with the edits of a version as the active edits; "" returns this one.

        It is not bound to the file: `save` needs a name.
        """
        return Document(self.grade.version(name), self.notes) if name else self

    def save_version(self, name: str) -> str | None:
        """Keep the active edits as a version. This is no step: `undo` leaves versions alone.

        Returns
        -------
        str or None
            The name that an older version of this name has now, such as "former NAME".
        """
        return self._made(versions.save_version(self.grade, name))

    def use_version(self, name: str) -> str | None:
        """Make the edits of a version the active edits, as one step.

        Active edits that no version holds are kept as a new version, which `undo` leaves.

        Returns
        -------
        str or None
            The name of the new version, such as "before NAME".
        """
        return self._made(versions.use_version(self.grade, name))

    def remove_version(self, name: str) -> None:
        """Remove a version; `undo` brings it back."""
        self._take(versions.remove_version(self.grade, name))

    def change_version(
        self, name: str, *, rename: str | None = None, note: str | None = None
    ) -> None:
        """Give a version a name that no version has, or a note; each is a step.

        Parameters
        ----------
        name : str
            The version.
        rename : str, optional
            Its new name.
        note : str, optional
            One line of at most 300 characters; "" removes it. `grade.note` has it.

        Raises
        ------
        Palette4dError
            There is no such version, or another one has the new name.
        """
        if note is not None:
            self._take(versions.set_note(self.grade, name, note))
        if rename is not None:
            self._take(versions.rename_version(self.grade, name, rename))

    def copy_from(
        self,
        source: "Document",
        *,
        time: Time = "relative",
        clip: PathLike | None = None,
    ) -> copying.Fit:
        """Take over the grade of another document, as one step.

        Each handle gets the colour that the other grade makes of its colour at the corresponding
        time. Picks stay as they are in palettes of the same pictures; in another clip they are
        learned again. Active edits that no version holds are kept as the version "before copy". If
        nothing of the grade is in this clip, the edits stay.

        Parameters
        ----------
        source : Document
            The graded document.
        time : "relative", "same" or float
            "relative": the first frame gets the look of the first frame, the last that of the last.
            "same": each frame gets the look of the frame of its number.
            A frame: all frames get the look of this frame of `source`.
        clip : path, optional
            This document's clip, which picks are learned from; default: the sidecar's.

        Returns
        -------
        Fit
            How near the result is to the copied grade; its text is for people.

        Raises
        ------
        Palette4dError
            The source has no edits, the frame is outside of its clip, or its colour space cannot be
            converted.
        """
        unread = unread_steps.unread_picks(source.grade, source.history)
        own = self._clip(clip)
        after, fit = copying.copied(self.grade, source.grade, own, time, unread=unread)
        return fit if fit.nothing else self._made((after, fit))

    # ----------------------------------------------------------------------------------- pictures

    def recolour(self, image: F32, frame: float, **how: Unpack[recolouring.Drawing]) -> F32:
        """Recolour an image with the palette at a time: the same bits as the node.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            Code values of the clip, 0..1 as a rule; a grade never changes alpha.
        frame : float
            The time; frames outside the clip use its first or last frame.
        **how
            The keywords of `palette4d.grade.recolouring.Drawing`.

        Returns
        -------
        (h, w, 3 or 4) float32
            A new array. Without edits it equals `image` bit by bit.
        """
        return recolouring.recolour(self.grade, image, frame, **how)

    def matte(self, image: F32, frame: float, show: str, **how: Unpack[recolouring.Matting]) -> F32:
        """Return a matte of an image: the same values as the node's.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        show : str
            "weight:ID", a soft key of a vertex or stop, which follows its colour through time;
            "pick:ID", the matte of a pick or hold; or "outside", the colours outside the palette.
        frame, **how
            As in `recolour`.

        Returns
        -------
        (h, w) float32
            0..1.
        """
        return recolouring.matte(self.grade, image, frame, show, **how)

    def weights(
        self, image: F32, frame: float, *, space: Literal["input", "palette"] = "input"
    ) -> F32:
        """Return the weight of each palette colour in each pixel (mean value coordinates).

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        frame, space
            As in `recolour`.

        Returns
        -------
        (h, w, n) float32
            Weights in the order of ``palette(frame).ids``; they sum to 1. They reproduce the pixel,
            or, outside the palette, its nearest point. NaN for pixels that are not finite.
        """
        return recolouring.weights(self.grade, image, frame, space=space)

    # ------------------------------------------------------------------------------------- saving

    @property
    def path(self) -> Path | None:
        """The sidecar; None until it is saved."""
        return self.grade.path

    @property
    def changed(self) -> bool:
        """Whether there are unsaved changes."""
        file = self._file
        return file is None or (file.state, file.history) != (self.grade.state, self.history)

    def fields(self) -> Fields:
        """Return the members of the sidecar that `save` would write (docs/sidecar.md)."""
        plain: Fields = _core.plain(self.grade.fields(self.history.done, self.history.undone))
        return plain

    def save(self, path: PathLike | None = None, *, on_edits: OnEdits = "refuse") -> dict[str, str]:
        """Write the sidecar atomically: readers see the old file or the new file.

        Another program may have edited the file since it was loaded. Then `save` merges the edits
        of both into the file and the document. If both changed one handle differently, it raises an
        error and writes nothing.

        Parameters
        ----------
        path : path, optional
            A file other than the loaded file.
        on_edits : {"refuse", "keep", "drop"}
            What to do with edits in that file, which would be lost. "keep" takes them over. If the
            palette differs, it copies the grade and keeps the old file under another name; `notes`
            says so.

        Returns
        -------
        dict
            New ids of picks and stops, by theirs that another program has used meanwhile.

        Raises
        ------
        Palette4dError
            Edits would be lost, or the file cannot be written.
        """
        if path is None and self.path is None:
            raise Palette4dError(
                "this palette has no file yet; expected a name: save('clip.p4d.json')"
            )
        target = Path(path if path is not None else self.path or "")
        if path is None and self._file is None:
            raise Palette4dError(
                f"this is not the document in {self.path}; expected another name to save it under"
            )
        if self._file is not None and self.path is not None and same_file(target, self.path):
            return self._save_again(link_target(target), self._file)
        fields = self.grade.fields(bounded(self.history.done), self.history.undone)
        clip = fields["clip"]
        fields["clip"] = {**clip, "source": _beside(clip["source"], self.path, target)}
        (core, fields, data), notes = reanalysis.save(fields, target, on_edits=on_edits)
        self._saved(*_read(core, fields, target), data)
        self.notes += tuple(notes)
        return {}

    def _save_again(self, target: Path, file: File) -> dict[str, str]:
        with locked(target) as held:
            on_disk = sidecar.read_bytes(target)
            if on_disk == file.data and not self.changed:
                return {}
            grade, history, renamed = self.grade, self.history, dict[str, str]()
            if on_disk != file.data:
                theirs = _read(*sidecar.decoded(on_disk, grade.name), self.path)
                grade, history, renamed = merged(file, (grade, history), theirs)
            history = replace(history, done=tuple(bounded(history.done)))
            members = grade.fields(history.done, history.undone)
            core, data = _core.encode_sidecar(members, str(target))
            sidecar.write(target, data, held, replaces=on_disk)
        self._saved(replace(grade, analysed=core), history, data)
        return renamed


def content_of(document: Document) -> bytes | None:
    """Return what a document's file had when it was read or written last."""
    return None if document._file is None else document._file.data


def put_back(document: Document, content: bytes) -> bytes:
    """Give a document's file an earlier content; return what it had. Load it again then.

    Raises
    ------
    Palette4dError
        Another program has changed the file since the document was loaded or saved, or it cannot
        be written.
    """
    file = document._file
    assert file is not None
    assert document.path is not None
    target = link_target(document.path)
    with locked(target) as held:
        sidecar.write(target, content, held, replaces=file.data)
    return file.data


def _read(core: _core.Sidecar, fields: Fields, path: Path | None) -> tuple[Grade, History]:
    grade = Grade.of(core, fields, path)
    return grade, History(*history_of(fields, grade.name))


def _beside(source: str, old: Path | None, new: Path) -> str:
    """Return a clip's source relative to a sidecar's new folder; `old` is where it was, if it was.

    A source in a folder that is not there stays.
    """
    if not source or Path(source).is_absolute():
        return source
    clip = source if old is None else Path(os.path.realpath(old)).parent / source
    lost = old is not None and not Path(clip).parent.is_dir()
    return source if lost else beside(Path(clip), new.absolute().parent)
