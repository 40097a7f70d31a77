"""A clip's palette, edits and time as constants and the kernel's text, whatever the dialect.

What runs nothing before the pixels sees single pixels and a frame: so the palette and its
displacements are stored at a few times (`keys_of`), between which each pixel interpolates.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.clip_conversion import Conversion
from palette4d.lut_export.clip_picks import pick_constants
from palette4d.lut_export.frame_edit import check_frame

from palette4d import _core
from palette4d.common.arguments import parse_frames
from palette4d.common.errors import Arg, Palette4dError

F64 = NDArray[np.float64]

#: Bytes of constants: CUDA's constant memory.
MOST_BYTES = 65536
#: Code values by which the interpolated palette may differ at a frame of the clip.
TOLERANCE = 2e-6


@dataclass(frozen=True)
class ClipText:
    """A clip for a dialect.

    Attributes
    ----------
    first, last : the clip's frames that it knows; before and after them the nearest holds.
    keys : times at which the palette is stored.
    arrays : constants by name; numbers are all float, or all int.
    defines : macros, beside those of the dialect.
    text : the kernel; p4d_at_strength(frame, strength, r, g, b) draws.
    """

    first: int
    last: int
    keys: int
    arrays: dict[str, list[int] | list[float]]
    defines: str
    text: str

    @property
    def size(self) -> int:
        """Bytes of constants."""
        return 4 * sum(map(len, self.arrays.values()))


@dataclass(frozen=True)
class _State:
    """The palette at a frame: its colours and displacements, (n, 6), and the body between them."""

    values: F64
    body: tuple[int, ...]
    convex: bool


def clip_text(sidecar: _core.Sidecar, frames: str | None, output: object) -> ClipText:
    """Return a sidecar's palette, edits, picks and conversion at the frames of a range.

    Palette4dError where they take more than `MOST_BYTES`; `output` is named in it.
    """
    times = _frames(sidecar, frames)
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
    texts = [_core.kernel_text("clip")]
    try:
        picks = pick_constants(sidecar.edits, times, [_recolourer(sidecar, t) for t in times])
    except ValueError as error:
        raise Palette4dError(f"{output}: {error}") from error
    if picks is not None:
        width = picks.tables.shape[1]
        arrays |= {
            "p4d_pick_times": picks.times,
            "p4d_pick_tables": picks.tables.ravel().tolist(),
            "p4d_stills": picks.stills,
            "p4d_books": picks.values,
        }
        defines += [
            "#define P4D_TABLE int t_, int n_, float w_,",
            "#define P4D_PASS t_, n_, w_,",
            "#define P4D_T(i) p4d_timed(t_ + (i), n_ + (i), w_)",
            "#define P4D_G(i) p4d_books[i]",
            "#define P4D_S(i) p4d_stills[i]",
            f"#define P4D_PICK_KEYS {len(picks.times)}",
            "#define P4D_PICK_TIME(k) p4d_pick_times[k]",
            f"#define P4D_PICK_FIRST(k) ({width} * (k))",
        ]
        texts += [_TIMED, _core.kernel_text("clip_picks")]
    if sidecar.conversion is not None and not sidecar.conversion.steps.identity:
        conversion = Conversion(sidecar.conversion.steps)
        defines += ["#define P4D_CONVERTS", "#define P4D_C(i) p4d_curves[i]"]
        if conversion.samples:
            arrays["p4d_curves"] = conversion.samples
        texts.append(conversion.text)
    texts.append(_core.kernel_text("clip_main"))
    text = "\n".join(texts)
    done = ClipText(int(times[0]), int(times[-1]), len(keys), arrays, "\n".join(defines), text)
    if done.size > MOST_BYTES:
        found = f"{done.size / 1024:.0f} KB of palette colours and edits"
        help_ = f"export a range of the clip ({Arg('frames')}), or parts of it to a file each"
        if picks is not None:
            # A range has the same grids: it helps with the rest alone.
            found += f", {picks.size / 1024:.0f} KB of them for picks and holds"
            help_ = f"switch picks off, or {help_}"
        raise Palette4dError(
            f"{output}: found {found}, and there is room for {MOST_BYTES // 1024} KB: {help_}"
        )
    return done


_TIMED = """
P4D_FN float p4d_timed(int now, int next, float w) {
    float a = p4d_pick_tables[now], b = p4d_pick_tables[next];
    return a + w * (b - a);
}
"""


def _recolourer(sidecar: _core.Sidecar, frame: float) -> _core.Recolourer:
    """Return the edit at a frame."""
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
    return _core.Recolourer(cut.rgb, edited, cut.faces, picks=sidecar.picks_at(cut.frame))


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
) -> dict[str, list[int] | list[float]]:
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
