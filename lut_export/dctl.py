"""Write a clip's palette, edits, picks and time as one DCTL file for DaVinci Resolve."""

import os

from palette4d.lut_export.clip_file import ClipExport, Dialect, write_clip
from palette4d.lut_export.clip_text import MAX_ERROR, ClipText

from palette4d.grade.document import Document

_DCTL = Dialect(
    function="__DEVICE__",
    structure="typedef struct { body } name;",
    cast="(({})(x))",
    names="_sqrtf _atan2f _fabs _fminf _fmaxf _log2f _exp2f _powf",
    array="__CONSTANT__ {kind} {name}[{count}] = {{\n    {values}}};",
    textures=False,
)
_TEXT = """\
// DaVinci Resolve{since}: put this file in the LUT folder, then add ResolveFX DCTL to the clip.
DEFINE_UI_PARAMS(p4d_strength, Strength, DCTLUI_SLIDER_FLOAT, 1.0, 0.0, 1.0, 0.01)
DEFINE_UI_PARAMS(p4d_offset, Clip frame minus timeline frame, DCTLUI_VALUE_BOX, {offset})
{mode}{body}
__DEVICE__ float{channels} transform(int p_Width, int p_Height, int p_X, int p_Y, float p_R,
                            float p_G, float p_B{parameter})
{{
    p4d_rgb c = p4d_at_strength((float)(TIMELINE_FRAME_INDEX) + (float)(p4d_offset), p4d_strength,
                                p_R, p_G, p_B);
    return make_float{channels}(c.r, c.g, c.b{argument});
}}
"""
_PLAIN = {"since": "", "mode": "", "channels": "3", "parameter": "", "argument": ""}
_WITH_ALPHA = {
    "since": " 19.1",
    "mode": "DEFINE_DCTL_ALPHA_MODE_STRAIGHT\n",
    "channels": "4",
    "parameter": ", float p_A",
    "argument": ", p_A",
}


def export_dctl(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    *,
    frames: str | None = None,
    alpha: bool = False,
    max_error: float = MAX_ERROR,
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
    max_error : float
        How far off code values may be where the mattes of picks get fewer values, to have room.
    force : bool
        Replace an existing file.

    Returns
    -------
    ClipExport
        What was written, and its error.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        The clip takes more than `MOST_BYTES`, or has room only with a larger error; nothing was
        written.
    """

    def text(clip: ClipText, _: str, body: str) -> str:
        return _TEXT.format(offset=clip.begins - 1, body=body, **(_WITH_ALPHA if alpha else _PLAIN))

    forms = {".dctl": text}
    return write_clip(source, path, _DCTL, forms, frames=frames, force=force, max_error=max_error)
