"""The analysis of many shots: of a timeline, or of a movie that is split at its cuts."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path

from palette4d.analysis.options import AnalysisOptions
from palette4d.colour.ocio_config import from_anywhere
from palette4d.common.errors import Arg, Message, Palette4dError, UnfinishedError
from palette4d.common.text import counted, file_safe, some_of
from palette4d.grade.sidecar import OnEdits
from palette4d.jobs.workers import Workers
from palette4d.media.clip import open_clip
from palette4d.media.colour_space import SpaceOptions
from palette4d.shows import find_media, shots, timeline_clips, timeline_files, timeline_shots
from palette4d.shows import manifest as manifests
from palette4d.shows.batch import Show, ShowOptions, Source, analyse, stored_name
from palette4d.shows.manifest import FAILED
from palette4d.shows.shots import Shot
from palette4d.shows.timeline_files import is_timeline
from palette4d.shows.timeline_shots import Conform

Progress = Callable[[str, int, int], object]


def analyze_shots(
    clip: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    frames: str | None = None,
    rate: Fraction | None = None,
    media: str | os.PathLike[str] | None = None,
    handles: int = 0,
    conform: Conform | None = None,
    only: Iterable[str] = (),
    skip_bad_frames: bool = False,
    allow_cuts: bool = False,
    input_space: str | None = None,
    palette_space: str | None = None,
    ocio_config: str | None = None,
    method: str = "skew",
    on_edits: OnEdits = "refuse",
    jobs: int = 0,
    cluster: str | None = None,
    force: bool = False,
    progress: Progress | None = None,
    **settings: object,
) -> Show:
    """Analyse the shots of a timeline, or of a movie or sequence with cuts.

    Parameters
    ----------
    clip : str or path
        A timeline (.otio, .otioz, .otiod, .edl), or a name for `open_clip`, which is split at its
        cuts.
    folder : path
        The folder for a sidecar a shot, and the manifest NAME.shots.json. Shots that were analysed
        there with the same options are kept.
    frames : str, optional
        Only these frames of a movie or sequence.
    rate : Fraction, optional
        Frames per second; of an EDL, those of its timecodes.
    media : path, optional
        The folder with the timeline's media, found by name; by default the timeline's own paths.
    handles : int
        Head and tail frames around each shot of a timeline.
    conform : {"by-rates", "frame-for-frame"}, optional
        How a timeline plays movies of another rate: in their own time, or each frame as one of its
        own. By default as docs/shots.md says.
    only : iterable of str
        The names of the shots to analyse; by default all.
    on_edits : {"refuse", "keep", "drop"}
        What to do with the edits of sidecars that are replaced.
    jobs, cluster : int, str
        Processes (0: one per processor), or the address of a Dask scheduler.
    force : bool
        Also analyse shots that have a sidecar.
    progress : callable, optional
        Called as ``progress(words, done, total)``, counting frames.
    skip_bad_frames, allow_cuts, input_space, palette_space, ocio_config, method, **settings
        As for `palette4d.analyze`.

    Returns
    -------
    Show
        ``path`` is the manifest; ``analysed`` and ``kept`` name the shots; ``notes`` are by shot,
        those under "" are of the whole timeline.

    Raises
    ------
    UnfinishedError
        Some shots failed; the others and the manifest are written.
    Palette4dError
        The timeline or the clip is unusable; nothing was analysed.
    """
    name, folder = os.fspath(clip), Path(folder)
    tell = progress or (lambda words, done, total: None)
    config = ocio_config or os.environ.get("OCIO") or None
    options = ShowOptions(
        analysis=AnalysisOptions.of(method, settings),
        # Workers may run on other machines: give them the config by its name.
        spaces=SpaceOptions(input_space, palette_space, from_anywhere(config)),
        rate=None if is_timeline(name) else rate,
        skip_bad_frames=skip_bad_frames,
        allow_cuts=allow_cuts,
        on_edits=on_edits,
        force=force,
        only=tuple(only),
        workers=Workers(jobs, cluster),
    )
    if is_timeline(name):
        source, listed, notes = _of_timeline(Path(name), folder, rate, media, handles, conform)
    else:
        opened = open_clip(name, frames=frames, rate=rate, skip_bad_frames=skip_bad_frames)
        listed = shots.detect(opened, lambda done, total: tell("cuts", done, total))
        source = Source(file_safe(opened.name), opened.source, "", opened.rate)
        notes = list(opened.notes)
    done = analyse(
        source, listed, folder, options, lambda done, total, words: tell(words, done, total)
    )
    if notes := [*notes, *done.notes.get("", ())]:
        done.notes[""] = tuple(map(Message, notes))
    failed = [entry for entry in done.manifest.entries if entry.status == FAILED]
    if failed:
        lines = "\n".join(f"  {entry.shot.name}: {Message(entry.error).marked}" for entry in failed)
        raise UnfinishedError(
            f"{counted(len(failed), 'shot')} of {len(listed)} could not be analysed; the same "
            f"command tries only {'it' if len(failed) == 1 else 'these'} again:\n{lines}",
            done,
        )
    return done


def _of_timeline(
    path: Path,
    into: Path,
    rate: Fraction | None,
    media: str | os.PathLike[str] | None,
    handles: int,
    conform: Conform | None,
) -> tuple[Source, list[Shot], list[str]]:
    """Return a timeline, its shots, which keep the names that they have in `into`, and notes."""
    there = path.is_file() or (path / "content.otio").is_file()
    sha256 = timeline_files.sha256(path) if there else ""  # the reader says why not
    timeline = timeline_clips.read(path, rate)
    if timeline_files.sha256(path) != sha256:
        raise Palette4dError(f"{path}: it was changed while it was read; run the command again")
    folder = None if media is None else find_media.Folder(Path(media))
    listed, counting = timeline_shots.shots_of(timeline, folder, handles, conform)
    source = Source(file_safe(path.stem), str(path), sha256, timeline.rate)
    manifest = manifests.path_of(into, source.name)
    before = manifests.read(manifest).entries if manifest.exists() else ()
    clips = [stored_name(shot.clip, into) for shot in listed]
    named, renamed = shots.numbered(listed, [each.shot for each in before], clips)
    notes = [f"not analysed: {note}" for note in timeline.notes] + counting
    if timeline_files.is_edl(path) and rate is None:
        notes.append(
            f"an EDL does not state its rate: 24 frames per second are assumed ({Arg('rate')})"
        )
    elif timeline_files.is_edl(path) and rate in (30, 60) and timeline.rate != rate:
        notes.append(
            f"{path} drops frame numbers, which {rate} frames per second do not: "
            f"{float(timeline.rate):.4g} are assumed"
        )
    if renamed:
        notes.append(
            f"{counted(len(renamed), 'shot has the name', 'shots have the names')} of others and "
            f"{'was' if len(renamed) == 1 else 'were'} renamed by the first frame: "
            f"{some_of(renamed)}"
        )
    return source, named, notes
