"""The document: a palette and the user's edits. It is loaded, edited, applied and saved.

The steps of an edit are part of the document and are saved with it. The core computes every colour,
so that results equal the node's bit by bit.
"""

import copy
import itertools
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.files import link_target
from palette4d.common.locking import locked
from palette4d.common.text import counted
from palette4d.grade import edits, sidecar
from palette4d.grade.copying import Fit, Time, copied, fit
from palette4d.grade.edits import Key, State
from palette4d.grade.handle_edits import HandleEdits
from palette4d.grade.pick_edits import PickEdits
from palette4d.grade.sidecar import Fields, OnEdits
from palette4d.grade.steps import ACTIVE

#: The most characters of a version's name.
LONGEST_NAME = 100


class Document(HandleEdits, PickEdits):
    """A clip's palette with its edits.

    Get one with `palette4d.load` or `palette4d.analyze`. Colours are code values of the palette
    (``encoding`` says which); 0..1 is the usual range, and any finite value is allowed. Frames are
    the clip's frame numbers; fractions are times between frames. A method that fails raises
    `Palette4dError` and changes nothing.

    Parameters
    ----------
    fields : mapping
        The members of a sidecar (docs/sidecar.md).
    notes : iterable of str
        Notes of the analysis about the palette.
    report : mapping, optional
        Figures of the analysis, as `palette4d analyze --json` prints them.

    Attributes
    ----------
    path : Path or None
        The sidecar; None until it is saved.
    notes : tuple of str
        As above.
    report : dict
        As above; empty for a loaded sidecar.
    """

    def __init__(
        self,
        fields: Mapping[str, Any],
        notes: Iterable[str] = (),
        report: Mapping[str, Any] | None = None,
    ) -> None:
        self.path: Path | None = None
        core, data = _core.encode_sidecar(fields, self._name)
        self._start(core, sidecar.decoded(data, self._name)[1])
        self._disk = None
        self.notes = tuple(notes)
        self.report = dict(report or {})

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, version: str = "") -> "Document":
        """Load a sidecar (*.p4d.json), or a version in it (`Document.version`).

        Raises
        ------
        SidecarError
            There is no such file, or it is unusable.
        Palette4dError
            There is no such version.
        """
        document = cls.__new__(cls)
        data = sidecar.read_bytes(path)
        document._disk, document.path, document.notes = data, Path(path), ()
        document.report = {}
        document._start(*sidecar.decoded(data, os.fspath(path)))
        return document.version(version)

    def __repr__(self) -> str:
        """Return one line: the clip, its frames, and the numbers of edits."""
        first, last, _ = self.frames
        return (
            f"<Document {self._fields['clip']['name']!r}: frames {first} to {last}, "
            f"{counted(len(self._handles.vertices), 'vertex', 'vertices')}, "
            f"{counted(sum(kind in ACTIVE for kind, _ in self._state), 'edit')}>"
        )

    # ----------------------------------------------------------------------------------- versions

    @property
    def versions(self) -> tuple[str, ...]:
        """The names of the versions, sorted."""
        return tuple(sorted(name for kind, name in self._state if kind == "version"))

    def save_version(self, name: str) -> str | None:
        """Keep the active edits as a version. This is no step: `undo` leaves versions alone.

        Returns
        -------
        str or None
            The name that an older version of this name has now, such as "former NAME".
        """
        if not 1 <= len(name.strip()) <= LONGEST_NAME or not name.isprintable():
            raise Palette4dError(
                f"found the version name {name!r}, expected 1 to {LONGEST_NAME} printable "
                "characters"
            )
        versions: dict[Key, Any] = {("version", name): self.fields()["edits"]}
        former, active = self._state.get(("version", name)), self._active()
        kept = None
        if former is not None and edits.from_fields(former) != active:
            kept = self._free_name(f"former {name}")
            versions["version", kept] = former
        self.apply(edits.difference(self._state, {**self._state, **versions}))
        return kept

    def use_version(self, name: str) -> str | None:
        """Make the edits of a version the active edits, as one step.

        Active edits that no version holds are kept as a new version, which `undo` leaves.

        Returns
        -------
        str or None
            The name of the new version, such as "before NAME".
        """
        wanted = edits.from_fields(self._version(name))
        versions, kept = self._versions_with_active(f"before {name}")
        self.apply(edits.difference(self._state, {**wanted, **versions}, f"use version {name}"))
        return kept

    def _versions_with_active(self, name: str) -> tuple[dict[Key, Any], str | None]:
        """Return the versions, with the active edits as another one if none holds them."""
        versions = {key: value for key, value in self._state.items() if key[0] == "version"}
        if not self._active() or self.same_edits():
            return versions, None
        kept = self._free_name(name)
        versions["version", kept] = self.fields()["edits"]
        return versions, kept

    def _free_name(self, name: str) -> str:
        names = (name[: LONGEST_NAME - 4] + more for more in _suffixes())
        return next(each for each in names if ("version", each) not in self._state)

    def copy_from(
        self,
        source: "Document",
        *,
        time: Time = "relative",
        clip: str | os.PathLike[str] | None = None,
    ) -> Fit:
        """Take over the grade of another document, as one step.

        Each handle gets the colour that the other grade makes of its colour at the corresponding
        time. Picks are learned again there. Active edits that no version holds are kept as the
        version "before copy".

        Parameters
        ----------
        source : Document
            The graded document.
        time : "relative" or float
            "relative": the first frame gets the look of the first frame, the last that of the last.
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
        if source.path is not None and self.path is not None and _same(source.path, self.path):
            raise Palette4dError(
                f"{source._name} is the palette itself, which has this grade already; expected "
                "another palette to copy from"
            )
        if not source.edited:
            raise Palette4dError(
                f"{source._name} has no edits; expected a graded palette to copy from"
            )
        state, picks = copied(self, source, time)
        versions, _ = self._versions_with_active("before copy")
        locks = {key: value for key, value in self._state.items() if key[0] == "lock"}
        with self.one_step(f"copy the grade of {source._fields['clip']['name']}"):
            self.apply(edits.difference(self._state, {**state, **locks, **versions}, ""))
            left_out = self._take_picks(picks, clip)
            return replace(fit(self, source, time), left_out=left_out)

    def same_edits(self) -> tuple[str, ...]:
        """Return the names of the versions that hold the active edits."""
        active = self._active()
        return tuple(n for n in self.versions if edits.from_fields(self._version(n)) == active)

    def remove_version(self, name: str) -> None:
        """Remove a version; `undo` brings it back."""
        self._version(name)
        self._put("version", name, None, f"remove version {name}")

    def at(self, state: State) -> "Document":
        """Return a document with another state of the user's edits, not bound to the file."""
        found = copy.copy(self)
        found._disk = None
        if state != self._state:
            found._become(state)
        found.forget_history()
        return found

    def with_mattes_of(self, fields: Mapping[str, Any]) -> "Document":
        """Return a document that also knows the mattes in a sidecar's members."""
        found = copy.copy(self)
        found._mattes = {**fields.get("mattes", {}).get("grids", {}), **self._mattes}
        return found

    def version(self, name: str) -> "Document":
        """Return a document with the edits of a version as the active edits; "" returns this one.

        It is not bound to the file: `save` needs a name.
        """
        if not name:
            return self
        fields = self._version(name)
        others = {key: value for key, value in self._state.items() if key[0] == "version"}
        return self.at({**edits.from_fields(fields), **others})

    def _version(self, name: str) -> Fields:
        found: Fields | None = self._state.get(("version", name))
        if found is None:
            there = ", ".join(map(repr, self.versions)) or "none"
            raise Palette4dError(f"there is no version {name!r}; the palette has {there}")
        return found

    # ------------------------------------------------------------------------------------- saving

    @property
    def changed(self) -> bool:
        """Whether there are unsaved changes."""
        return self._disk is None or self._saved != (self._state, self._done, self._undone)

    def save(
        self, path: str | os.PathLike[str] | None = None, *, on_edits: OnEdits = "refuse"
    ) -> None:
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
        if path is None and self._disk is None:
            raise Palette4dError(
                f"this is not the document in {self.path}; expected another name to save it under"
            )
        if self._disk is not None and self.path is not None and _same(target, self.path):
            self._save_again(link_target(target), self._disk)
            return
        self._done = edits.bounded(self._done)
        fields = self.fields()
        if self.path is None:
            fields["clip"]["source"] = _beside(fields["clip"]["source"], target)
        from palette4d.grade import reanalysis  # which needs this module

        path, self.path = self.path, target
        try:
            (core, fields, data), notes = reanalysis.save(fields, target, on_edits=on_edits)
        except BaseException:
            self.path = path
            raise
        self.notes += tuple(notes)
        self._disk = data
        self._start(core, fields)

    def _save_again(self, target: Path, loaded: bytes) -> None:
        with locked(target) as held:
            found = sidecar.read_bytes(target)
            if found == loaded and not self.changed:
                return
            new = self._merged(found) if found != loaded else copy.copy(self)
            new._done = edits.bounded(new._done)
            new._core, data = _core.encode_sidecar(new._members(), str(target))
            sidecar.write(target, data, held, replaces=found)
        new._disk = data
        new._mark_saved()
        self.__dict__ = new.__dict__

    def _merged(self, found: bytes) -> "Document":
        """Return the document in the file with this document's changes since it was loaded."""
        new = Document.__new__(Document)
        new.path, new.notes = self.path, self.notes
        new._start(*sidecar.decoded(found, self._name))
        new._mattes = {**self._mattes, **new._mattes}
        if new._fields["polytope"] != self._fields["polytope"]:
            raise Palette4dError(
                f"{self._name}: the clip was analysed again since this palette was loaded, and the "
                "edits belong to the old palette; nothing was written. Load the file again, or "
                "save under another name"
            )
        loaded, before, _ = self._saved
        try:
            state, names = edits.merged(loaded, self._state, new._state, self._taken())
        except Palette4dError as error:
            raise Palette4dError(f"{self._name}: {error.message.marked}") from None
        both = zip(before, self._done, strict=False)
        shared = sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], both))
        steps = [
            replace(step.inverse(), label=f"undo: {step.label}")
            for step in reversed(before[shared:])
        ]
        steps += self._done[shared:]
        mine = edits.rebased([step.renamed(names) for step in steps], new._state)
        theirs = new._state
        for step in mine:
            new._change(step)
        last = edits.difference(new._state, state)
        if last.undoable().changes:  # the steps on the way there met theirs
            mine = [edits.difference(theirs, state, "edits of two programs").undoable()]
        if last.changes:
            new._become(state)
        if mine:
            new._done = new._done + mine
            new._undone = [step.renamed(names) for step in self._undone]
        return new


def _suffixes() -> Iterator[str]:
    yield ""
    yield from (f" {number}" for number in itertools.count(2))


def _same(a: Path, b: Path) -> bool:
    return os.path.realpath(a) == os.path.realpath(b)


def _beside(source: str, output: Path) -> str:
    """Return the source relative to the sidecar's folder, so that both may move together."""
    if not source or Path(source).is_absolute():
        return source
    try:
        return Path(os.path.relpath(source, output.absolute().parent)).as_posix()
    except ValueError:  # on another drive
        return str(Path(source).absolute())
