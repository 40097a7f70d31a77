"""The plain reference: slices, edited colours, weights and recolouring in textbook NumPy.

Written from the paper and from Ju, Schaefer and Warren (2005), float64, one point at a time, with
no thought of speed and apart from the C++ core. It reads the sidecar's JSON document directly. All
cases of `cases.py` run on it and on the compiled core; where they differ, one of them is wrong.
"""

from __future__ import annotations

import base64
import functools
import itertools
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
Document = dict[str, Any]

ON_SURFACE = 1e-11  # distances that count as none


# Slices (eq. 5) and edits (section 6.3) ---------------------------------------------------------


def vertices_by_id(document: Document) -> dict[str, dict[str, Any]]:
    """The polytope's vertices by their ids."""
    return {vertex["id"]: vertex for vertex in document["polytope"]["vertices"]}


def section_at(document: Document, frame: float) -> dict[str, Any]:
    """The block that holds a frame of the clip, else the transition between two blocks."""
    blocks = document["polytope"]["blocks"]
    for block in blocks:
        if block["first"] <= frame <= block["last"]:
            return block
    for before, after, transition in zip(
        blocks[:-1], blocks[1:], document["polytope"]["transitions"], strict=True
    ):
        if before["last"] < frame < after["first"]:
            return transition
    raise AssertionError(f"frame {frame} lies in no section")


def clamped(document: Document, frame: float) -> float:
    """The frame, or the clip's nearest."""
    blocks = document["polytope"]["blocks"]
    return min(max(float(frame), float(blocks[0]["first"])), float(blocks[-1]["last"]))


def positions(document: Document, frame: float) -> list[tuple[str, str, float]]:
    """For each track, (id of the vertex before, id of the one after, weight of the latter)."""
    frame = clamped(document, frame)
    vertices = vertices_by_id(document)
    result = []
    for track in section_at(document, frame)["tracks"]:
        for name in track:
            if vertices[name]["frame"] == frame:
                result.append((name, name, 0.0))
                break
        else:
            for earlier, later in itertools.pairwise(track):
                start, end = vertices[earlier]["frame"], vertices[later]["frame"]
                if start < frame < end:
                    result.append((earlier, later, (frame - start) / (end - start)))
    return result


def slice_rgb(document: Document, frame: float) -> F64:
    """(n, 3) original palette colours at a frame."""
    vertices = vertices_by_id(document)
    rows = []
    for earlier, later, weight in positions(document, frame):
        u, v = np.array(vertices[earlier]["rgb"], float), np.array(vertices[later]["rgb"], float)
        rows.append((1 - weight) * u + weight * v)
    return np.array(rows).reshape(-1, 3)


def slice_faces(document: Document, frame: float) -> list[list[int]]:
    """Triangles of track indices at a frame."""
    return section_at(document, clamped(document, frame))["faces"]


Knots = list[tuple[float, F64]]


def edge_between(document: Document, earlier: str, later: str) -> dict[str, Any]:
    """The edge from a vertex to another."""
    edges = document["polytope"]["edges"]
    return next(edge for edge in edges if (edge["from"], edge["to"]) == (earlier, later))


def displacements(document: Document, edge: dict[str, Any]) -> Knots:
    """What the handles of an edge do: times and displacements, its ends included."""
    vertices = vertices_by_id(document)
    new = {edit["vertex"]: edit["rgb"] for edit in document["edits"]["vertices"]}
    ends = [vertices[edge[end]] for end in ("from", "to")]
    times = [float(end["frame"]) for end in ends]
    knots = [
        (end["frame"], np.subtract(new.get(end["id"], end["rgb"]), end["rgb"])) for end in ends
    ]
    for stop in document["edits"]["stops"]:
        if stop["edge"] == edge["id"]:
            own = [
                np.interp(stop["frame"], times, [end["rgb"][c] for end in ends]) for c in range(3)
            ]
            knots.append((stop["frame"], np.subtract(stop["rgb"], own)))
    return sorted(knots, key=lambda knot: knot[0])


