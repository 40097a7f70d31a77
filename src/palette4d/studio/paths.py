"""What a dropped or chosen path stands for, and the names of files beside it."""

import contextlib
import os
from pathlib import Path

from palette4d import _core
from palette4d.common.folders import home
from palette4d.media import clip_sequence
from palette4d.media.clip import ClipError
from palette4d.media.clip_sequence import ImageSequence

#: In the user's home: what cannot stand beside its clip.
OWN_FOLDER = "palette4d"


def beside(path: Path, ending: str) -> str:
    """Return a file's name with another ending, in the same folder."""
    stem = path.name.removesuffix(".p4d.json")
    return str(path.with_name(stem + ending))


def place_for(path: Path) -> Path:
    """Return a file that can be written: this one, or one of its name in the folder of the user.

    Folders of media are often read-only.
    """
    folder = path.absolute().parent
    while not folder.exists():
        folder = folder.parent
    if os.access(folder, os.W_OK) and (not path.exists() or os.access(path, os.W_OK)):
        return path
    return home() / OWN_FOLDER / path.name


def sequence_of(path: str) -> str:
    """Return the pattern of the sequence that a dropped or chosen image belongs to.

    Other paths stay as they are: a folder, a movie, an image without numbered neighbours.
    """
    found = Path(path)
    if not found.is_file() or clip_sequence.extension(found) not in clip_sequence.IMAGE_EXTENSIONS:
        return path
    for sequence in clip_sequence.sequences_in(found.parent):
        if len(sequence.files) > 1 and found in sequence.files.values():
            return sequence.pattern
    return path


def sidecar_of(path: str) -> Path | None:
    """Return the sidecar beside a clip, if it was analysed before."""
    found = Path(path)
    names = [_core.clip_name(found.name), found.stem, found.name]
    if "#" in found.name:
        with contextlib.suppress(ClipError):
            names.append(clip_sequence.of_pattern(path)[0].name)
    for name in dict.fromkeys(names):
        candidate = found.absolute().parent / f"{name}.p4d.json"
        if name and candidate.is_file():
            return candidate
    if found.is_dir():  # or in the folder, beside its frames
        with contextlib.suppress(ClipError):
            inside = clip_sequence.in_folder(found)
            return sidecar_of(inside.pattern if isinstance(inside, ImageSequence) else str(inside))
    return None
