"""Write a clip's palette, edits, picks and time as one DCTL file for DaVinci Resolve."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from palette4d.lut_export.clip_conversion import number
from palette4d.lut_export.clip_text import ClipText, clip_text

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.text import printable
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document

_TEXT = """\
// {name}, frames {first} to {last}: a palette that changes through time, and its edits.
// Written by palette4d {version}.
// DaVinci Resolve{since}: put this file in the LUT folder, then add ResolveFX DCTL to the clip.
DEFINE_UI_PARAMS(p4d_strength, Strength, DCTLUI_SLIDER_FLOAT, 1.0, 0.0, 1.0, 0.01)
DEFINE_UI_PARAMS(p4d_offset, Clip frame minus timeline frame, DCTLUI_VALUE_BOX, {offset})
{alpha}#define P4D_FN __DEVICE__
#define P4D_STRUCT(name, body) typedef struct {{ body }} name;
#define P4D_INT(x) ((int)(x))
#define P4D_FLOAT(x) ((float)(x))
#define P4D_SQRT _sqrtf
#define P4D_ATAN2 _atan2f
#define P4D_ABS _fabs
#define P4D_MIN _fminf
#define P4D_MAX _fmaxf
#define P4D_LOG2 _log2f
#define P4D_EXP2 _exp2f
#define P4D_POW _powf
{defines}
{arrays}
{kernel}
{transform}
"""

_PLAIN = """\
__DEVICE__ float3 transform(int p_Width, int p_Height, int p_X, int p_Y, float p_R, float p_G,
                            float p_B)
{
    p4d_rgb c = p4d_at_strength((float)(TIMELINE_FRAME_INDEX) + (float)(p4d_offset), p4d_strength,
                                p_R, p_G, p_B);
    return make_float3(c.r, c.g, c.b);
}"""
_WITH_ALPHA = """\
__DEVICE__ float4 transform(int p_Width, int p_Height, int p_X, int p_Y, float p_R, float p_G,
                            float p_B, float p_A)
{
    p4d_rgb c = p4d_at_strength((float)(TIMELINE_FRAME_INDEX) + (float)(p4d_offset), p4d_strength,
                                p_R, p_G, p_B);
    return make_float4(c.r, c.g, c.b, p_A);
}"""


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


def export_dctl(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    *,
    frames: str | None = None,
    alpha: bool = False,
    force: bool = False,
) -> ClipExport:
    """Write a sidecar's palette, edits, picks and ramps as a DCTL file for DaVinci Resolve.

    Parameters
    ----------
    source : path or Document
        A sidecar (.p4d.json), or a document.
    path : path
        The file to write, NAME.dctl.
    frames : str, optional
        A range of the clip, such as "1001-1100"; by default all of it.
    alpha : bool
        Keep the picture's alpha, straight; needs DaVinci Resolve 19.1.
    force : bool
        Replace an existing file.

    Returns
    -------
    ClipExport
        What was written. The result is within 1e-4 of `render` at every frame.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        The clip takes more than `MOST_BYTES`; nothing was written.
    """
    output = Path(path)
    if output.suffix.lower() != ".dctl":
        raise Palette4dError(f"{output}: found no extension .dctl; name the file NAME.dctl")
    refuse_existing(output, force)
    sidecar = source_of(source)
    clip = clip_text(sidecar, frames, output)
    text = _TEXT.format(
        name=one_line(sidecar),
        first=clip.first,
        last=clip.last,
        version=_core.__version__,
        since=" 19.1" if alpha else "",
        offset=clip.first - 1,
        alpha="DEFINE_DCTL_ALPHA_MODE_STRAIGHT\n" if alpha else "",
        defines=clip.defines,
        arrays=arrays_text(clip, "__CONSTANT__ {kind} {name}[{count}] = {{\n    {values}}};"),
        kernel=clip.text,
        transform=_WITH_ALPHA if alpha else _PLAIN,
    )
    with replacing(output, force=force) as temporary:
        temporary.write_text(text, encoding="ascii", errors="replace", newline="\n")
    return ClipExport(str(output), clip.first, clip.last, clip.keys, clip.size)


def source_of(source: str | os.PathLike[str] | Document) -> _core.Sidecar:
    """Return the sidecar of a path or a document."""
    if isinstance(source, Document):
        return source.grade.core
    return _core.parse_sidecar(sidecars.read_bytes(source), os.fspath(source))


def one_line(sidecar: _core.Sidecar) -> str:
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