def chain(document: Document, edge: dict[str, Any]) -> tuple[Knots, bool, bool]:
    """The knots of a colour's way through an edge, and whether it splits or merges at either end.

    The way goes on across vertices that one edge enters and one leaves.
    """
    edges = document["polytope"]["edges"]
    knots, branches = displacements(document, edge), [False, False]
    for side, (here, there) in enumerate((("from", "to"), ("to", "from"))):
        at = edge
        while True:
            beyond = [e for e in edges if e[there] == at[here]]
            alike = [e for e in edges if e[here] == at[here]]
            branches[side] = len(beyond) > 1 or len(alike) > 1
            if branches[side] or not beyond:
                break
            at = beyond[0]
            more = displacements(document, at)
            knots = more[:-1] + knots if side == 0 else knots + more[1:]
    return knots, branches[0], branches[1]


def smooth(document: Document, edge: dict[str, Any], frame: float) -> F64:
    """The monotone cubic of Fritsch and Butland (1984) through a chain, Hermite's form."""
    knots, splits, merges = chain(document, edge)
    times = np.array([time for time, _ in knots], float)
    values = np.array([value for _, value in knots])
    steps = np.diff(times)
    secants = np.diff(values, axis=0) / steps[:, None]
    slopes = np.zeros_like(values)
    for c in range(3):
        for k in range(1, len(times) - 1):
            before, after = secants[k - 1, c], secants[k, c]
            if before * after > 0:
                weights = 2 * steps[k] + steps[k - 1], steps[k] + 2 * steps[k - 1]
                slopes[k, c] = sum(weights) / (weights[0] / before + weights[1] / after)
        for end, inner, free in ((0, 1, not splits), (-1, -2, not merges)):
            if not free:
                continue
            first = secants[end, c]
            if len(secants) == 1:
                slopes[end, c] = first
                continue
            second, h, k = secants[inner, c], steps[end], steps[inner]
            slope = ((2 * h + k) * first - h * second) / (h + k)
            if slope * first <= 0:
                slope = 0.0
            elif first * second <= 0 and abs(slope) > 3 * abs(first):
                slope = 3 * first
            slopes[end, c] = slope
    i = int(np.searchsorted(times, frame, "right")) - 1
    h = steps[i]
    u = (frame - times[i]) / h
    return (
        (1 + 2 * u) * (1 - u) ** 2 * values[i]
        + u * (1 - u) ** 2 * h * slopes[i]
        + u**2 * (3 - 2 * u) * values[i + 1]
        + u**2 * (u - 1) * h * slopes[i + 1]
    )


def edited_colours(document: Document, frame: float) -> F64:
    """(n, 3) palette colours at a frame after the edits: handles and ramps."""
    frame = clamped(document, frame)
    vertices, edits = vertices_by_id(document), document["edits"]
    new = {edit["vertex"]: edit["rgb"] for edit in edits["vertices"]}
    rows = []
    for original, (earlier, later, _) in zip(
        slice_rgb(document, frame), positions(document, frame), strict=True
    ):
        ends = {name: new.get(name, vertices[name]["rgb"]) for name in (earlier, later)}
        if earlier == later:
            row = np.array(ends[earlier], float)
        else:
            edge = edge_between(document, earlier, later)
            knots = [(vertices[name]["frame"], rgb) for name, rgb in ends.items()]
            own = [edit.get("ramp") for edit in edits["vertices"] if edit["vertex"] == earlier]
            ramps = {vertices[earlier]["frame"]: own[0] if own else None}
            for stop in edits["stops"]:
                if stop["edge"] == edge["id"]:
                    knots.append((stop["frame"], stop["rgb"]))
                    ramps[stop["frame"]] = stop.get("ramp")
            knots.sort(key=lambda knot: knot[0])
            for (start, before), (end, after) in itertools.pairwise(knots):
                if not start <= frame < end:
                    continue
                ramp = ramps[start] or edits.get("ramp", "linear")
                weight = (frame - start) / (end - start)
                if start == frame:
                    row = np.array(before, float)
                elif ramp == "linear":
                    row = (1 - weight) * np.array(before, float) + weight * np.array(after, float)
                elif ramp == "smooth":
                    row = original + smooth(document, edge, frame)
                else:
                    row = original + dict(displacements(document, edge))[start]
        rows.append(row)
    return np.array(rows).reshape(-1, 3)


