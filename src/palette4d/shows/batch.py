"""A batch: the analysis of many shots into one sidecar per shot and a manifest.

Other processes or machines analyse the shots. Only this process writes files. A sidecar is kept if
it was made from the same frames with the same options. So a repeated command analyses only shots
that are missing or failed.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.analysis import pipeline
from palette4d.analysis.options import AnalysisOptions
from palette4d.colour.ocio_config import files_of_config
from palette4d.common.errors import Arg, Palette4dError, in_words
from palette4d.common.files import beside, make_folder, names_a_server
from palette4d.common.text import counted, some_of
from palette4d.grade import reanalysis, sidecar
from palette4d.jobs.workers import Failed, Workers
from palette4d.media.clip import open_clip
from palette4d.media.clip_files import files_of
from palette4d.media.colour_space import SpaceOptions
from palette4d.shows import manifest as manifests
from palette4d.shows.manifest import DONE, FAILED, TO_DO, Entry, Manifest
from palette4d.shows.shots import Shot, trimmed


@dataclasses.dataclass(frozen=True)
class ShowOptions:
    """The options for the analysis of a show; `palette4d.analyze_shots` explains them."""

    analysis: AnalysisOptions
    spaces: SpaceOptions = dataclasses.field(default_factory=SpaceOptions)
    rate: Fraction | None = None
    skip_bad_frames: bool = False
    allow_cuts: bool = False
    on_edits: sidecar.OnEdits = "refuse"
    force: bool = False
    only: tuple[str, ...] = ()
    workers: Workers = dataclasses.field(default_factory=Workers)


@dataclasses.dataclass(frozen=True)
class Source:
    """The source of the shots: a timeline (with its hash) or a movie, and its rate."""

    name: str
    file: str
    sha256: str
    rate: Fraction


@dataclasses.dataclass(frozen=True)
class ShotTask:
    """One shot to analyse; can be sent to another process or machine."""

    shot: Shot
    clip: str
    options: ShowOptions


@dataclasses.dataclass(frozen=True)
class Analysed:
    """A shot's sidecar document, and notes for the user."""

    document: dict[str, Any]
    notes: tuple[str, ...]


def analyse(
    source: Source,
    shots: list[Shot],
    folder: Path,
    options: ShowOptions,
    progress: Callable[[int, int, str], object] | None = None,
) -> Show:
    """Analyse shots of different names into a folder, which is made if it is missing.

    `progress` is called with (frames done, frames in all, words on the shots), the first time
    before any shot is analysed. If shots fail, the others are complete. After Ctrl-C all written
    sidecars are complete, and the manifest lists them.
    """
    if unknown := [name for name in options.only if name not in {shot.name for shot in shots}]:
        some = some_of(sorted(shot.name for shot in shots))
        raise Palette4dError(
            f"{Arg('only')}: there is no shot {unknown[0]!r}; expected names such as {some}"
        )
    make_folder(folder)
    show = Show(source, shots, folder, options)
    show.save()  # write early: an unwritable folder must fail before hours of work
    tell = progress or (lambda done, total, words: None)

    def take(name: str, outcome: Analysed | Failed) -> None:
        show.take(name, outcome)
        tell(*show.progress())

    tell(*show.progress())
    try:
        # A shot may take minutes: Ctrl-C does not wait for it.
        reads = _files(show.tasks.values())
        options.workers.run(analyse_shot, show.tasks, take, patient=False, reads=reads)
    finally:
        show.save()
    return show


def _files(tasks: Iterable[ShotTask]) -> list[Path]:
    """Return what the processes that analyse shots must read."""
    tasks = list(tasks)
    clips = dict.fromkeys(task.clip for task in tasks)
    asked = (task.options.spaces.ocio_config for task in tasks)
    configs = dict.fromkeys(config or os.environ.get("OCIO") or "" for config in asked)
    files = [path for clip in clips for path in files_of(clip)]
    return files + [path for config in configs for path in files_of_config(config)]


