"""Write a clip's palette, edits and time as one DCTL file for DaVinci Resolve.

A DCTL sees single pixels and the timeline's frame: so the file holds the palette and its
displacements at a few times (`keys_of`), between which each pixel interpolates.
"""

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import check_frame, frame_text

from palette4d import _core
from palette4d.common.arguments import parse_frames
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.text import printable
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document

F64 = NDArray[np.float64]

#: Bytes of constants: CUDA's constant memory.
MOST_BYTES = 65536
#: Code values by which the interpolated palette may differ at a frame of the clip.
TOLERANCE = 2e-6

_TEXT = """\
// {name}, frames {first} to {last}: a palette that changes through time, and its edits.
// Written by palette4d {version}.
// DaVinci Resolve: put this file in the LUT folder, then add ResolveFX DCTL to the clip.
DEFINE_UI_PARAMS(p4d_strength, Strength, DCTLUI_SLIDER_FLOAT, 1.0, 0.0, 1.0, 0.01)
DEFINE_UI_PARAMS(p4d_offset, Clip frame minus timeline frame, DCTLUI_VALUE_BOX, {offset})
#define P4D_FN __DEVICE__
#define P4D_STRUCT(name, body) typedef struct {{ body }} name;
#define P4D_SQRT _sqrtf
#define P4D_ATAN2 _atan2f
#define P4D_ABS _fabs
#define P4D_MIN _fminf
#define P4D_MAX _fmaxf
#define P4D_KEYS {keys}
#define P4D_CONVEX_ALL {convex}
#define P4D_TIME(k) p4d_times[k]
#define P4D_BODY(k) p4d_bodies[k]
#define P4D_FIRST(k) p4d_firsts[k]
#define P4D_F(i) p4d_faces[i]
#define P4D_K(i) p4d_values[i]
{arrays}
{kernel}
__DEVICE__ float3 transform(int p_Width, int p_Height, int p_X, int p_Y, float p_R, float p_G,
                            float p_B)
{{
    p4d_rgb m = p4d_at_frame((float)(TIMELINE_FRAME_INDEX) + (float)(p4d_offset), p_R, p_G, p_B);
    float r = p4d_strength * m.r, g = p4d_strength * m.g, b = p4d_strength * m.b;
    return make_float3(r != 0.0f ? p_R + r : p_R, g != 0.0f ? p_G + g : p_G,
                       b != 0.0f ? p_B + b : p_B);
}}
"""


@dataclass(frozen=True)
class DctlExport:
    """The DCTL file that was written.

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


@dataclass(frozen=True)
class _State:
    """The palette at a frame: its colours and displacements, (n, 6), and the body between them."""

    values: F64
    body: tuple[int, ...]
    convex: bool


def export_dctl(
    source: str | os.PathLike[str] | Document,
    path: str | os.PathLike[str],
    *,
    frames: str | None = None,
    force: bool = False,
) -> DctlExport:
    """Write a sidecar's palette, handle edits and ramps as a DCTL file for DaVinci Resolve.

    Parameters
    ----------
    source : path or Document
        A sidecar (.p4d.json), or a document.
    path : path
        The file to write, NAME.dctl.
    frames : str, optional
        A range of the clip, such as "1001-1100"; by default all of it.
    force : bool
        Replace an existing file.

    Returns
    -------
    DctlExport
        What was written. The result is within 1e-4 of `render` at every frame.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        The edit has what a DCTL cannot hold, such as picks; nothing was written.
    """
    output = Path(path)
    if output.suffix.lower() != ".dctl":
        raise Palette4dError(f"{output}: found no extension .dctl; name the file NAME.dctl")
    refuse_existing(output, force)
    sidecar = (
        source.grade.core
        if isinstance(source, Document)
        else _core.parse_sidecar(sidecars.read_bytes(source), os.fspath(source))
    )
    _check(sidecar)
    times = _frames(sidecar, frames)
    states = [_state(sidecar, frame) for frame in times]
    keys = keys_of(np.array(times), states)
    arrays, size = _arrays(times, states, keys)
    if size > MOST_BYTES:
        raise Palette4dError(
            f"{output}: found {size / 1024:.0f} KB of palette colours and edits, and a DCTL has "
            f"room for {MOST_BYTES // 1024} KB: export a range of the clip ({Arg('frames')}), or "
            "parts of it to a file each"
        )
    text = _TEXT.format(
        name=" ".join(printable(str(sidecar.clip["name"])).split()),
        first=frame_text(times[0]),
        last=frame_text(times[-1]),
        version=_core.__version__,
        offset=int(times[0]) - 1,
        keys=len(keys),
        convex=int(all(state.convex for state in states)),
        arrays=arrays,
        kernel=_core.kernel_text("clip"),
    )
    with replacing(output, force=force) as temporary:
        temporary.write_text(text, encoding="ascii", errors="replace", newline="\n")
    return DctlExport(str(output), int(times[0]), int(times[-1]), len(keys), size)


def _check(sidecar: _core.Sidecar) -> None:
    """Refuse what a DCTL cannot hold."""
    if sidecar.edits.pick_times:
        raise Palette4dError(
            "the edit has picks or holds, and a DCTL has no room for their mattes: use the node, "
            "or a LUT (palette4d export --every 1)"
        )
    if sidecar.conversion is not None:
        raise Palette4dError(
            f"the clip is in {sidecar.clip['encoding']} and its palette in another colour space, "
            "and a DCTL converts nothing: use the node, or a LUT (palette4d export --every 1)"
        )


def _frames(sidecar: _core.Sidecar, frames: str | None) -> list[float]:
    """Return the clip's frames, in order, that a range chooses."""
    polytope = sidecar.polytope
    first, last = polytope.first_frame, polytope.last_frame
    if frames is None:
        return [float(frame) for frame in range(int(first), int(last) + 1)]
    chosen = sorted(parse_frames(frames))
    for frame in (chosen[0], chosen[-1]):
        check_frame(sidecar, frame)
    return [float(frame) for frame in range(chosen[0], chosen[-1] + 1)]