# Picks -------------------------------------------------------------------------------------------

GRID = (96, 96, 16)  # two axes of saturation within +-0.7, and lightness 0 to 1
LEAST, MOST = np.array([-0.7, -0.7, 0.0]), np.array([0.7, 0.7, 1.0])
NODES = np.stack(
    np.meshgrid(*(np.linspace(*ends) for ends in zip(LEAST, MOST, GRID, strict=True)),
                indexing="ij"), axis=-1,
)  # fmt: skip
NOISE, NEAR, LEAST_LIGHT = 0.04, 0.05, 0.02  # chroma, saturation, lightness


@dataclass(frozen=True)
class Picked:
    """One pick at a frame: where it is, what it asks for, and its matte, (96, 96, 16)."""

    colour: F64
    change: F64
    strength: float
    matte: F32
    # left, top, right, bottom; the feather; whether it is inverted
    window: tuple[F64, float, bool] | None = None


@dataclass(frozen=True)
class Picks:
    """All picks at a frame, what holds leave of the palette's changes, and the display's curve."""

    picks: list[Picked] = field(default_factory=list)
    left: F32 | None = None
    curve: tuple[float, float, list[float]] | None = None
    size: tuple[float, float] = (1, 1)


def shown(colour: ArrayLike, curve: tuple[float, float, list[float]] | None) -> F64:
    """A display's code values of the palette's."""
    at = np.asarray(colour, float)
    if curve is None:
        return at
    return np.interp(at, np.linspace(curve[0], curve[1], len(curve[2])), curve[2])


def chroma(display: F64) -> F64:
    """The part of a colour across grey, along orange and along green against blue."""
    axes = np.array([[2, -1, -1], [0, 1, -1]]) / np.sqrt([[6], [2]])
    return axes @ display


def point(display: F64) -> F64:
    """Saturation, two coordinates, and lightness."""
    lightness = max(*display, 0.0)
    return np.array([*(chroma(display) / (lightness + 0.2)), lightness])


def apart2(a: F64, b: F64) -> Any:
    """Squared distances of points."""
    return (((a - b) * (1, 1, 0.4)) ** 2).sum(axis=-1)


def smooth_step(x: Any, low: float, high: float) -> Any:
    """0 up to `low`, 1 from `high` on."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def certainty(display: F64) -> float:
    """How certain a colour's hue is."""
    square = float(chroma(display) @ chroma(display))
    return square / (square + NOISE**2)


def amount(display: F64, of: F64) -> float:
    """How much of a picked colour is in another one."""
    toward, own = chroma(of), chroma(display)
    hue = max(toward @ own, 0.0) / (toward @ toward + NOISE**2)
    hue *= smooth_step(own @ own, 0, NOISE**2)
    picked, grey = (np.clip(colour.mean(), 0, 1) for colour in (of, display))
    light = min(
        (grey + LEAST_LIGHT) / (picked + LEAST_LIGHT),
        (1 - grey + LEAST_LIGHT) / (1 - picked + LEAST_LIGHT),
        1.0,
    )
    found = float(hue + (1 - certainty(of)) * light)
    return 2 - 1 / found if found > 1 else found


def between(grid: NDArray[Any], at: F64) -> Any:
    """Values of a grid at points (..., 3), linear between its nodes and level beyond them."""
    steps = np.array(GRID) - 1
    place = np.clip((at - LEAST) / (MOST - LEAST) * steps, 0, steps)
    low = np.minimum(place.astype(int), steps - 1)
    part = place - low
    found = 0.0
    for corner in itertools.product((0, 1), repeat=3):
        weight = np.prod(np.where(corner, part, 1 - part), axis=-1)
        found = found + weight * grid[tuple(np.moveaxis(low + corner, -1, 0))].astype(float)
    return found


