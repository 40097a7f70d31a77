"""Write a whole clip as GLSL: a fragment function, or a user shader for mpv."""

import os

from palette4d.lut_export.clip_file import ClipExport, Dialect, write_clip
from palette4d.lut_export.clip_text import ClipText

from palette4d.grade.document import Document

_GLSL = Dialect(
    function="",
    structure="struct name { body };",
    cast="{}(x)",
    names="sqrt atan abs min max log2 exp2 pow",
    array="const {kind} {name}[{count}] = {kind}[{count}](\n    {values});",
    textures=True,
)
#: A texel is a number of 32 bits.
_WORD = """\
int p4d_word(int i) {
    ivec4 n = ivec4(texelFetch(p4d_mattes, ivec2(i & 255, i >> 8), 0) * 255.0 + 0.5);
    return n.r | n.g << 8 | n.b << 16 | n.a << 24;
}
"""
_FUNCTION = """\
// GLSL 3.30, or GLSL ES 3.00 with highp. vec4 palette4d(vec4 colour) draws straight colours; alpha
// stays.
uniform float p4d_frame;    // the clip's frame
uniform float p4d_strength; // 0 to 1
{texture}{body}
vec4 palette4d(vec4 colour) {{
    p4d_rgb c = p4d_at_strength(p4d_frame, p4d_strength, colour.r, colour.g, colour.b);
    return vec4(c.r, c.g, c.b, colour.a);
}}
"""
_SAMPLER = """\
// The file .rgba beside this one: RGBA, 8 bits, {width} x {height}, not filtered, not converted.
uniform highp sampler2D p4d_mattes;
"""
#: mpv counts the frames that it shows, from 1; it does not tell the clip's own.
_HOOK = """\
// mpv --vo=gpu --framedrop=no --glsl-shader=FILE CLIP: play from the start, without seeking.
{texture}//!HOOK MAIN
//!BIND HOOKED
{bind}//!DESC palette4d: {name}
#define P4D_HOOK_FIRST {first}.0
#define P4D_HOOK_STRENGTH 1.0
{body}
vec4 hook() {{
    vec4 colour = HOOKED_tex(HOOKED_pos);
    p4d_rgb c = p4d_at_strength(P4D_HOOK_FIRST + float(frame - 1), P4D_HOOK_STRENGTH,
                                colour.r, colour.g, colour.b);
    return vec4(c.r, c.g, c.b, colour.a);
}}
"""
_TEXTURE = """\
//!TEXTURE p4d_mattes
//!SIZE {width} {height}
//!FORMAT rgba8
//!FILTER NEAREST
{data}
"""


def export_glsl(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    *,
    frames: str | None = None,
    force: bool = False,
) -> ClipExport:
    """Write what `export_dctl` does, and as it does, as GLSL.

    Picks are in a texture, so that many have room. For mpv it is in the file.

    Parameters
    ----------
    source, frames, force
        As for `export_dctl`.
    path : path
        The file to write: NAME.glsl has a fragment function and its uniforms, and with picks a
        texture NAME.rgba beside it; NAME.hook is a user shader for mpv.

    Returns
    -------
    ClipExport
        What was written.
    """
    forms = {".glsl": _function, ".hook": _hook}
    return write_clip(source, path, _GLSL, forms, frames=frames, force=force)


def _function(clip: ClipText, _: str, body: str) -> str:
    """Return a fragment function."""
    sampler = _with_texture(_SAMPLER, clip)
    return _FUNCTION.format(texture=sampler, body=(_WORD if sampler else "") + body)


def _hook(clip: ClipText, name: str, body: str) -> str:
    """Return a user shader."""
    texture = _with_texture(_TEXTURE, clip)
    return _HOOK.format(
        texture=texture,
        bind="//!BIND p4d_mattes\n" if texture else "",
        name=name,
        first=clip.begins,
        body=(_WORD if texture else "") + body,
    )


def _with_texture(text: str, clip: ClipText) -> str:
    """Return a text about the picks' texture; none without one."""
    if clip.texture is None:
        return ""
    height, width, _ = clip.texture.shape
    return text.format(width=width, height=height, data=clip.texture.tobytes().hex())
