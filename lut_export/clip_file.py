"""A whole clip's palette, edits, picks and time as one text file: what its forms share."""

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from palette4d.lut_export.clip_conversion import number
from palette4d.lut_export.clip_text import ClipText, clip_text

from palette4d import _core
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.text import printable
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document


@dataclass(frozen=True)
class ClipExport:
    """The file that was written.

    Attributes
    ----------
    output : str
        The file.
    first, last : int
        The clip's frames that it knows; before and after them the nearest holds.
    keys : int
        The times at which the palette is stored.
    constant_bytes : int
        The memory for them, of `MOST_BYTES`.
    """

    output: str
    first: int
    last: int
    keys: int
    constant_bytes: int


def write_clip(
    source: str | os.PathLike[str] | Document,
    output: Path,
    text_of: Callable[[ClipText, str], str],
    *,
    frames: str | None,
    force: bool,
) -> ClipExport:
    """Write the text that `text_of` makes of a clip and its name (`export_dctl`, `export_glsl`)."""
    refuse_existing(output, force)
    sidecar = _source_of(source)
    clip = clip_text(sidecar, frames, output)
    text = text_of(clip, _one_line(sidecar))
    with replacing(output, force=force) as temporary:
        temporary.write_text(text, encoding="ascii", errors="replace", newline="\n")
    return ClipExport(str(output), clip.first, clip.last, clip.keys, clip.size)


def _source_of(source: str | os.PathLike[str] | Document) -> _core.Sidecar:
    """Return the sidecar of a path or a document."""
    if isinstance(source, Document):
        return source.grade.core
    return _core.parse_sidecar(sidecars.read_bytes(source), os.fspath(source))


def _one_line(sidecar: _core.Sidecar) -> str:
    """Return the clip's name for a comment."""
    return " ".join(printable(str(sidecar.clip["name"])).split())


def arrays_text(clip: ClipText, form: str) -> str:
    """Return the declarations of a clip's constants in a form."""
    texts = []
    for name, numbers in clip.arrays.items():
        kind = "int" if all(isinstance(value, int) for value in numbers) else "float"
        values = list(map(_integer if kind == "int" else number, numbers))
        texts.append(form.format(kind=kind, name=name, count=len(values), values=_rows(values)))
    return "\n".join(texts)


def _integer(value: float) -> str:
    """Return an int literal of 32 bits."""
    bits = int(value) & 0xFFFFFFFF
    signed = bits - (1 << 32) if bits >> 31 else bits
    return str(signed) if signed != -(1 << 31) else "(-2147483647 - 1)"


def _rows(texts: Iterable[str]) -> str:
    """Return numbers in rows."""
    all_of = list(texts)
    return ",\n    ".join(", ".join(all_of[i : i + 8]) for i in range(0, len(all_of), 8))