def hue_odds(display: F64) -> NDArray[np.int_]:
    """(96, 96, 16) the matte of a hue, 0 to 126."""
    own, certain = point(display), certainty(display)
    saturation = NODES[..., :2]
    direction = chroma(display) / max(float(np.linalg.norm(chroma(display))), 1e-9)
    along = saturation @ direction
    aside2 = (saturation**2).sum(axis=-1) - along**2
    width2 = NEAR**2 + (0.4452 * np.maximum(along, 0)) ** 2
    cone = aside2 / width2 + (np.minimum(along, 0) / NEAR) ** 2
    ball = ((saturation - own[:2]) ** 2).sum(axis=-1) / (1.5 * NEAR) ** 2
    ball = ball + ((NODES[..., 2] - own[2]) / 0.3) ** 2
    membership = np.exp(-(certain * cone + (1 - certain) * ball) / 2).astype(np.float32)
    m = np.clip(membership.astype(float), 1e-9, 1 - 1e-9)
    odds = np.clip(np.log(m / (1 - m)) * 63 / 6, -63, 63)
    return (63 + np.trunc(odds + np.copysign(0.5, odds))).astype(int)


def odds_of(document: Document, pick: Document, display: F64) -> NDArray[np.int_]:
    """(96, 96, 16) the learned matte of a pick, or that of its hue."""
    if "matte" not in pick:
        return hue_odds(display)
    coded = document["mattes"]["grids"][pick["matte"]]
    steps = np.frombuffer(zlib.decompress(base64.b64decode(coded)), np.uint8)
    return (np.cumsum(steps, dtype=int) % 256).reshape(GRID)


def around(place: F64) -> NDArray[np.bool_]:
    """(96, 96, 16) which nodes are around a point."""
    steps = np.array(GRID) - 1
    low = np.clip((place - LEAST) / (MOST - LEAST) * steps, 0, steps - 1e-9).astype(int)
    u, v, light = np.minimum(low, steps - 1)
    nodes = np.zeros(GRID, bool)
    nodes[u : u + 2, v : v + 2, light : light + 2] = True
    return nodes


def frame_matte(document: Document, pick: Document, first: F64, now: F64) -> F32:
    """A pick's matte with its sliders, moved along with its colour; without holds."""
    odds = odds_of(document, pick, first)
    membership = 1 / (1 + np.exp(-((odds - 63) * 6 / 63 + pick.get("reach", 0))))
    half = max(0.6 * pick.get("softness", 0.5), 1e-3)
    matte = smooth_step(np.where(odds == 0, 0, membership), max(0.4 - half, 0.02), 0.4 + half)
    matte = matte.astype(np.float32)
    away = point(now) - point(first)
    if apart2(point(now), point(first)) > 1e-10:
        reach2 = (6.5 * NEAR) ** 2
        along = np.maximum(1 - apart2(NODES, point(now)) / reach2, 0) ** 2
        moved = between(matte, NODES - along[..., None] * away).astype(np.float32)
        matte = np.where(along > 0, moved, matte)
    # The colour itself is the thing's.
    matte[around(point(now))] = 1
    darkest, lightest = pick.get("lightness", (0, 1))
    taken = np.ones(GRID[2])
    levels = NODES[0, 0, :, 2]
    if darkest > 0:
        taken = smooth_step(levels, darkest - 0.1, darkest)
    if lightest < 1:
        taken = taken * (1 - smooth_step(levels, lightest, lightest + 0.1))
    return matte * taken.astype(np.float32)