class Show:
    """The shots of a source: kept shots, shots to analyse, and their results.

    Attributes
    ----------
    path : the manifest.
    analysed, kept : names of the shots that were analysed, and of the shots whose sidecars were
        kept.
    notes : notes of the analysis, by shot.
    """

    def __init__(
        self, source: Source, shots: list[Shot], folder: Path, options: ShowOptions
    ) -> None:
        self.folder, self.options = folder, options
        self.path = manifests.path_of(folder, source.name)
        before = manifests.read(self.path) if self.path.exists() else None
        known = {} if before is None else {entry.shot.name: entry for entry in before.entries}
        spaces = dataclasses.asdict(options.spaces) if options.spaces.asked else {}
        recorded = options.analysis.recorded()
        self.own: dict[str, str] = {}  # of the chosen shots
        if not options.only:
            recorded |= spaces
        else:
            recorded = recorded if before is None else before.options
            self.own = {**_given(recorded), **_given(spaces)}  # what is not given is the show's
        self._head = Manifest(
            source=self.beside(source.file),
            source_sha256=source.sha256,
            rate=source.rate,
            options=recorded,
            entries=(),
        )
        self.same_edit = (
            before is not None
            and self._head.is_timeline
            and (before.source_sha256, before.rate) == (source.sha256, source.rate)
        )
        self.before = {} if before is None else before.options
        self.entries: dict[str, Entry] = {}
        self.tasks: dict[str, ShotTask] = {}
        self.kept: list[str] = []
        self.analysed: list[str] = []
        self.notes: dict[str, tuple[str, ...]] = {}
        self.graded: list[str] = []  # whose edits would be lost
        for shot in shots:
            self.plan(shot, known.get(shot.name))
        if gone := [name for name in known if name not in self.entries and self.has_edits(name)]:
            self.notes[""] = (
                f"{counted(len(gone), 'graded shot is', 'graded shots are')} no longer in the "
                f"edit, and {'its sidecar stays' if len(gone) == 1 else 'their sidecars stay'} in "
                f"the folder: {some_of(gone)}",
            )
        if self.graded:
            raise Palette4dError(
                f"{counted(len(self.graded), 'shot has', 'shots have')} edits that a new analysis "
                f"would lose: {some_of(self.graded)}; nothing was analysed. Keep them with "
                f"{Arg('on_edits', 'keep')} (a changed palette gets a copy of the grade), discard "
                f"them with {Arg('on_edits', 'drop')}, or choose other shots with {Arg('only')}"
            )

    def __repr__(self) -> str:
        """Return one line: the manifest's file, and how many shots have a sidecar."""
        done = sum(entry.status == DONE for entry in self.entries.values())
        return f"<Show {str(self.path)!r}: {done} of {counted(len(self.entries), 'shot')} done>"

    def has_edits(self, name: str) -> bool:
        """Whether a shot's sidecar has edits."""
        try:
            return sidecar.has_edits(sidecar.load(self.folder / f"{name}.p4d.json"))
        except Palette4dError:
            return False

    @property
    def manifest(self) -> Manifest:
        """The manifest in its present state."""
        return dataclasses.replace(self._head, entries=tuple(self.entries.values()))

    def plan(self, shot: Shot, before: Entry | None) -> None:
        """Decide whether to keep or to analyse a shot."""
        own = dataclasses.replace(shot, clip=self.beside(shot.clip), problem="")
        entry = Entry(own, spaces=self.spaces_for(shot.name, before))
        chosen = not self.options.only or shot.name in self.options.only
        if before is not None and not chosen and self.stays(before, own):
            place = dataclasses.replace(before.shot, used=own.used, place=own.place)
            entry = before if self.same_edit else dataclasses.replace(before, shot=place)
            if entry.status == DONE:
                self.kept.append(shot.name)
        elif shot.problem:
            entry = dataclasses.replace(entry, status=FAILED, error=shot.problem)
        elif not self.options.force and (frames := self.there(own, before)) is not None:
            entry = dataclasses.replace(entry, status=DONE, frames=frames)
            self.kept.append(shot.name)
            try:
                _tell_edit(self.folder / entry.sidecar, own, frames)
            except Palette4dError as error:
                words = error.message.marked
                self.notes[shot.name] = (f"it does not say how the edit plays it: {words}",)
        elif chosen:
            try:
                self.tasks[shot.name] = self.task(shot, entry)
                self.check_target(entry, before)
            except Palette4dError as error:
                self.tasks.pop(shot.name, None)
                was_done = before is not None and before.status == DONE
                if isinstance(error, sidecar.WouldLoseEdits) and was_done:
                    self.graded.append(shot.name)
                entry = dataclasses.replace(entry, status=FAILED, error=error.message.marked)
        self.entries[shot.name] = entry

    def spaces_for(self, name: str, before: Entry | None) -> Mapping[str, str]:
        """Return a shot's own colour spaces: `only` gives them to its shots, others keep theirs."""
        kept = {} if before is None else before.spaces
        own = self.own if name in self.options.only else kept
        return {} if own == _given(self._head.options) else own

    def task(self, shot: Shot, entry: Entry) -> ShotTask:
        """Return what is to be done for a shot."""
        own = entry.spaces or _given(self._head.options)
        config = own.get("ocio_config", "")
        if config != self.options.spaces.ocio_config and names_a_server(config, self.path):
            raise Palette4dError(
                f"{self.path}: found the config {config}, on another server, expected one that you "
                f"name yourself, with {Arg('ocio_config')}"
            )
        options = dataclasses.replace(self.options, spaces=SpaceOptions(**own))
        return ShotTask(shot, str(Path.cwd() / shot.clip), options)

    def stays(self, before: Entry, shot: Shot) -> bool:
        """Whether the manifest's entry still holds for a shot that `only` leaves out."""
        own = before.shot
        if before.status != DONE:
            # The sidecar may exist although the manifest says otherwise.
            return self.same_edit and own.clip == shot.clip and self.there(shot, before) is None
        if self.same_edit:
            return True  # head and tail frames and the media's place may differ
        first, last = before.frames or (0, -1)
        shown = first <= shot.used[0] and shot.used[1] <= last
        return (own.clip, own.step) == (shot.clip, shot.step) and shown

    def check_target(self, entry: Entry, before: Entry | None) -> None:
        """Raise an error if the sidecar must not be replaced."""
        target = self.folder / entry.sidecar
        sidecar.check_target(target, on_edits=self.options.on_edits)
        if before is not None or self.options.force or not target.exists():
            return
        if sidecar.load(target)["clip"]["source"] != entry.shot.clip:
            raise Palette4dError(
                f"{target}: a sidecar of another clip is there already; choose another folder, or "
                f"replace it with {Arg('force', True)}"
            )

    def there(self, shot: Shot, before: Entry | None) -> tuple[int, int] | None:
        """Return the frames of a sidecar that was made from this shot with these options."""
        target = self.folder / Entry(shot).sidecar
        try:
            document = sidecar.load(target)
        except Palette4dError:
            return None
        clip = document["clip"]
        ends = (int(clip["frames"]["first"]), int(clip["frames"]["last"]))
        expected = {(shot.first, shot.last)}
        if before and before.frames and dataclasses.replace(before.shot, place=shot.place) == shot:
            expected.add(before.frames)
        same = (
            (self.same_spaces(before) if before else not self.options.spaces.asked)
            and ends in expected
            and clip["source"] == shot.clip
            and clip["frames"]["step"] == shot.step
            and document["generator"] == f"palette4d {_core.__version__}"
            and document["quality"]["options"] == self.options.analysis.recorded()
        )
        return ends if same else None

    def same_spaces(self, before: Entry) -> bool:
        """Whether a shot has the colour spaces of the analysis before."""
        wanted = self.spaces_for(before.shot.name, before) or _given(self._head.options)
        return wanted == (before.spaces or _given(self.before))

    def beside(self, clip: str) -> str:
        """Return a path relative to the folder, so that both may move together."""
        return stored_name(clip, self.folder)

    def take(self, name: str, outcome: Analysed | Failed) -> None:
        """Write a sidecar, or record the failure."""
        entry = self.entries[name]
        try:
            if isinstance(outcome, Failed):
                raise Palette4dError(outcome.text)
            document = outcome.document
            document["clip"]["source"] = entry.shot.clip
            frames = document["clip"]["frames"]
            if played := _played(entry.shot, (frames["first"], frames["last"])):
                document["extra"]["edit"] = played
            target = self.folder / entry.sidecar
            clip = self.tasks[name].clip
            _, notes = reanalysis.save(document, target, on_edits=self.options.on_edits, clip=clip)
            ends = (frames["first"], frames["last"])
            self.entries[name] = dataclasses.replace(entry, status=DONE, frames=ends)
            self.analysed.append(name)
            self.notes[name] = (*outcome.notes, *notes)
        except (Palette4dError, OSError) as error:
            error_text = in_words(error).marked
            self.entries[name] = dataclasses.replace(entry, status=FAILED, error=error_text)
        self.save()

    def save(self) -> None:
        """Write the manifest."""
        manifests.write(self.manifest, self.path)

    def progress(self) -> tuple[int, int, str]:
        """Return frames done, frames in all, and words."""
        counts = {name: entry.shot.count for name, entry in self.entries.items()}
        left = sum(counts[name] for name in self.tasks if self.entries[name].status == TO_DO)
        total = sum(counts[name] for name in [*self.kept, *self.tasks])
        ready = sum(entry.status == DONE for entry in self.entries.values())
        return total - left, total, f"{ready} of {counted(len(self.entries), 'shot')}"


