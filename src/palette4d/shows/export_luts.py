"""The part of `export` that takes a whole show: a series for each shot of a manifest."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted
from palette4d.jobs.workers import Workers
from palette4d.lut_export import series
from palette4d.shows import manifest as manifests
from palette4d.shows import timeline_references

if TYPE_CHECKING:
    from collections.abc import Callable

    from palette4d.lut_export.series import Request, Series


def sidecars(paths: list[Path]) -> tuple[list[Path], list[str]]:
    """Return sidecars, those of manifests among them, and remarks on shots that have none."""
    found: list[Path] = []
    remarks = []
    for path in paths:
        if not manifests.is_manifest(path):
            found.append(path)
            continue
        done, others = manifests.sidecars(path)
        found += done
        remarks += _left_out(path, others)
    return found, remarks


def _left_out(path: Path, names: list[str]) -> list[str]:
    if not names:
        return []
    some = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
    return [f"{path}: {counted(len(names), 'shot')} not analysed and left out: {some}"]


def export(
    args: argparse.Namespace,
    request: Request,
    choose: Callable[[_core.Sidecar], tuple[int, ...]],
    with_bar: Callable[[Callable[[Callable[[int, int], None]], list[Series]]], list[Series]],
) -> list[Series]:
    """Export every shot of `args.sidecar`, a manifest; note it in a timeline where --otio asks.

    Returns
    -------
    list of Series
        One a shot, in the order of the manifest.

    Raises
    ------
    Palette4dError
        Nothing can be exported; or, after what could be was, the timeline cannot be written.
    """
    path: Path = args.sidecar
    manifest = manifests.read(path)
    source = None
    if args.otio is not None:
        source = timeline_references.check(manifest, path, args.otio, args.force)
    files, others = manifests.sidecars(path)
    for remark in _left_out(path, others):
        print(f"palette4d: note: {remark}", file=sys.stderr)
    names = [entry.shot.name for entry in manifest.entries if entry.status == manifests.DONE]
    requests = []
    for file, name in zip(files, names, strict=True):
        frames = choose(_core.read_sidecar(str(file)))
        folder = args.output / name
        one = replace(request, sidecar=file, folder=folder, frames=frames, name=name)
        requests.append(one)
    workers = Workers(args.jobs, args.cluster)
    done = with_bar(lambda progress: series.export(requests, workers, progress))
    if source is not None:
        exported = dict(zip(names, done, strict=True))
        count = timeline_references.write(
            source, manifest, path, exported, args.otio, force=args.force
        )
        if not args.json:
            print(f"{args.otio}: references in {counted(count, 'clip')}")
    return done


def as_json(done: list[Series]) -> str:
    """Return the indexes of all shots, by their names."""
    return json.dumps({one.document["clip"]["name"]: one.document for one in done}, indent=2)


def failures(done: list[Series]) -> Palette4dError | None:
    """Return the error that lists what could not be baked; None when all was."""
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