def on_path(pick: Document, frame: float) -> tuple[F64, float]:
    """A pick's colour at a frame, and how much of it is there."""
    path = pick.get("path")
    if not path:
        return np.array(pick["rgb"], float), 1.0
    times = [key["frame"] for key in path]
    rows = [[*key["rgb"], key.get("there", 1)] for key in path]
    now = np.array([np.interp(frame, times, column) for column in zip(*rows, strict=True)])
    return now[:3], float(now[3])


def strength_of(pick: Document, frame: float) -> float:
    """How much of a pick's change is asked for at a frame."""
    if not pick.get("enabled", True):
        return 0.0
    fade = pick.get("fade", 0)
    early = (pick.get("from", -np.inf) - frame) / max(fade, 1)
    late = (frame - pick.get("until", np.inf)) / max(pick.get("fade_out", fade), 1)
    return float(np.clip(1 - max(early, late), 0, 1)) * on_path(pick, frame)[1]


def change_of(pick: Document, frame: float) -> F64:
    """What a pick asks for at a frame."""
    rgb, to = np.array(pick["rgb"], float), np.array(pick["to"], float)
    now = on_path(pick, frame)[0]
    if pick.get("toward", "shift") == "colour":
        return to - now
    known = np.array([rgb, to, *(key["rgb"] for key in pick.get("path", ()))])
    low = np.minimum(known.min(axis=0), 0)
    high = 1 if known.max() <= 1 else np.inf
    part = 1.0 if now.max() >= rgb.max() else max(now.max(), 0) / max(rgb.max(), 1e-9)
    for c in range(3):
        change = to[c] - rgb[c]
        if abs(change) > 1e-9:
            room = now[c] - low[c] if change < 0 else high - now[c]
            part = min(part, room / abs(change))
    return max(part, 0) * (to - rgb)


def picks_at(document: Document, frame: float) -> Picks:
    """The picks and holds that ask for something at a frame."""
    frame = clamped(document, frame)
    curve = None
    if "display" in document.get("mattes", {}):
        display = document["mattes"]["display"]
        curve = display["from"], display["to"], display["values"]
    holds: list[tuple[F64, float, F32 | None]] = []
    left: F32 | None = None
    found: list[Picked] = []
    for kind in ("hold", "pick"):
        for pick in document["edits"].get("picks", ()):
            strength = strength_of(pick, frame)
            if pick["kind"] != kind or strength <= 0:
                continue
            colour = on_path(pick, frame)[0]
            now = shown(colour, curve)
            matte = frame_matte(document, pick, shown(pick["rgb"], curve), now)
            if kind == "hold":
                kept = np.float32(1) - np.float32(strength) * matte
                left = kept if left is None else left * kept
                holds.append((point(now), strength, matte if "matte" in pick else None))
                continue
            spared = np.ones(GRID)
            for hold, how_much, kept in holds:
                to_hold, to_pick = apart2(NODES, hold), apart2(NODES, point(now))
                share = smooth_step(to_hold / np.maximum(to_hold + to_pick, 1e-9), 0, 0.5)
                if kept is not None:
                    share = np.where(around(point(now)), share, 1 - kept.astype(float))
                spared *= 1 - how_much * (1 - share)
            matte = matte * spared.astype(np.float32)
            found.append(
                Picked(colour, change_of(pick, frame), strength, matte, window_of(pick, frame))
            )
    return Picks(found, left, curve, document["clip"]["size"])


def window_of(pick: Document, frame: float) -> tuple[F64, float, bool] | None:
    """A pick's window at a frame."""
    if "window" not in pick:
        return None
    keys = pick["window"]["keys"]
    boxes = np.array([key["box"] for key in keys], float)
    times = [key["frame"] for key in keys]
    box = np.array([np.interp(frame, times, side) for side in boxes.T])
    return box, pick["window"]["feather"], pick["window"].get("inverted", False)


def in_window(window: tuple[F64, float, bool] | None, x: float, y: float) -> float:
    """What a window leaves of a pick at a place: 1 in the box, 0 beyond the feather, or 1 - it."""
    if window is None:
        return 1
    (left, top, right, bottom), feather, inverted = window
    away = np.hypot(max(left - x, x - right, 0), max(top - y, y - bottom, 0))
    left_of_it = float((1 - min(away / max(feather, 1), 1) ** 2) ** 2)
    return 1 - left_of_it if inverted else left_of_it


