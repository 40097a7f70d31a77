"""The plain reference: slices, edited colours, weights and recolouring in textbook NumPy.

Written from the paper and from Ju, Schaefer and Warren (2005), float64, one point at a time, with
no thought of speed and apart from the C++ core. It reads the sidecar's JSON document directly. All
cases of `cases.py` run on it and on the compiled core; where they differ, one of them is wrong.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]
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


def solved(document: Document, earlier: str, later: str, frame: float) -> F64:
    """The solution's displacement between two vertices."""
    solution = document["edits"].get("solution", {"vertices": [], "keys": []})
    moved = {entry["vertex"]: entry["by"] for entry in solution["vertices"]}
    if earlier == later:
        return np.array(moved.get(earlier, (0, 0, 0)), float)
    vertices, edge = vertices_by_id(document), edge_between(document, earlier, later)
    knots = [(vertices[name]["frame"], moved.get(name, (0, 0, 0))) for name in (earlier, later)]
    knots += [(k["frame"], k["by"]) for k in solution["keys"] if k["edge"] == edge["id"]]
    times, values = zip(*sorted(knots), strict=True)
    return np.array([np.interp(frame, times, channel) for channel in zip(*values, strict=True)])


def edited_colours(document: Document, frame: float) -> F64:
    """(n, 3) palette colours at a frame after the edits: handles, ramps, and the solution."""
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
        rows.append(row + solved(document, earlier, later, frame))
    return np.array(rows).reshape(-1, 3)


Bump = tuple[F64, float, F64, float, F64]


def bumps_at(document: Document, frame: float) -> list[Bump]:
    """Centre, radius, displacement, keep and along of every bump and hold at a frame."""
    frame = clamped(document, frame)
    solution = document["edits"].get("solution", {"bumps": []})

    def along(centre: F64, entry: Document) -> F64:
        longer = np.sqrt(1 - entry.get("shade", 1) ** 2)
        return longer / max(float(np.linalg.norm(centre)), 0.6) * centre

    found = []
    for bump in solution["bumps"]:
        keys = bump["keys"]
        times = [key["frame"] for key in keys]
        rows = np.array([[*key["rgb"], *key["by"]] for key in keys])
        now = np.array([np.interp(frame, times, column) for column in rows.T])
        found.append((now[:3], float(bump["radius"]), now[3:], 0.0, along(now[:3], bump)))
    for hold in solution.get("holds", []):
        keys = hold["keys"]
        times = [key["frame"] for key in keys]
        rows = np.array([[*key["rgb"], key["radius"], key["keep"]] for key in keys])
        now = np.array([np.interp(frame, times, column) for column in rows.T])
        found.append((now[:3], float(now[3]), np.zeros(3), float(now[4]), along(now[:3], hold)))
    return found


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


def mean_value_coordinates(points: ArrayLike, rgb: ArrayLike, faces: ArrayLike) -> F64:
    """(m, 3), (n, 3), (f, 3) -> (m, n) weights."""
    colours, triangles = np.asarray(rgb, float), np.asarray(faces, int).reshape(-1, 3).tolist()
    rows = []
    for p in np.asarray(points, float):
        weights = mean_value_weights(p, colours, triangles)
        rows.append(closest_weights(p, colours, triangles)[1] if weights is None else weights)
    return np.array(rows).reshape(-1, len(colours))


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


def polytope_weights(points: ArrayLike, document: Document, frame: float) -> F64:
    """Eq. 7: (m, 3) -> (m, N), the product of W_p and the matrix W_t of eq. 6."""
    names = [vertex["id"] for vertex in document["polytope"]["vertices"]]
    where = positions(document, frame)
    matrix = np.zeros((len(where), len(names)))
    for row, (earlier, later, weight) in enumerate(where):
        matrix[row, names.index(earlier)] += 1 - weight
        matrix[row, names.index(later)] += weight
    inner, _ = palette_weights(points, slice_rgb(document, frame), slice_faces(document, frame))
    return inner @ matrix


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
    bumps: Sequence[Bump] = (),
) -> NDArray[np.float32]:
    """p' = p + strength (sum_i w_i(q) (v'_i - v_i) + bumps) for an (h, w, 3 or 4) image."""
    displacement = np.asarray(edited, float) - np.asarray(original, float)
    result = image.copy()
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            p = image[y, x, :3].astype(float)
            alpha = 1.0
            if premultiplied and image.shape[2] == 4:
                alpha = float(image[y, x, 3])
            own = straight(p, alpha)
            if not np.isfinite(own).all():
                continue
            weights, _ = palette_weights([own], original, faces)
            moved = weights[0] @ displacement
            for centre, radius, by, keep, along in bumps:
                away = own - centre
                distance2 = float(away @ away - (along @ away) ** 2)
                part = max(1 - distance2 / radius**2, 0.0) ** 3
                moved = (moved + part * by) * (1 - (1 - (1 - part) ** 3) * keep)
            moved = alpha * strength * moved
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
