"""Write a whole clip as GLSL: a fragment function, or a user shader for mpv."""

import os
from pathlib import Path

from palette4d.lut_export.clip_file import ClipExport, arrays_text, write_clip
from palette4d.lut_export.clip_text import ClipText

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

_HEAD = """\
// {name}, frames {first} to {last}: a palette that changes through time, and its edits.
// Written by palette4d {version}. GLSL 3.30, or GLSL ES 3.00 with highp.
"""
_FUNCTION = """\
// vec4 palette4d(vec4 colour) draws straight colours; alpha stays.
uniform float p4d_frame;    // the clip's frame
uniform float p4d_strength; // 0 to 1
{body}
vec4 palette4d(vec4 colour) {{
    p4d_rgb c = p4d_at_strength(p4d_frame, p4d_strength, colour.r, colour.g, colour.b);
    return vec4(c.r, c.g, c.b, colour.a);
}}
"""
#: mpv counts the frames that it shows; it does not tell the clip's own.
_HOOK = """\
// mpv --glsl-shader=FILE CLIP: play from the start, without seeking.
//!HOOK MAIN
//!BIND HOOKED
//!DESC palette4d: {name}
#define P4D_FIRST_FRAME {first}.0
#define P4D_STRENGTH 1.0
{body}
vec4 hook() {{
    vec4 colour = HOOKED_tex(HOOKED_pos);
    p4d_rgb c = p4d_at_strength(P4D_FIRST_FRAME + float(frame), P4D_STRENGTH, colour.r, colour.g,
                                colour.b);
    return vec4(c.r, c.g, c.b, colour.a);
}}
"""
_BODY = """\
#define P4D_FN
#define P4D_STRUCT(name, body) struct name {{ body }};
#define P4D_INT(x) int(x)
#define P4D_FLOAT(x) float(x)
#define P4D_SQRT sqrt
#define P4D_ATAN2 atan
#define P4D_ABS abs
#define P4D_MIN min
#define P4D_MAX max
#define P4D_LOG2 log2
#define P4D_EXP2 exp2
#define P4D_POW pow
{defines}
{arrays}
{kernel}"""


def export_glsl(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    *,
    frames: str | None = None,
    force: bool = False,
) -> ClipExport:
    """Write a sidecar's palette, edits, picks and ramps as GLSL.

    Parameters
    ----------
    source : path or Document
        A sidecar (.p4d.json), or a document.
    path : path
        The file to write: NAME.glsl has a fragment function and its uniforms, NAME.hook is a user
        shader for mpv.
    frames : str, optional
        A range of the clip, such as "1001-1100"; by default all of it.
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
    form = {".glsl": _FUNCTION, ".hook": _HOOK}.get(output.suffix.lower())
    if form is None:
        raise Palette4dError(
            f"{output}: found no extension .glsl or .hook; name the file NAME.glsl for a fragment "
            "function, NAME.hook for a shader of mpv"
        )

    def text_of(clip: ClipText, name: str) -> str:
        array = "const {kind} {name}[{count}] = {kind}[{count}](\n    {values});"
        body = _BODY.format(defines=clip.defines, arrays=arrays_text(clip, array), kernel=clip.text)
        head = _HEAD.format(name=name, first=clip.first, last=clip.last, version=_core.__version__)
        return head + form.format(name=name, first=clip.first, body=body)

    return write_clip(source, output, text_of, frames=frames, force=force)