# Weights -----------------------------------------------------------------------------------------


def mean_value_weights(p: F64, rgb: F64, faces: list[list[int]]) -> F64 | None:
    """Mean value coordinates as in figure 4 of Ju, Schaefer and Warren; None when they vanish."""
    eps = 1e-9
    d = np.linalg.norm(rgb - p, axis=1)
    if d.min() < ON_SURFACE:
        return (np.arange(len(rgb)) == d.argmin()).astype(float)
    u = (rgb - p) / d[:, None]
    total = np.zeros(len(rgb))
    for face in faces:
        chords = [np.linalg.norm(u[face[(i + 1) % 3]] - u[face[(i + 2) % 3]]) for i in range(3)]
        theta = [2 * np.arcsin(min(chord / 2, 1.0)) for chord in chords]
        h = sum(theta) / 2
        if np.pi - h < eps:  # on the triangle: two-dimensional barycentric coordinates
            weights = np.zeros(len(rgb))
            for i in range(3):
                weights[face[i]] = np.sin(theta[i]) * d[face[(i + 1) % 3]] * d[face[(i + 2) % 3]]
            return weights / weights.sum()
        if min(np.sin(theta)) <= eps:  # seen from p, two corners coincide
            continue
        c = [
            2
            * np.sin(h)
            * np.sin(h - theta[i])
            / (np.sin(theta[(i + 1) % 3]) * np.sin(theta[(i + 2) % 3]))
            - 1
            for i in range(3)
        ]
        sign = np.sign(np.linalg.det(u[face]))
        s = [sign * np.sqrt(max(1 - x * x, 0.0)) for x in c]
        if min(abs(x) for x in s) <= eps:  # in the triangle's plane, beside it
            continue
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            total[face[i]] += (theta[i] - c[j] * theta[k] - c[k] * theta[j]) / (
                d[face[i]] * np.sin(theta[j]) * s[k]
            )
    if abs(total.sum()) <= 1e-9 * np.abs(total).sum() or not total.any():
        return None
    return total / total.sum()


def closest_on_simplex(p: F64, corners: F64) -> tuple[float, F64]:
    """Distance to, and weights of, the closest point of a point, segment or triangle.

    Tries the affine span of every subset of the corners, and keeps the best that lies within.
    """
    best: tuple[float, F64] | None = None
    count = len(corners)
    for mask in range(1, 2**count):
        subset = [i for i in range(count) if mask >> i & 1]
        origin = corners[subset[0]]
        basis = (corners[subset[1:]] - origin).T
        if basis.size and np.linalg.matrix_rank(basis) < len(subset) - 1:
            continue
        steps = np.linalg.lstsq(basis, p - origin, rcond=None)[0] if basis.size else np.zeros(0)
        inner = np.concatenate([[1 - steps.sum()], steps])
        if inner.min() < 0:
            continue
        weights = np.zeros(count)
        weights[subset] = inner
        distance = float(np.linalg.norm(weights @ corners - p))
        if best is None or distance < best[0]:
            best = distance, weights
    assert best is not None
    return best


def closest_weights(p: F64, rgb: F64, faces: list[list[int]]) -> tuple[float, F64]:
    """Distance to, and weights of, the closest point of the palette's surface."""
    simplices = faces if len(faces) else [list(range(len(rgb)))]
    if len(rgb) > 3 and np.linalg.matrix_rank(rgb - rgb[0], tol=1e-11) == 2:
        # Flat: one side only, that of the first face; the other may be cut differently.
        normals = np.array([np.cross(rgb[b] - rgb[a], rgb[c] - rgb[a]) for a, b, c in faces])
        first = normals[np.linalg.norm(normals, axis=1).argmax()]
        simplices = [f for f, normal in zip(faces, normals, strict=True) if normal @ first > 0]
    best = np.inf, np.zeros(len(rgb))
    for simplex in simplices:
        distance, inner = closest_on_simplex(p, rgb[simplex])
        if distance < best[0] - 1e-12:
            weights = np.zeros(len(rgb))
            weights[simplex] = inner
            best = distance, weights
    return best