def stored_name(clip: str, folder: Path) -> str:
    """Return the path of a shot's clip as the manifest in a folder states it."""
    return clip if not clip or Path(clip).is_absolute() else beside(Path(clip), folder)


def _given(options: Mapping[str, Any]) -> dict[str, str]:
    """Return the colour spaces that are given, and their config."""
    named = {name: options.get(name) for name in manifests.SPACES}
    return {name: value for name, value in named.items() if isinstance(value, str) and value}


def _played(shot: Shot, frames: tuple[int, int]) -> dict[str, Any]:
    """Return how a timeline plays a shot, by the names of the node's parameters, and its CDL.

    `frames` are the sidecar's first and last. Nothing at the media's own speed and without a CDL.
    """
    played: dict[str, Any] = {}
    if shot.speed != 1:
        trimmed = frames[1] - shot.used[1] if shot.speed < 0 else shot.used[0] - frames[0]
        played = {"speed": abs(shot.speed), "reverse": shot.speed < 0, "inPoint": trimmed}
    if shot.cdl is not None:
        played["cdl"] = dataclasses.asdict(shot.cdl)
    return played


def _tell_edit(target: Path, shot: Shot, frames: tuple[int, int]) -> None:
    """Let a sidecar that is kept say how the timeline plays its shot now."""
    read = sidecar.read_bytes(target)
    document = sidecar.decoded(read, str(target))[1]
    played = json.loads(json.dumps(_played(shot, frames)))
    if document["extra"].get("edit", {}) == played or shot.place is None:
        return
    document["extra"] = {**document["extra"], "edit": played}
    if not played:
        del document["extra"]["edit"]
    sidecar.save(document, target, on_edits="drop", replaces=read)


