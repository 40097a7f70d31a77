"""Exports of sidecars and of whole shows: LUT series, and OpenColorIO configs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.arguments import parse_frames
from palette4d.common.errors import Arg, Palette4dError, UnfinishedError
from palette4d.common.text import counted, some_of
from palette4d.grade.document import Document
from palette4d.grade.unread_steps import unread_note, unread_picks
from palette4d.jobs.workers import Workers
from palette4d.lut_export import series
from palette4d.lut_export.bake import SidecarBytes
from palette4d.lut_export.config import WrittenConfig, write_config
from palette4d.lut_export.formats import format_named
from palette4d.lut_export.frame_edit import without_windows
from palette4d.lut_export.measured_write import BakeSettings
from palette4d.lut_export.series import Request, Series
from palette4d.shows import manifest as manifests
from palette4d.shows import show_cdls, timeline_files, timeline_references

Source = str | os.PathLike[str] | Document
Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class Exported:
    """What `export` wrote.

    Attributes
    ----------
    series : list of Series
        The files of each shot, in the manifest's order.
    notes : list of str
        Notes for the user.
    references : int
        The clips of the timeline that have references to files.
    """

    series: list[Series]
    notes: list[str]
    references: int


def export(
    source: Source,
    folder: str | os.PathLike[str],
    *,
    every: int | None = None,
    stops: bool = False,
    frames: str | None = None,
    name: str | None = None,
    padding: int = 4,
    clip: str | None = None,
    otio: str | os.PathLike[str] | None = None,
    ccc: str | os.PathLike[str] | None = None,
    edl: str | os.PathLike[str] | None = None,
    format: str = "resolve_cube",
    jobs: int = 0,
    cluster: str | None = None,
    force: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> Exported:
    """Bake the edit at many frames, a LUT or CDL file each, in parallel.

    Parameters
    ----------
    source : path or Document
        A sidecar, a document without unsaved edits, or the manifest of a show (.shots.json): then
        each shot has a folder of its name.
    folder : path
        The folder for the files and their index; an earlier export there is continued.
    every, stops, frames : int, bool, str
        One of them chooses the frames: every N-th, those at which the edit turns, or "1001-1100x10"
        (not for a show).
    name, clip : str, optional
        The files' name, and the clip, for shapers and errors; by default those of the sidecar (a
        show always has these).
    padding : int
        Digits of the frame numbers in the files' names.
    otio : path, optional
        For a show: a copy of its timeline, whose clips name the sidecar and files of their shot.
    ccc : path, optional
        For a show, with a CDL as the format: one collection with a correction for each shot, of the
        frame nearest to its middle.
    edl : path, optional
        For a show of an EDL: a copy of it with these corrections as comments.
    format : str
        As for `bake`.
    jobs, cluster : int, str
        Processes (0: one per processor), or the address of a Dask scheduler.
    force : bool
        Replace files that differ.
    progress : callable, optional
        Called with (files done, files in all).
    **settings
        ``size``, ``strength``, ``shaper``, ``domain``, ``max_error``, ``space`` and
        ``ocio_config``, as for `bake`.

    Raises
    ------
    UnfinishedError
        Some frames could not be baked.
    Palette4dError
        Nothing was written; or, after all files, the timeline cannot be written.
    """
    path, folder = _file(source), Path(folder)
    show = manifests.is_manifest(path)
    if (every, stops, frames).count(None) + (not stops) != 2:
        raise Palette4dError(
            f"expected one choice of frames: {Arg('every')}, {Arg('stops', True)} or "
            f"{Arg('frames')}"
        )
    for argument, value in (("name", name), ("clip", clip), ("frames", frames)):
        if show and value is not None:
            raise Palette4dError(
                f"{path}: {Arg(argument)} is not for the manifest of a show, whose shots each have "
                "their own; leave it out, or export the shots one by one"
            )
    for argument, wanted in (("otio", otio), ("ccc", ccc), ("edl", edl)):
        if wanted is not None and not show:
            raise Palette4dError(
                f"{path}: {Arg(argument)} needs the manifest of a show (.shots.json); found a "
                "sidecar"
            )
    baked = BakeSettings(format=format_named(format).name, **settings)
    request = Request(path, folder, (), baked, name, padding, clip, force)
    choose = _chooser(every, stops, frames, show=show)
    timeline = edit = None
    notes: list[str] = []
    requests, files = [request], [path]
    if show:
        manifest = manifests.read(path)
        if otio is not None:
            timeline = timeline_references.check(manifest, path, Path(otio), force, folder)
        if ccc is not None:
            show_cdls.check(Path(ccc), ".ccc", baked.format, force, folder)
        if edl is not None:
            show_cdls.check(Path(edl), ".edl", baked.format, force, folder)
            edit = timeline_references.source_of(manifest, path, "edl")
            if not timeline_files.is_edl(edit):
                raise Palette4dError(
                    f"{path}: its shots are those of {edit.name}; {Arg('edl')} expects those of an "
                    f"EDL, use {Arg('otio')}"
                )
        files, notes = _sidecars_of(path, manifest)
        requests = [
            replace(request, sidecar=file, folder=folder / shot, name=shot)
            for file, shot in zip(files, _done(manifest), strict=True)
        ]
    notes += [note for file in files for note in not_followed(file)]
    requests = [replace(one, sidecar=SidecarBytes.of(one.sidecar)) for one in requests]
    read = [SidecarBytes.of(one.sidecar).parsed() for one in requests]
    requests = [replace(one, frames=choose(core)) for one, core in zip(requests, read, strict=True)]
    for one, core in zip(requests, read, strict=True):
        if not format_named(format).is_cdl and (lacks := without_windows(core, one.frames)):
            notes.append(f"shot {one.name}: {lacks}" if show else lacks)
    done = series.export(requests, Workers(jobs, cluster), progress)
    references = 0
    if timeline is not None and otio is not None:
        exported = dict(zip(_done(manifest), done, strict=True))
        references = timeline_references.write(
            timeline, manifest, path, exported, Path(otio), force=force
        )
    if show and (ccc is not None or edl is not None):
        shots = show_cdls.of_shots(manifest, dict(zip(_done(manifest), done, strict=True)))
        if ccc is not None:
            show_cdls.write_collection(shots, Path(ccc), force=force)
        if edl is not None and edit is not None:
            notes += show_cdls.write_edl(edit, manifest, shots, Path(edl), force=force)
    exported_all = Exported(done, notes, references)
    if failed := [one for one in done if one.failed]:
        count = sum(len(one.failed) for one in failed)
        of_shots = f" of {counted(len(failed), 'shot')}" if show else ""
        lines = [
            f"shot {one.index.parent.name}:\n" * show + series.failures_text(one.failed)
            for one in failed
        ]
        raise UnfinishedError(
            f"{counted(count, 'frame')}{of_shots} could not be baked; the others are there, and "
            "the same command tries only these again:\n" + "\n".join(lines),
            exported_all,
        )
    return exported_all


def config(
    sources: Source | Sequence[Source],
    folder: str | os.PathLike[str],
    *,
    every: int | None = None,
    stops: bool = False,
    frames: str | None = None,
    base: str | None = None,
    names: Sequence[str] | None = None,
    process_space: str | None = None,
    clip: str | None = None,
    format: str = "clf",
    jobs: int = 0,
    cluster: str | None = None,
    anyway: bool = False,
    force: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> WrittenConfig:
    """Write an OpenColorIO config with one look a shot, which follows the frame.

    Parameters
    ----------
    sources : path, Document, or a sequence of these
        Sidecars, documents without unsaved edits, manifests of shows.
    folder : path
        The folder for the config and its LUTs.
    every, stops, frames : int, bool, str
        At most one of them chooses the frames to bake, as for `export`; by default all. The other
        frames use the nearest LUT.
    base : str, optional
        The config to extend: a file, an .ocioz archive or an ``ocio://`` name; by default
        OpenColorIO's ACES studio config.
    names : sequence of str, optional
        The shots' names, one a sidecar; by default the clips' names.
    process_space : str, optional
        The config's colour space of the clips; by default that of each sidecar's encoding.
    clip : str, optional
        The clip of the only sidecar, for shapers and errors.
    anyway : bool
        Allow a deltaE 2000 above 2 at the frames between the baked frames.
    format, jobs, cluster, force, progress, **settings
        As for `export`; there is no ``space``.

    Raises
    ------
    Palette4dError
        No config was written; the message says whether LUTs were.
    """
    if isinstance(sources, str | os.PathLike | Document):
        sources = [sources]
    given = [_file(source) for source in sources]
    files, notes = sidecars(given)
    if clip is not None and len(files) > 1:
        raise Palette4dError(
            f"{Arg('clip')} is for one sidecar, found {len(files)}; each of them must name its own "
            "clip"
        )
    done = write_config(
        files,
        Path(folder),
        BakeSettings(format=format_named(format).name, **settings),
        # A manifest with a single shot is a show, too.
        choose=_chooser(every, stops, frames, show=len(files) > 1 or files != given),
        base=base,
        names=None if names is None else tuple(names),
        process_space=process_space,
        clip=clip,
        workers=Workers(jobs, cluster),
        force=force,
        anyway=anyway,
        progress=progress,
    )
    notes += [note for file in files for note in not_followed(file)]
    return replace(done, notes=[*notes, *done.notes])


def not_followed(file: Path) -> list[str]:
    """Return a note on the picks of a sidecar for which the clip was not read yet."""
    document = Document.load(file)
    waiting = unread_picks(document.grade, document.history)
    return [f"{file}: {unread_note(waiting)}"] if waiting else []


def sidecars(paths: Iterable[Path]) -> tuple[list[Path], list[str]]:
    """Return the given sidecars and the manifests' sidecars, and notes on shots without one."""
    files: list[Path] = []
    notes = []
    for path in paths:
        if not manifests.is_manifest(path):
            files.append(path)
            continue
        done, left_out = _sidecars_of(path)
        files += done
        notes += left_out
    return files, notes