def solid_angle_turns(p: F64, rgb: F64, faces: list[list[int]]) -> float:
    """How many times the surface goes around p (van Oosterom and Strackee 1983)."""
    total = 0.0
    for face in faces:
        a, b, c = rgb[face] - p
        la, lb, lc = (np.linalg.norm(x) for x in (a, b, c))
        total += 2 * np.arctan2(
            a @ np.cross(b, c), la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb
        )
    return total / (4 * np.pi)


def palette_weights(points: ArrayLike, rgb: ArrayLike, faces: ArrayLike) -> tuple[F64, F64]:
    """(m, 3), (n, 3), (f, 3) -> (m, n) weights of q(p) and (m,) distances |p - q|."""
    colours = tuple(map(tuple, np.asarray(rgb, float).tolist()))
    triangles = tuple(map(tuple, np.asarray(faces, int).reshape(-1, 3).tolist()))
    each = [weights_of(tuple(p), colours, triangles) for p in np.asarray(points, float).tolist()]
    rows, distances = [weights for weights, _ in each], [distance for _, distance in each]
    return np.array(rows).reshape(-1, len(colours)), np.array(distances)


# Many cases weigh the same colours in the same palette.
@functools.cache
def weights_of(
    point: tuple[float, ...], rgb: tuple[tuple[float, ...], ...], faces: tuple[tuple[int, ...], ...]
) -> tuple[F64, float]:
    """Weights of one colour, and its distance from the palette."""
    p, colours, triangles = np.array(point), np.array(rgb), [list(face) for face in faces]
    distance, weights = closest_weights(p, colours, triangles)
    if distance <= ON_SURFACE:
        return weights, 0.0
    if triangles and abs(solid_angle_turns(p, colours, triangles)) > 0.5:
        inner = mean_value_weights(p, colours, triangles)
        if inner is not None:
            return inner, 0.0
    return weights, distance


# Recolouring -------------------------------------------------------------------------------------


def straight(colour: F64, alpha: float) -> F64:
    """A premultiplied colour divided by its alpha; NaN where alpha is 0 or not finite."""
    if alpha == 0 or not np.isfinite(alpha):
        return np.full_like(colour, np.nan)
    return colour / alpha


def recolour(
    image: NDArray[np.float32],
    original: ArrayLike,
    edited: ArrayLike,
    faces: ArrayLike,
    strength: float = 1.0,
    premultiplied: bool = False,
    picks: Picks | None = None,
) -> NDArray[np.float32]:
    """p' = p + strength (h sum_i w_i(q) (v'_i - v_i) + picks) for an (h, w, 3 or 4) image.

    A pick's matte m, times the amount a of its colour, times its change d; of several picks the
    mean of m a d, weighted by m and by closeness. Each d is what the palette leaves to do.
    """
    picks = picks or Picks()
    displacement = np.asarray(edited, float) - np.asarray(original, float)

    def held(colour: F64) -> F64:
        weights, _ = palette_weights([colour], original, faces)
        moved = weights[0] @ displacement
        if picks.left is not None and moved.any():
            moved = between(picks.left, point(shown(colour, picks.curve))) * moved
        return np.asarray(moved)

    missing = [pick.strength * (pick.change - held(pick.colour)) for pick in picks.picks]

    def moved_by_picks(colour: F64, x: float, y: float) -> F64:
        total, shares = np.zeros(3), []
        display = shown(colour, picks.curve)
        for pick, change in zip(picks.picks, missing, strict=True):
            target = shown(pick.colour, picks.curve)
            matte = float(between(pick.matte, point(display))) * in_window(pick.window, x, y)
            near = matte * pick.strength / (apart2(point(display), point(target)) + 1e-6)
            share = near if len(picks.picks) > 1 else 1.0
            part = amount(display, target) / amount(target, target)
            # Of the change's light it has no more than of the pick's lightness.
            own, picked = (
                np.clip(colour.mean(), 0, 1) + LEAST_LIGHT for colour in (display, target)
            )
            dark = max(part - own / picked, 0) * change.mean()
            total += share * matte * (part * change - dark)
            shares.append(share)
        return total / max(sum(shares), 1e-30)

    result = image.copy()
    across, down = picks.size[0] / image.shape[1], picks.size[1] / image.shape[0]
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            p = image[y, x, :3].astype(float)
            alpha = 1.0
            if premultiplied and image.shape[2] == 4:
                alpha = float(image[y, x, 3])
            own = straight(p, alpha)
            if not np.isfinite(own).all():
                continue
            # The image is the whole picture.
            place = (x + 0.5) * across, (y + 0.5) * down
            moved = alpha * strength * (held(own) + moved_by_picks(own, *place))
            for channel in range(3):
                if moved[channel] != 0:
                    result[y, x, channel] = np.float32(p[channel] + moved[channel])
    return result


