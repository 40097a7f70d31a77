"""A clip's palette, edits and time as constants and the kernel's text, whatever the dialect.

What runs nothing before the pixels sees single pixels and a frame: so the palette and its
displacements are stored at a few times (`keys_of`), between which each pixel interpolates.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.clip_conversion import Conversion
from palette4d.lut_export.clip_keys import F64, bends, keys_of
from palette4d.lut_export.clip_picks import PickConstants, codes_in_word, pick_constants
from palette4d.lut_export.frame_edit import check_frame

from palette4d import _core
from palette4d.common.arguments import frames_between, parse_frames
from palette4d.common.errors import Arg, Palette4dError

Numbers = list[int] | list[float]

#: Bytes of constants: CUDA's constant memory.
MOST_BYTES = 65536
#: Values of the picks' mattes, of which the first that has room is taken; 0: as many as they have.
#: Of these most codes have room in a word.
LEVELS = (0, 35, 21, 14, 10, 8, 6, 4)
#: By how many code values fewer values may be off, unless the user accepts more: 5 of 255.
MAX_ERROR = 0.02
#: Frames at which that is measured, and colours at each. More take longer; fewer miss the largest.
MEASURED, MEASURED_COLOURS = 48, 100_000
#: Code values by which the interpolated palette may differ at a frame of the clip.
TOLERANCE = 2e-6


@dataclass(frozen=True)
class ClipText:
    """A clip for a dialect.

    Attributes
    ----------
    begins : the clip's first frame, also where a range of it is written.
    first, last : the clip's frames that it knows; before and after them the nearest holds.
    keys, pick_keys : times at which the palette is stored, and at which picks and holds are.
    levels : values that the picks' mattes were reduced to; 0: they are exact.
    error : in the palette's code values, what that changes.
    has_picks : picks or holds ask for something.
    arrays : constants by name; numbers are all float, or all int.
    texture : (h, 256, 4) bytes of the picks' mattes, which the dialect's p4d_word(i) reads; None
        where there are no picks, or where `arrays` have them.
    defines : macros, beside those of the dialect.
    text : the kernel; p4d_at_strength(frame, strength, r, g, b) draws.
    """

    begins: int
    first: int
    last: int
    keys: int
    pick_keys: int
    levels: int
    error: float
    has_picks: bool
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
    sidecar: _core.Sidecar,
    frames: str | None,
    output: object,
    *,
    textures: bool,
    max_error: float = MAX_ERROR,
) -> ClipText:
    """Return a sidecar's palette, edits, picks and conversion at the frames of a range.

    `textures`: whether the dialect has them. Else mattes are reduced so far that they have room.
    Palette4dError where all takes more than `MOST_BYTES`, or where that takes an error of more than
    `max_error`; `output` is named in it.
    """
    if not (isinstance(max_error, int | float) and max_error >= 0):
        raise Palette4dError(f"found the error {max_error!r}, expected 0 or more code values")
    times = _frames(sidecar, frames)
    if windows := dict.fromkeys(id_ for time in times for id_ in sidecar.edits.windows_at(time)):
        ids = ", ".join(windows)
        raise Palette4dError(
            f"{output}: found windows of {ids}, and such a file knows no places in the picture; "
            "use the node or `palette4d render`, remove them (`window ID --none`), or disable "
            f"{ids}"
        )
    states = [_state(sidecar, frame) for frame in times]
    keys = keys_of(len(times), lambda key, end: _bends(times, states, key, end) is not None)
    arrays, width = _arrays(times, states, keys)
    defines = [
        f"#define P4D_KEYS {len(keys)}",
        f"#define P4D_WIDTH {width}",
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
    levels, picks, error = _picks(sidecar, times, room, output, textures, max_error)
    texture, texts = None, [_core.kernel_text("clip")]
    if picks is not None:
        arrays["p4d_times"] += picks.times
        tracks = np.add(picks.tracks, [len(keys), len(keys), 0, 0, 0])
        arrays |= {
            "p4d_pick_columns": picks.columns,
            "p4d_pick_fixed": picks.fixed,
            "p4d_pick_tracks": tracks.ravel().tolist(),
            "p4d_pick_values": picks.values,
        }
        if textures:
            texture = picks.texture
            read = "p4d_word(i)", f"intBitsToFloat(p4d_word({len(picks.stills)} + (i)))"
        else:
            arrays |= {"p4d_stills": picks.stills, "p4d_books": picks.books}
            read = "p4d_stills[i]", "p4d_books[i]"
        column = "p4d_pick_columns[i]"
        defines += [
            "#define P4D_TABLE p4d_now now_,",
            "#define P4D_PASS now_,",
            # Where i is constant, GLSL refuses an index that is out of bounds in any branch.
            "#define P4D_FIXED(i) p4d_pick_fixed[i < 0 ? -1 - i : 0]",
            "#define P4D_NOW(i) now_.t[i < 0 ? 0 : i]",
            f"#define P4D_T(i) ({column} < 0 ? P4D_FIXED({column}) : P4D_NOW({column}))",
            f"#define P4D_S(i) {read[0]}",
            f"#define P4D_G(i) {read[1]}",
            f"#define P4D_BASE {picks.base}",
            f"#define P4D_CODES {codes_in_word(picks.base)}",
            f"#define P4D_TRACKS {len(picks.tracks)}",
            f"#define P4D_MOVING {picks.moving}",
            "#define P4D_TRACK(i) p4d_pick_tracks[i]",
            "#define P4D_V(i) p4d_pick_values[i]",
        ]
        texts.append(_core.kernel_text("clip_picks"))
    text = "\n".join([*texts, *conversion, _core.kernel_text("clip_main")])
    return ClipText(
        int(sidecar.clip["first"]),
        int(times[0]),
        int(times[-1]),
        len(keys),
        len(picks.times) if picks is not None else 0,
        levels,
        error,
        picks is not None,
        arrays,
        texture,
        "\n".join(defines),
        text,
    )


def _picks(
    sidecar: _core.Sidecar,
    times: Sequence[float],
    room: int,
    output: object,
    textures: bool,
    max_error: float,
) -> tuple[int, PickConstants | None, float]:
    """Return the picks with as many values in their mattes as have room, how many, their error."""
    edits = sidecar.edits
    try:
        picks = pick_constants(edits, times, [_recolourer(sidecar, edits, t) for t in times])
    except ValueError as error:
        raise Palette4dError(f"{output}: {error}") from error
    if picks is None:
        return 0, None, 0.0
    less = f"switch picks off, or export a range of the clip ({Arg('frames')})"
    size = picks.table_size
    for levels in (0,) if textures else LEVELS:
        reduced = picks.with_mattes(edits.with_matte_levels(levels)) if levels else picks
        size = reduced.table_size if textures else reduced.size
        if size > room:
            continue
        off = _error(sidecar, levels, times) if levels else 0.0
        if off > max_error:
            raise Palette4dError(
                f"{output}: found code values off by about {off:.2g}, since the mattes of picks "
                f"have room for {levels} values only; expected at most {max_error:.2g}: {less}, or "
                f"accept that ({Arg('max_error', ceil(off * 100) / 100)})"
            )
        return levels, reduced, off
    raise Palette4dError(
        f"{output}: found {size / 1024:.0f} KB of picks and holds, as few as they can be, and "
        f"there is room for {room / 1024:.0f} KB of {MOST_BYTES // 1024} KB: {less}"
    )


def _error(sidecar: _core.Sidecar, levels: int, times: Sequence[float]) -> float:
    """Return the largest change of a code value by reduced mattes, at some frames and colours."""
    draws = np.random.default_rng(1)
    edits = sidecar.edits, sidecar.edits.with_matte_levels(levels)
    largest = 0.0
    for i in sorted({round(at) for at in np.linspace(0, len(times) - 1, MEASURED)}):
        colours = draws.random((1, MEASURED_COLOURS, 3), np.float32)
        exact, reduced = (_recolourer(sidecar, e, times[i]).apply(colours) for e in edits)
        largest = max(largest, float(np.abs(exact - reduced).max()))
    return largest


def _size(arrays: dict[str, Numbers]) -> int:
    """Return the bytes of constants."""
    return 4 * sum(map(len, arrays.values()))


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


def _bends(times: Sequence[float], states: Sequence[_State], key: int, end: int) -> F64 | None:
    """Return how displacements bend, (n, 6), on the way to `end`; None: not all states follow.

    Colours go in straight lines.
    """
    if any(state.body != states[key].body for state in states[key : end + 1]):
        return None
    values = np.stack([state.values for state in states[key : end + 1]])
    part = np.array(times[key : end + 1])
    way = ((part - part[0]) / (part[-1] - part[0]))[:, None, None]
    straight = values[0] + way * (values[-1] - values[0])
    bent, errors = bends(part, values[:, :, 3:].reshape(len(part), -1))
    if np.abs(values - straight)[:, :, :3].max(initial=errors.max()) > TOLERANCE:
        return None
    return bent.T.reshape(-1, 3, 2).transpose(0, 2, 1).reshape(-1, 6)


def _arrays(
    times: Sequence[float], states: Sequence[_State], keys: Sequence[int]
) -> tuple[dict[str, Numbers], int]:
    """Return the palette's arrays, and how many values a colour has."""
    faces: list[int] = []
    known: dict[tuple[int, ...], int] = {}
    bodies: list[int] = []
    rows: list[F64] = []
    for key, end in zip(keys, [*keys[1:], keys[-1]], strict=True):
        state = states[key]
        if state.body not in known:
            known[state.body] = len(faces)
            faces += state.body
        bodies.append(known[state.body])
        bend = _bends(times, states, key, end) if end > key else None
        bend = np.zeros_like(state.values) if bend is None else bend  # to another body, or the last
        rows.append(np.concatenate([state.values, bend], axis=1))
    values = np.concatenate(rows)
    width = next(n for n in (3, 6, 12) if not values[:, n:].any())
    firsts = width * np.cumsum([0, *map(len, rows[:-1])])
    arrays: dict[str, Numbers] = {
        "p4d_times": [times[key] for key in keys],
        "p4d_bodies": bodies,
        "p4d_firsts": firsts.tolist(),
        "p4d_faces": faces,
        "p4d_values": values[:, :width].ravel().tolist(),
    }
    return arrays, width