def analyse_shot(task: ShotTask, threads: int) -> Analysed:
    """Analyse one shot; every error of the media or the analysis is one in words."""
    try:
        return _analysed(task, threads)
    except (Palette4dError, OSError):
        raise
    except Exception as error:  # one shot must not end a night's work
        raise Palette4dError(
            f"the analysis ended with {type(error).__name__}: {error}; please report this"
        ) from error


def _analysed(task: ShotTask, threads: int) -> Analysed:
    options = task.options
    shot = task.shot
    notes: list[str] = []
    # A movie was split at its cuts: there is no need to search for cuts again.
    if shot.place is not None and not options.allow_cuts:
        shot = trimmed(shot, _open(task, shot))
        if shot != task.shot:
            notes.append(
                f"the media cuts inside of the head and tail frames: frames {shot.frames} are "
                f"analysed instead of {task.shot.frames}"
            )
    clip = _open(task, shot)
    analysis_options = dataclasses.replace(options.analysis, threads=threads)
    analysis = pipeline.analyze(clip, analysis_options, spaces=options.spaces, allow_cuts=True)
    analysis.document["clip"]["name"] = shot.name
    # The notes on a movie are told once, not for each of its shots.
    told = clip.notes if shot.place is None else []
    return Analysed(analysis.document, (*notes, *(n for n in analysis.notes if n not in told)))


def _open(task: ShotTask, shot: Shot) -> Any:
    return open_clip(
        task.clip,
        frames=shot.frames,
        rate=task.options.rate,
        skip_bad_frames=task.options.skip_bad_frames,
    )