# Conversions -------------------------------------------------------------------------------------


def log_curve(step: Document, channel: int, x: float) -> float:
    """The log step of docs/sidecar.md, forward."""
    names = ("log_slope", "log_offset", "linear_slope", "linear_offset", "start", "below")
    slope, offset, inner, shift, start, below = (step[name][channel] for name in names)
    at = max(x, start)
    y = slope * np.log(inner * at + shift) / np.log(step["base"]) + offset
    return float(y + below * min(x - start, 0))


def gamma_curve(step: Document, channel: int, x: float) -> float:
    """The gamma step, forward."""
    gamma, offset = step["gamma"][channel], step["offset"][channel]
    if step["negative"] == "mirror" and x < 0:
        return -gamma_curve(step, channel, -x)
    if offset == 0:
        return float(x if x < 0 else x**gamma)
    turn = offset / (gamma - 1)
    if x > turn:
        return float(((x + offset) / (1 + offset)) ** gamma)
    # The tangent in the turn passes through 0: its slope is y / x there.
    return float(x * ((turn + offset) / (1 + offset)) ** gamma / turn)


def sampled_curve(step: Document, channel: int, x: float) -> float:
    """The curve step, forward."""
    curve = step["curves"][channel % len(step["curves"])]
    i = int(np.clip(np.searchsorted(curve["x"], x), 1, len(curve["x"]) - 1))
    (x0, x1), (y0, y1) = curve["x"][i - 1 : i + 1], curve["y"][i - 1 : i + 1]
    return float(y0 + (x - x0) / (x1 - x0) * (y1 - y0))


CURVES = {"log": log_curve, "gamma": gamma_curve, "curve": sampled_curve}


def curve_inverse(step: Document, channel: int, y: float) -> float:
    """By bisection: nothing is assumed of a curve but that it rises."""
    curve = CURVES[step["kind"]]
    low, high = -1.0, 1.0
    while curve(step, channel, low) > y:
        low *= 2
    while curve(step, channel, high) < y:
        high *= 2
    for _ in range(200):
        middle = (low + high) / 2
        if curve(step, channel, middle) < y:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def convert(steps: list[Document], colour: ArrayLike, back: bool = False) -> F64:
    """(3,) numbers of the clip -> (3,) of the palette, or back."""
    at = np.asarray(colour, float)
    for step in reversed(steps) if back else steps:
        if step["kind"] == "matrix":
            matrix, offset = np.array(step["matrix"]), np.array(step["offset"])
            at = np.linalg.solve(matrix, at - offset) if back else matrix @ at + offset
            continue
        forward = (step["direction"] == "forward") != back
        curve = CURVES[step["kind"]] if forward else curve_inverse
        at = np.array([curve(step, c, at[c]) for c in range(3)])
    return at
