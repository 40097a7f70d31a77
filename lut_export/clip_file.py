"""A whole clip's palette, edits, picks and time as one text file: what its forms share."""

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from palette4d.lut_export.clip_conversion import number
from palette4d.lut_export.clip_text import MAX_ERROR, ClipText, clip_text

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.text import printable
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document


@dataclass(frozen=True)
class ClipExport:
    """What `export_dctl` or `export_glsl` wrote.

    Attributes
    ----------
    output : str
        The file.
    texture : str or None
        The file of the texture that a fragment function needs for picks.
    first, last : int
        The clip's frames that it knows; before and after them the nearest holds.
    keys, pick_keys : int
        The times at which the palette is stored, and at which picks and holds that move are.
    constant_bytes : int
        The memory for them, of `MOST_BYTES`.
    matte_levels : int
        Values that the picks' mattes were reduced to, to have room; 0: they are exact.
    error : float
        The largest error by that, in the palette's code values, that was measured on colours from 0
        to 1, 100,000 at each of up to 48 frames. All else is within 1e-4 of `render --clean-up 0`.
    has_picks : bool
        Picks are drawn, without Clean up: the file knows no neighbouring pixels.
    """

    output: str
    texture: str | None
    first: int
    last: int
    keys: int
    pick_keys: int
    constant_bytes: int
    matte_levels: int
    error: float
    has_picks: bool


@dataclass(frozen=True)
class Dialect:
    """A language of files.

    Attributes
    ----------
    function, structure, cast : the beginning of a function; the declaration of `name` with `body`;
        a conversion of x to {}.
    names : of the functions sqrt, atan2, abs, min, max, log2, exp2 and pow.
    array : the declaration of a constant array.
    textures : whether picks are in a texture, else in arrays.
    """

    function: str
    structure: str
    cast: str
    names: str
    array: str
    textures: bool

    def body(self, clip: ClipText) -> str:
        """Return a clip's text."""
        macros = ["SQRT", "ATAN2", "ABS", "MIN", "MAX", "LOG2", "EXP2", "POW"]
        lines = [
            f"#define P4D_FN {self.function}",
            f"#define P4D_STRUCT(name, body) {self.structure}",
            f"#define P4D_INT(x) {self.cast.format('int')}",
            f"#define P4D_FLOAT(x) {self.cast.format('float')}",
            *(f"#define P4D_{m} {n}" for m, n in zip(macros, self.names.split(), strict=True)),
            clip.defines,
        ]
        for name, numbers in clip.arrays.items():
            kind = "int" if all(isinstance(value, int) for value in numbers) else "float"
            texts = list(map(_integer if kind == "int" else number, numbers))
            rows = [", ".join(texts[i : i + 8]) for i in range(0, len(texts), 8)]
            lines.append(
                self.array.format(
                    kind=kind, name=name, count=len(texts), values=",\n    ".join(rows)
                )
            )
        return "\n".join([*lines, clip.text])


def write_clip(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    dialect: Dialect,
    forms: Mapping[str, Callable[[ClipText, str, str], str]],
    *,
    frames: str | None,
    force: bool,
    max_error: float = MAX_ERROR,
) -> ClipExport:
    """Write the text that a form makes of a clip, its name and the dialect's text.

    `forms` are by the file's extension. The picks' texture goes to a file of its own, unless the
    form for mpv has it.
    """
    output = Path(path)
    form = forms.get(output.suffix.lower())
    if form is None:
        known = " or ".join(forms)
        raise Palette4dError(
            f"{output}: found no extension {known}; name the file "
            + " or ".join(f"NAME{suffix}" for suffix in forms)
        )
    file = source.path if isinstance(source, Document) else Path(source)
    refuse_existing(output, force, inputs=[file])
    sidecar = _source_of(source)
    clip = clip_text(sidecar, frames, output, textures=dialect.textures, max_error=max_error)
    name = " ".join(printable(str(sidecar.clip["name"])).split())
    head = (
        f"// {name}, frames {clip.first} to {clip.last}: a palette that changes through time, and "
        f"its edits.\n// Written by palette4d {_core.__version__}.\n"
    )
    if clip.levels:
        head += (
            f"// The mattes of picks have {clip.levels} values, to have room: code values are off "
            f"by about {clip.error:.2g}.\n"
        )
    files = {output: (head + form(clip, name, dialect.body(clip))).encode("ascii", "replace")}
    texture = output.with_suffix(".rgba")
    if clip.texture is not None and output.suffix.lower() != ".hook":
        refuse_existing(texture, force)
        files = {texture: clip.texture.tobytes(), **files}
    with ExitStack() as stack:
        # Both are written before one is renamed.
        for file, data in files.items():
            stack.enter_context(replacing(file, force=force)).write_bytes(data)
    return ClipExport(
        str(output),
        str(texture) if texture in files else None,
        clip.first,
        clip.last,
        clip.keys,
        clip.pick_keys,
        clip.size,
        clip.levels,
        clip.error,
        clip.has_picks,
    )


def _source_of(source: str | os.PathLike[str] | Document) -> _core.Sidecar:
    """Return the sidecar of a path or a document."""
    if isinstance(source, Document):
        return source.grade.core
    return _core.parse_sidecar(sidecars.read_bytes(source), os.fspath(source))


def _integer(value: float) -> str:
    """Return an int literal of 32 bits."""
    bits = int(value) & 0xFFFFFFFF
    signed = bits - (1 << 32) if bits >> 31 else bits
    return str(signed) if signed != -(1 << 31) else "(-2147483647 - 1)"