def _sidecars_of(
    path: Path, manifest: manifests.Manifest | None = None
) -> tuple[list[Path], list[str]]:
    """Return the sidecars of a manifest, and a note on shots without one."""
    done, others = manifests.sidecars(path, manifest)
    if not others:
        return done, []
    left_out = f"{counted(len(others), 'shot')} not analysed and left out: {some_of(others)}"
    return done, [f"{path}: {left_out}"]


def _file(source: Source) -> Path:
    """Return the file of a source: other processes read it."""
    if not isinstance(source, Document):
        return Path(source)
    if source.path is None or source.changed:
        raise Palette4dError(
            "found a document with unsaved edits, expected a saved one: save() it first"
        )
    return source.path


def _done(manifest: manifests.Manifest) -> list[str]:
    return [entry.shot.name for entry in manifest.entries if entry.status == manifests.DONE]


def _chooser(
    every: int | None, stops: bool, frames: str | None, *, show: bool
) -> Callable[[_core.Sidecar], tuple[int, ...]]:
    """Return sidecar -> its frames to bake; in a show an unedited shot has one stop."""
    if every is not None and every < 1:
        raise Palette4dError(f"found {Arg('every', every)}, expected a whole number of 1 or more")

    def choose(sidecar: _core.Sidecar) -> tuple[int, ...]:
        if stops and show and sidecar.edits.empty:
            return series.every(sidecar, 1)[:1]
        if stops:
            return series.stops(sidecar)
        if frames is not None:
            return series.check_frames(sidecar, tuple(parse_frames(frames)))
        return series.every(sidecar, every or 1)

    return choose
