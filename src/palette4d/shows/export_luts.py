"""Export of a whole show: one series for each shot of a manifest."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted
from palette4d.jobs.workers import Workers
from palette4d.lut_export import series
from palette4d.lut_export.series import Request, Series
from palette4d.shows import manifest as manifests
from palette4d.shows import timeline_references


@dataclass(frozen=True)
class Exported:
    """One series per shot, in the manifest's order; notes; the number of clips with references."""

    series: list[Series]
    notes: list[str]
    references: int


def sidecars(paths: list[Path]) -> tuple[list[Path], list[str]]:
    """Return the given sidecars and the manifests' sidecars, and notes on shots without one."""
    found: list[Path] = []
    notes = []
    for path in paths:
        if not manifests.is_manifest(path):
            found.append(path)
            continue
        done, others = manifests.sidecars(path)
        found += done
        if others:
            some = ", ".join(others[:8]) + (", …" if len(others) > 8 else "")
            notes.append(
                f"{path}: {counted(len(others), 'shot')} not analysed and left out: {some}"
            )
    return found, notes


def export(
    path: Path,
    output: Path,
    request: Request,
    choose: Callable[[_core.Sidecar], tuple[int, ...]],
    workers: Workers,
    progress: Callable[[int, int], None] | None = None,
    *,
    otio: Path | None = None,
) -> Exported:
    """Export every shot of a manifest; add references to a copy of the timeline.

    Parameters
    ----------
    path : Path
        The manifest.
    output : Path
        The folder that gets a folder for each shot.
    request : Request
        The options. Sidecar, folder, frames and name are replaced for each shot.
    choose : callable
        Sidecar -> the frames to export.
    workers : Workers
        The processes or the farm that bake.
    progress : callable, optional
        Called with (files done, files in all).
    otio : Path, optional
        The copy of the timeline; an existing file is replaced only with `request.force`.

    Raises
    ------
    Palette4dError
        Nothing can be exported; or, after the export, the timeline cannot be written.
    """
    manifest = manifests.read(path)
    source = None
    if otio is not None:
        source = timeline_references.check(manifest, path, otio, request.force)
    files, notes = sidecars([path])
    names = [entry.shot.name for entry in manifest.entries if entry.status == manifests.DONE]
    requests = []
    for file, name in zip(files, names, strict=True):
        frames = choose(_core.read_sidecar(str(file)))
        requests.append(
            replace(request, sidecar=file, folder=output / name, frames=frames, name=name)
        )
    done = series.export(requests, workers, progress)
    references = 0
    if source is not None and otio is not None:
        exported = dict(zip(names, done, strict=True))
        references = timeline_references.write(
            source, manifest, path, exported, otio, force=request.force
        )
    return Exported(done, notes, references)


def as_json(done: list[Series]) -> str:
    """Return the indexes of all shots, by their names."""
    return json.dumps({one.document["clip"]["name"]: one.document for one in done}, indent=2)


def failures(done: list[Series]) -> Palette4dError | None:
    """Return the error that lists the frames that could not be baked; None without failures."""
    failed = [one for one in done if one.failed]
    if not failed:
        return None
    count = sum(len(one.failed) for one in failed)
    lines = "\n".join(
        f"shot {one.index.parent.name}:\n{series.failures_text(one.failed)}" for one in failed
    )
    return Palette4dError(
        f"{counted(count, 'frame')} of {counted(len(failed), 'shot')} could not be baked; the "
        f"others are there, and the same command tries only these again:\n{lines}"
    )
