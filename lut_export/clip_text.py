"""A clip's palette, edits and time as constants and the kernel's text, whatever the dialect.

What runs nothing before the pixels sees single pixels and a frame: so the palette and its
displacements are stored at a few times (`keys_of`), between which each pixel interpolates.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.clip_conversion import Conversion
from palette4d.lut_export.clip_picks import PickConstants, pick_constants
from palette4d.lut_export.frame_edit import check_frame

from palette4d import _core
from palette4d.common.arguments import frames_between, parse_frames
from palette4d.common.errors import Arg, Palette4dError

F64 = NDArray[np.float64]
Numbers = list[int] | list[float]

#: Bytes of constants: CUDA's constant memory.
MOST_BYTES = 65536
#: Values of the picks' mattes, of which the first that has room is taken; 0: as many as they have.
LEVELS = (0, 32, 16, 8, 4)
#: Code values by which the interpolated palette may differ at a frame of the clip.
TOLERANCE = 2e-6


@dataclass(frozen=True)
class ClipText:
    """A clip for a dialect.

    Attributes
    ----------
    first, last : the clip's frames that it knows; before and after them the nearest holds.
    keys : times at which the palette is stored.
    levels : values that the picks' mattes were reduced to; 0: they are exact.
    error : in the palette's code values, what that changes.
    arrays : constants by name; numbers are all float, or all int.
    texture : (h, 256, 4) bytes of the picks' mattes, which the dialect's p4d_word(i) reads; None
        where there are no picks, or where `arrays` have them.
    defines : macros, beside those of the dialect.
    text : the kernel; p4d_at_strength(frame, strength, r, g, b) draws.
    """

    first: int
    last: int
    keys: int
    levels: int
    error: float
    arrays: dict[str, Numbers]
    texture: NDArray[np.uint8] | None
    defines: str
    text: str

    @property
    def size(self) -> int:
        """Bytes of constants."""
        return _size(self.arrays)


@dataclass(frozen=True)
class _State:
    """The palette at a frame: its colours and displacements, (n, 6), and the body between them."""

    values: F64
    body: tuple[int, ...]
    convex: bool


def clip_text(
    sidecar: _core.Sidecar, frames: str | None, output: object, *, textures: bool
) -> ClipText:
    """Return a sidecar's palette, edits, picks and conversion at the frames of a range.

    `textures`: whether the dialect has them. Else mattes are reduced so far that they have room.
    Palette4dError where all takes more than `MOST_BYTES`; `output` is named in it.
    """
    times = _frames(sidecar, frames)
    if windows := dict.fromkeys(id_ for time in times for id_ in sidecar.edits.windows_at(time)):
        ids = ", ".join(windows)
        raise Palette4dError(
            f"{output}: found windows of {ids}, and such a file knows no places in the picture; "
            "use the node or `palette4d render`, remove them (`window ID --none`), or disable "
            f"{ids}"
        )
    states = [_state(sidecar, frame) for frame in times]
    keys = keys_of(np.array(times), states)
    arrays = _arrays(times, states, keys)
    defines = [
        f"#define P4D_KEYS {len(keys)}",
        f"#define P4D_CONVEX_ALL {int(all(state.convex for state in states))}",
        "#define P4D_TIME(k) p4d_times[k]",
        "#define P4D_BODY(k) p4d_bodies[k]",
        "#define P4D_FIRST(k) p4d_firsts[k]",
        "#define P4D_F(i) p4d_faces[i]",
        "#define P4D_K(i) p4d_values[i]",
    ]
    conversion: list[str] = []
    if sidecar.conversion is not None and not sidecar.conversion.steps.identity:
        steps = Conversion(sidecar.conversion.steps)
        defines += ["#define P4D_CONVERTS", "#define P4D_CURVES", "#define P4D_C(i) p4d_curves[i]"]
        if steps.samples:
            arrays["p4d_curves"] = steps.samples
        conversion = [steps.text]
    if _size(arrays) > MOST_BYTES:
        raise Palette4dError(
            f"{output}: found {_size(arrays) / 1024:.0f} KB of palette colours and edits, and "
            f"there is room for {MOST_BYTES // 1024} KB: export a range of the clip "
            f"({Arg('frames')}), or parts of it to a file each"
        )
    room = MOST_BYTES - _size(arrays)
    levels, picks = _picks(sidecar, times, room, output, textures=textures)
    texture, texts = None, [_core.kernel_text("clip")]
    if picks is not None:
        arrays |= {
            "p4d_pick_times": picks.times,
            "p4d_pick_tables": picks.tables.ravel().tolist(),
            "p4d_pick_columns": picks.columns,
            "p4d_pick_fixed": picks.fixed,
        }
        if textures:
            texture = picks.texture
            read = "p4d_word(i)", f"intBitsToFloat(p4d_word({len(picks.stills)} + (i)))"
        else:
            arrays |= {"p4d_stills": picks.stills, "p4d_books": picks.values}
            read = "p4d_stills[i]", "p4d_books[i]"
        defines += [
            "#define P4D_TABLE int t_, int n_, float w_,",
            "#define P4D_PASS t_, n_, w_,",
            "#define P4D_T(i) p4d_timed(i, t_, n_, w_)",
            f"#define P4D_S(i) {read[0]}",
            f"#define P4D_G(i) {read[1]}",
            f"#define P4D_BITS {picks.bits}",
            f"#define P4D_PICK_KEYS {len(picks.times)}",
            "#define P4D_PICK_TIME(k) p4d_pick_times[k]",
            f"#define P4D_PICK_FIRST(k) ({picks.tables.shape[1]} * (k))",
        ]
        texts += [_TIMED, _core.kernel_text("clip_picks")]
    text = "\n".join([*texts, *conversion, _core.kernel_text("clip_main")])
    error = _error(sidecar, levels, picks.times) if picks is not None and levels else 0.0
    first, last = int(times[0]), int(times[-1])
    return ClipText(
        first, last, len(keys), levels, error, arrays, texture, "\n".join(defines), text
    )


def _picks(
    sidecar: _core.Sidecar, times: Sequence[float], room: int, output: object, *, textures: bool
) -> tuple[int, PickConstants | None]:
    """Return the picks with as many values in their mattes as have room, and how many."""
    size = 0
    for levels in LEVELS:
        edits = sidecar.edits.with_matte_levels(levels)
        try:
            picks = pick_constants(edits, times, [_recolourer(sidecar, edits, t) for t in times])
        except ValueError as error:
            raise Palette4dError(f"{output}: {error}") from error
        if picks is None:
            return 0, None
        size = picks.table_size if textures else picks.size
        if size <= room:
            return levels, picks
    raise Palette4dError(
        f"{output}: found {size / 1024:.0f} KB of picks and holds, reduced as far as they can be, "
        f"and there is room for {room / 1024:.0f} KB of {MOST_BYTES // 1024} KB: switch picks off, "
        f"or export a range of the clip ({Arg('frames')})"
    )


def _error(sidecar: _core.Sidecar, levels: int, times: Sequence[float]) -> float:
    """Return the largest change of a code value, over a grid of colours, by reduced mattes."""
    axis = np.linspace(0, 1, 49, dtype=np.float32)
    grid = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(1, -1, 3)
    edits = sidecar.edits, sidecar.edits.with_matte_levels(levels)
    largest = 0.0
    for frame in times[:: -(-len(times) // 9)]:
        exact, reduced = (_recolourer(sidecar, e, frame).apply(grid) for e in edits)
        largest = max(largest, float(np.abs(exact - reduced).max()))
    return largest


def _size(arrays: dict[str, Numbers]) -> int:
    """Return the bytes of constants."""
    return 4 * sum(map(len, arrays.values()))


_TIMED = """
P4D_FN float p4d_timed(int i, int now, int next, float w) {
    int column = p4d_pick_columns[i];
    float a, b;
    if (column < 0) return p4d_pick_fixed[-1 - column];
    a = p4d_pick_tables[now + column];
    b = p4d_pick_tables[next + column];
    return a + w * (b - a);
}
"""


def _recolourer(sidecar: _core.Sidecar, edits: _core.Edits, frame: float) -> _core.Recolourer:
    """Return edits at a frame."""
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, edits, cut)
    return _core.Recolourer(cut.rgb, edited, cut.faces, picks=edits.picks_at(cut.frame))


def _frames(sidecar: _core.Sidecar, frames: str | None) -> list[float]:
    """Return the clip's frames, in order, that a range chooses."""
    polytope = sidecar.polytope
    first, last = polytope.first_frame, polytope.last_frame
    if frames is None:
        return [float(frame) for frame in frames_between(int(first), int(last))]
    chosen = sorted(parse_frames(frames))
    for frame in (chosen[0], chosen[-1]):
        check_frame(sidecar, frame)
    return [float(frame) for frame in frames_between(chosen[0], chosen[-1])]


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
    slopes = np.zeros((2, rest.shape[1]))
    if len(times) > 2:
        slopes = np.linalg.lstsq(shape, rest, rcond=None)[0]
        slopes[np.abs(slopes) < TOLERANCE] = 0
    bend = slopes.T.reshape(len(values[0]), 3, 2).transpose(0, 2, 1).reshape(-1, 6)
    error = np.abs(rest - shape @ slopes).max(initial=np.abs((values - straight)[:, :, :3]).max())
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
                bent, error = bends(times[start : trial + 1], states[start : trial + 1])
                fits = error <= TOLERANCE
            if fits:
                end, bend = trial, bent
            growing = growing and fits
            step = step * 2 if growing else step // 2
        keys.append((start, bend))
        start = end
    return [*keys, (last, np.zeros((len(states[last].values), 6)))]


def _arrays(
    times: Sequence[float], states: Sequence[_State], keys: Sequence[tuple[int, F64]]
) -> dict[str, Numbers]:
    """Return the palette's arrays."""
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
    return {
        "p4d_times": [times[key] for key, _ in keys],
        "p4d_bodies": bodies,
        "p4d_firsts": firsts,
        "p4d_faces": faces,
        "p4d_values": values,
    }