def _state(sidecar: _core.Sidecar, frame: float) -> _State:
    """Return the palette at a frame."""
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
    rgb, faces = np.asarray(cut.rgb), np.asarray(cut.faces, int).reshape(-1, 3)
    solid, convex = False, True
    if len(faces) == 0:
        # A line of colours, or one: a face without area, whose sides count.
        faces = np.array([[0, len(rgb) - 1, len(rgb) - 1]])
    else:
        corners = rgb[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sizes = np.linalg.norm(normals, axis=1)
        good = sizes > 1e-8 * np.square(np.ptp(rgb, axis=0)).sum()
        normals[good] /= sizes[good, None]
        heights = np.einsum("fc,fvc->fv", normals, rgb[None] - corners[:, :1])[good]
        solid = bool((np.abs(heights) > 1e-9).any())
        convex = bool(good.all() and (heights < 1e-9).all())
        if not solid and good.any():
            # One side alone, or colours would jump at the other one's edges.
            faces = faces[good & (normals @ normals[good][0] > 0)]
    body = (len(faces), int(solid), *faces.ravel().tolist())
    return _State(np.concatenate([rgb, edited - rgb], axis=1), body, convex or not solid)


def bends(times: F64, states: Sequence[_State]) -> tuple[F64, float]:
    """Return how displacements go from the first state to the last, and the largest error between.

    Colours go in straight lines. A channel's displacement is d + w (d' - d + (1 - w) (a + b w)),
    where w is the part of the time: a cubic. The result is a and b of each channel, (n, 6).
    """
    values = np.stack([state.values for state in states])
    part = (times - times[0]) / (times[-1] - times[0])
    straight = values[0] + part[:, None, None] * (values[-1] - values[0])
    shape = (part * (1 - part))[:, None] * np.stack([np.ones_like(part), part], axis=1)
    rest = (values - straight)[:, :, 3:].reshape(len(times), -1)
    found = np.zeros((2, rest.shape[1]))
    if len(times) > 2:
        found = np.linalg.lstsq(shape, rest, rcond=None)[0]
        found[np.abs(found) < TOLERANCE] = 0
    bend = found.T.reshape(len(values[0]), 3, 2).transpose(0, 2, 1).reshape(-1, 6)
    error = np.abs(rest - shape @ found).max(initial=np.abs((values - straight)[:, :, :3]).max())
    return bend, float(error)


def keys_of(times: F64, states: Sequence[_State]) -> list[tuple[int, F64]]:
    """Return the fewest states between which all others follow, each with its `bends`."""
    keys, start, last = [], 0, len(states) - 1
    while start < last:
        end, step, bend = start + 1, 1, np.zeros((len(states[start].values), 6))
        # Doubles the step as long as it fits, then halves it.
        growing = True
        while step > 0:
            trial = min(end + step, last)
            one_body = all(s.body == states[start].body for s in states[end : trial + 1])
            fits = one_body and trial > end
            if fits:
                found, error = bends(times[start : trial + 1], states[start : trial + 1])
                fits = error <= TOLERANCE
            if fits:
                end, bend = trial, found
            growing = growing and fits
            step = step * 2 if growing else step // 2
        keys.append((start, bend))
        start = end
    return [*keys, (last, np.zeros((len(states[last].values), 6)))]


def _arrays(
    times: Sequence[float], states: Sequence[_State], keys: Sequence[tuple[int, F64]]
) -> tuple[str, int]:
    """Return the file's arrays, and their bytes."""
    faces: list[int] = []
    known: dict[tuple[int, ...], int] = {}
    bodies: list[int] = []
    firsts: list[int] = []
    values: list[float] = []
    for key, bend in keys:
        state = states[key]
        if state.body not in known:
            known[state.body] = len(faces)
            faces += state.body
        bodies.append(known[state.body])
        firsts.append(len(values))
        values += np.concatenate([state.values, bend], axis=1).ravel().tolist()
    arrays = [
        _array("float", "p4d_times", map(_number, (times[key] for key, _ in keys))),
        _array("int", "p4d_bodies", map(str, bodies)),
        _array("int", "p4d_firsts", map(str, firsts)),
        _array("int", "p4d_faces", map(str, faces)),
        _array("float", "p4d_values", map(_number, values)),
    ]
    return "\n".join(arrays), 4 * (3 * len(keys) + len(faces) + len(values))


def _number(value: float) -> str:
    """Return a float literal."""
    text = f"{np.float32(value):.9g}"
    return text + ("f" if re.search(r"[.e]", text) else ".0f")


def _array(kind: str, name: str, numbers: Iterable[str]) -> str:
    """Return an array of constants."""
    texts = list(numbers)
    rows = [", ".join(texts[i : i + 8]) for i in range(0, len(texts), 8)]
    return f"__CONSTANT__ {kind} {name}[{len(texts)}] = {{\n    " + ",\n    ".join(rows) + "};"
