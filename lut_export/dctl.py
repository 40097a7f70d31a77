"""Write a clip's palette, edits, picks and time as one DCTL file for DaVinci Resolve."""

import os
from pathlib import Path

from palette4d.lut_export.clip_file import ClipExport, arrays_text, write_clip
from palette4d.lut_export.clip_text import ClipText

from palette4d import _core
from palette4d.common.errors import Palette4dError
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

    def text_of(clip: ClipText, name: str) -> str:
        return _TEXT.format(
            name=name,
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

    return write_clip(source, output, text_of, frames=frames, force=force)
