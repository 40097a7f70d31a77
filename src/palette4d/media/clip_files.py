"""The files and folders that are read with a clip, before anything of it is decoded."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from palette4d import _core
from palette4d.common import sandbox
from palette4d.media.clip_sequence import IMAGE_EXTENSIONS, MOVIE_EXTENSIONS, extension
from palette4d.media.reading import split
from palette4d.media.source_clip import candidates

#: How the names of files end that belong to a sidecar.
SIDECARS = frozenset({"p4d.json", "shots.json"})


def files_of(spec: str) -> Iterator[Path]:
    """Yield what a confined process must read to open a clip, by its name for `open_clip`.

    Nothing where no clip is: a sidecar could name /dev.
    """
    path = Path(spec if Path(spec).exists() else split(spec)[0])
    if path.is_file() and extension(path) in MOVIE_EXTENSIONS:
        if extension(Path(os.path.realpath(path))) in MOVIE_EXTENSIONS:  # not a link to a key
            yield path
    else:
        folder = path if path.is_dir() else path.parent
        if _has_images(folder):
            yield from sandbox.parts(folder, IMAGE_EXTENSIONS)


def _has_images(folder: Path) -> bool:
    try:
        return any(extension(path) in IMAGE_EXTENSIONS for path in folder.iterdir())
    except OSError:
        return False


def files_of_sidecar(path: Path, clip: str | None = None) -> Iterator[Path]:
    """Yield what must be read for a sidecar, and for its clip or the one that is given.

    Raises
    ------
    SidecarError
        The file is no sidecar.
    """
    yield path
    yield from sandbox.parts(path.parent, SIDECARS)
    source = str(_core.read_sidecar(str(path)).clip["source"])
    for spec in candidates(path, source) if clip is None else [clip]:
        yield from files_of(spec)
