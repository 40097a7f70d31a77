"""The cases that all implementations run: reference, compiled core, kernel and node.

`DOCUMENTS` are sidecars (JSON documents) by name, `FRAMES` the times to slice them at, `BODIES`
palettes with points to weigh, and `picture()` an image with everything awkward in it.
"""

from __future__ import annotations

import base64
import copy
import itertools
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Document = dict[str, Any]
Colour = tuple[float, float, float]

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
# Corner 3 of the tetrahedron as two corners, 3 and 4.
SPLIT_TETRAHEDRON = [[0, 2, 1], [0, 1, 4], [0, 4, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4]]


def document(
    vertices: dict[str, tuple[float, tuple[float, float, float]]],
    edges: dict[str, tuple[str, str]],
    blocks: list[dict[str, Any]],
    transitions: list[dict[str, Any]],
) -> Document:
    """A whole sidecar around a polytope, without edits."""
    first, last = int(blocks[0]["first"]), int(blocks[-1]["last"])
    return {
        "schema": "palette4d.sidecar",
        "version": 1,
        "generator": "palette4d tests",
        "clip": {
            "name": "case",
            "source": "case.####.exr",
            "frames": {"first": first, "last": last, "step": 1, "skipped": []},
            "rate": [24, 1],
            "size": [64, 36],
            "encoding": "sRGB",
        },
        "polytope": {
            "vertices": [
                {"id": name, "frame": frame, "rgb": list(rgb)}
                for name, (frame, rgb) in vertices.items()
            ],
            "edges": [{"id": name, "from": a, "to": b} for name, (a, b) in edges.items()],
            "blocks": blocks,
            "transitions": transitions,
        },
        "quality": {"stages": [], "options": {}, "versions": {}},
        "edits": {"vertices": [], "stops": []},
        "extra": {},
    }


def edited(
    base: Document,
    vertices: dict[str, tuple[float, float, float]],
    stops: list[tuple[str, float, tuple[float, float, float]]],
    ramps: dict[str, str] | None = None,
    **more: Any,
) -> Document:
    """The same sidecar with edits; `ramps` of vertices and of stops by their number."""
    result = copy.deepcopy(base)
    result["edits"] = {
        "vertices": [{"vertex": name, "rgb": list(rgb)} for name, rgb in vertices.items()],
        "stops": [
            {"id": f"stop{i}", "edge": edge, "frame": frame, "rgb": list(rgb)}
            for i, (edge, frame, rgb) in enumerate(stops)
        ],
        **more,
    }
    for entry in result["edits"]["vertices"] + result["edits"]["stops"]:
        name = entry.get("vertex", entry.get("id"))
        if ramps and name in ramps:
            entry["ramp"] = ramps[name]
    return result


def pick(name: str, rgb: Colour, to: Colour, **more: Any) -> dict[str, Any]:
    """A pick of a colour at frame 0; a path's keys are frame, colour and how much is there."""
    if "path" in more:
        path = [{"frame": t, "rgb": list(at), "there": there} for t, at, there in more["path"]]
        more = {**more, "path": path}
    return {"id": name, "kind": "pick", "frame": 0, "rgb": list(rgb), "to": list(to), **more}


def window(feather: float, *keys: tuple[float, tuple[float, ...]]) -> dict[str, Any]:
    """A window of a pick; its keys are a frame and a box."""
    boxes = [{"frame": frame, "box": list(box)} for frame, box in keys]
    return {"feather": feather, "keys": boxes}


def outside(feather: float, *keys: tuple[float, tuple[float, ...]]) -> dict[str, Any]:
    """All but a window."""
    return {**window(feather, *keys), "inverted": True}


def hold(name: str, rgb: Colour, **more: Any) -> dict[str, Any]:
    """A hold of a colour."""
    return {**pick(name, rgb, rgb, **more), "kind": "hold"}


def coded(odds: NDArray[np.uint8]) -> str:
    """A learned matte as sidecars have it: differences of (96, 96, 16) log odds, 0 to 126."""
    steps = np.diff(odds.ravel(), prepend=np.uint8(0))
    return base64.b64encode(zlib.compress(steps.tobytes())).decode("ascii")


def learned_odds(seed: int) -> NDArray[np.uint8]:
    """Log odds like those of a learned matte: some soft blobs, and nothing elsewhere."""
    rng = np.random.default_rng(seed)
    nodes = np.stack(np.meshgrid(*(np.arange(n) for n in (96, 96, 16)), indexing="ij"), axis=-1)
    odds = np.zeros((96, 96, 16))
    for _ in range(5):
        centre, size = rng.uniform((25, 25, 2), (70, 70, 13)), rng.uniform((6, 6, 2), (25, 25, 8))
        odds = np.maximum(odds, 126 - 90 * (((nodes - centre) / size) ** 2).sum(axis=-1))
    return odds.round().astype(np.uint8)


def picked(
    base: Document,
    picks: list[dict[str, Any]],
    grids: dict[str, NDArray[np.uint8]] | None = None,
    display: tuple[float, float, list[float]] | None = None,
) -> Document:
    """The same sidecar in version 2, with picks, learned mattes and a curve to a display."""
    result = copy.deepcopy(base)
    result["version"] = 2
    result["edits"]["picks"] = picks
    mattes: dict[str, Any] = {"grids": {name: coded(odds) for name, odds in (grids or {}).items()}}
    if display:
        mattes["display"] = dict(zip(("from", "to", "values"), display, strict=True))
    if grids or display:
        result["mattes"] = mattes
    return result


def still_document() -> Document:
    """One frame, one block, a tetrahedron of vertices without edges."""
    return document(
        {
            "v0": (7, (0.0, 0.0, 0.0)),
            "v1": (7, (1.0, 0.0, 0.1)),
            "v2": (7, (0.0, 1.0, 0.0)),
            "v3": (7, (0.1, 0.2, 1.0)),
        },
        {},
        [{"first": 7, "last": 7, "tracks": [["v0"], ["v1"], ["v2"], ["v3"]],
          "faces": TETRAHEDRON}],
        [],
    )  # fmt: skip


def colour_document() -> Document:
    """One colour that changes."""
    return document(
        {"a": (0, (0.2, 0.2, 0.2)), "b": (4, (0.4, 0.3, 0.2)), "c": (10, (0.1, 0.9, 0.5))},
        {"ab": ("a", "b"), "bc": ("b", "c")},
        [{"first": 0, "last": 10, "tracks": [["a", "b", "c"]], "faces": []}],
        [],
    )


def grey_document() -> Document:
    """Two colours, a line of greys."""
    return document(
        {
            "a0": (-3, (0.05, 0.05, 0.05)),
            "a1": (5, (0.1, 0.1, 0.1)),
            "b0": (-3, (0.9, 0.9, 0.9)),
            "b1": (5, (1.2, 1.2, 1.2)),
        },
        {"a": ("a0", "a1"), "b": ("b0", "b1")},
        [{"first": -3, "last": 5, "tracks": [["a0", "a1"], ["b0", "b1"]], "faces": []}],
        [],
    )


def flat_document() -> Document:
    """Four colours in one plane: a two-sided square, each side cut along its own diagonal."""
    corners = {"p": (0.1, 0.1), "q": (0.9, 0.1), "r": (0.9, 0.9), "s": (0.1, 0.9)}
    vertices = {}
    for name, (x, y) in corners.items():
        vertices[f"{name}0"] = (0, (x, y, 0.5))
        vertices[f"{name}1"] = (8, (x, y, 0.25))
    return document(
        vertices,
        {name: (f"{name}0", f"{name}1") for name in corners},
        [
            {
                "first": 0,
                "last": 8,
                "tracks": [[f"{name}0", f"{name}1"] for name in corners],
                "faces": [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
            }
        ],
        [],
    )


def split_merge_document() -> Document:
    """Blocks 0..8, 10..20 and 23..30; a colour splits in the first transition, and merges again in
    the second. Colour a is one edge through the whole clip, colour b has one vertex at 14.5, inside
    the second block, and the third block begins on the insides of both.
    """
    vertices = {
        "a0": (0, (0.0, 0.0, 0.05)),
        "a1": (30, (0.1, 0.0, 0.0)),
        "b0": (0, (1.0, 0.0, 0.0)),
        "bm": (14.5, (0.9, 0.1, 0.0)),
        "b1": (30, (0.8, 0.0, 0.1)),
        "c0": (0, (0.0, 1.0, 0.0)),
        "c1": (8, (0.0, 0.9, 0.0)),
        "c2": (10, (0.1, 0.9, 0.0)),
        "c3": (30, (0.2, 1.1, 0.0)),
        "d0": (0, (0.0, 0.0, 1.0)),
        "d1": (8, (0.0, 0.0, 0.8)),
        "d2": (10, (0.0, 0.2, 0.9)),
        "d3": (20, (0.0, 0.4, 1.0)),
        "e2": (10, (0.4, 0.1, 0.8)),
        "e3": (20, (0.6, 0.0, 1.0)),
        "m": (23, (0.3, 0.3, 1.1)),
        "m1": (30, (0.2, 0.2, 0.9)),
    }
    edges = {
        "ea": ("a0", "a1"),
        "eb0": ("b0", "bm"),
        "eb1": ("bm", "b1"),
        "ec0": ("c0", "c1"),
        "ec1": ("c1", "c2"),
        "ec2": ("c2", "c3"),
        "ed0": ("d0", "d1"),
        "ed1": ("d1", "d2"),
        "ee1": ("d1", "e2"),
        "ed2": ("d2", "d3"),
        "ee2": ("e2", "e3"),
        "dm": ("d3", "m"),
        "em": ("e3", "m"),
        "em1": ("m", "m1"),
    }
    a, b = ["a0", "a1"], ["b0", "bm", "b1"]
    blocks = [
        {"first": 0, "last": 8, "faces": TETRAHEDRON,
         "tracks": [a, b[:2], ["c0", "c1"], ["d0", "d1"]]},
        {"first": 10, "last": 20, "faces": SPLIT_TETRAHEDRON,
         "tracks": [a, b, ["c2", "c3"], ["d2", "d3"], ["e2", "e3"]]},
        {"first": 23, "last": 30, "faces": TETRAHEDRON,
         "tracks": [a, b[1:], ["c2", "c3"], ["m", "m1"]]},
    ]  # fmt: skip
    transitions = [
        {"faces": SPLIT_TETRAHEDRON,
         "tracks": [a, b[:2], ["c1", "c2"], ["d1", "d2"], ["d1", "e2"]]},
        {"faces": SPLIT_TETRAHEDRON,
         "tracks": [a, b[1:], ["c2", "c3"], ["d3", "m"], ["e3", "m"]]},
    ]  # fmt: skip
    return document(vertices, edges, blocks, transitions)


#: Edits at splits, merges and vertices that a colour passes, and several stops on an edge.
HANDLES: dict[str, Colour] = {
    "a0": (0.1, 0.05, 0.0),
    "bm": (0.7, 0.3, 0.2),
    "d1": (0.3, 0.0, 0.7),
    "m": (0.5, 0.3, 0.9),
    "a1": (0.0, 0.3, 0.3),
}
STOPS: list[tuple[str, float, Colour]] = [
    ("ea", 21.5, (0.2, 0.0, 0.0)),
    ("ea", 9, (0.0, 0.2, 0.1)),
    ("ea", 15, (0.1, 0.1, 0.3)),
    ("eb1", 22, (0.8, 0.2, 0.4)),
    ("ec2", 12.25, (0.4, 0.9, 0.2)),
    ("dm", 21, (0.0, 0.9, 0.9)),
    ("ed2", 13, (0.1, 0.4, 0.7)),
]


def picked_documents() -> dict[str, Document]:
    """Sidecars with picks by name."""
    still, colour, changes = still_document(), colour_document(), split_merge_document()
    red = pick("red", (0.6, 0.3, 0.2), (0.4, 0.3, 0.6))
    green = pick("green", (0.3, 0.6, 0.25), (0.6, 0.6, 0.1), softness=1, reach=2)
    pale = pick("pale", (0.9, 0.92, 0.88), (0.8, 0.7, 0.9), softness=0, lightness=[0.4, 1])
    black = pick("black", (0.0, 0.0, 0.0), (0.1, 0.05, 0.0), lightness=[0, 0.2])
    moving = pick(
        "moving", (0.3, 0.3, 0.7), (0.2, 0.6, 0.6),
        path=[(2, (0.3, 0.3, 0.7), 1), (12, (0.25, 0.4, 0.6), 0.5), (25, (0.4, 0.4, 0.5), 1)],
    )  # fmt: skip
    # At other frames than its own it becomes one colour, and it is asked for from 9 to 20 only.
    ranged = {**red, "toward": "colour", "from": 9, "until": 20, "fade": 3, "fade_out": 6}
    kept = hold("kept", (0.5, 0.4, 0.25), reach=-1)
    fading = hold("fading", (0.2, 0.2, 0.6), until=12, fade=10)
    off = {**green, "id": "off", "enabled": False}
    log = [float(x) for x in np.linspace(0, 1, 33) ** 0.5]
    return {
        "still-pick": picked(still, [red]),
        "still-picks": picked(still, [red, green, pale, black, off]),
        "still-holds": picked(still, [kept, red, hold("grey", (0.4, 0.4, 0.4))]),
        "still-learned": picked(
            edited(still, {"v2": (0.3, 0.8, 0.1)}, []),
            [{**red, "matte": "a"}, {**green, "matte": "b", "softness": 0.2, "reach": -0.7},
             hold("kept", (0.2, 0.5, 0.3), matte="c")],
            {"a": learned_odds(1), "b": learned_odds(2), "c": learned_odds(3)},
        ),
        # Where a hold is whole, nothing is left of both picks.
        "changes-learned": picked(
            changes,
            [{**red, "matte": "a"}, {**green, "matte": "b", "softness": 0.2, "reach": -0.7},
             hold("kept", (0.2, 0.5, 0.3), matte="c",
                  path=[(0, (0.2, 0.5, 0.3), 1), (20, (0.5, 0.4, 0.6), 1)])],
            {"a": learned_odds(1), "b": learned_odds(2), "c": learned_odds(3)},
        ),
        "colour-picks": picked(colour, [moving, black, fading]),
        "still-window": picked(still, [{**red, "window": window(9, (0, (5, 8, 40, 30.25)))}]),
        # A hard edge, a round spot, one beyond the picture, and one that moves beside one without.
        "changes-windows": picked(
            edited(changes, {"d1": (0.3, 0.0, 0.7)}, []),
            [{**red, "window": window(0, (0, (20.5, 0, 64, 18)))},
             {**moving, "window": window(30, (0, (9, 9, 10, 10)), (20, (40, 20, 60, 30)))},
             {**green, "window": window(4, (0, (-50, -20, 33, 90)))}, pale],
        ),
        # All but a box that moves, beside one in that box.
        "changes-outside": picked(
            edited(changes, {"d1": (0.3, 0.0, 0.7)}, []),
            [{**red, "window": outside(30, (0, (5, 8, 30, 20)), (20, (30, 10, 55, 22)))},
             {**green, "window": window(4, (0, (10, 8, 33, 30)))}, moving],
        ),
        "colour-curve": picked(colour, [red, fading], None, (-0.25, 1.5, log)),
        "changes-picks": picked(
            edited(changes, {"d1": (0.3, 0.0, 0.7)}, [("ea", 9, (0.0, 0.2, 0.1))], ramp="smooth"),
            [ranged, moving, pale],
        ),
        "changes-holds": picked(
            edited(changes, {"a1": (0.9, 0.3, 0.1), "a0": (0.1, 0.05, 0.0)}, []),
            [fading, moving, kept],
        ),
    }  # fmt: skip


def all_documents() -> dict[str, Document]:
    """Sidecars by name."""
    changes = split_merge_document()
    return {
        "still": still_document(),
        "still-edited": edited(still_document(), {"v2": (0.3, 0.8, 0.1)}, []),
        "colour": colour_document(),
        "colour-edited": edited(
            colour_document(), {"b": (0.5, 0.1, 0.3)}, [("bc", 7.5, (0.0, 0.0, 1.0))]
        ),
        "grey": grey_document(),
        "grey-edited": edited(grey_document(), {"b1": (1.2, 0.9, 0.4)}, []),
        "flat": flat_document(),
        "flat-edited": edited(
            flat_document(), {"q0": (0.9, 0.4, 0.6)}, [("s", 3, (0.2, 0.7, 0.8))]
        ),
        "changes": changes,
        "changes-vertex": edited(changes, {"bm": (0.2, 0.6, 0.1), "d1": (0.3, 0.0, 0.7)}, []),
        "changes-stops": edited(
            changes,
            {"m": (0.9, 0.9, 0.2), "a1": (0.0, 0.3, 0.3)},
            [
                ("ea", 21.5, (0.2, 0.0, 0.0)),
                ("ea", 9, (0.0, 0.2, 0.1)),
                ("ea", 15, (0.1, 0.1, 0.3)),
                ("ec2", 12.25, (0.4, 0.9, 0.2)),
                ("dm", 21, (0.0, 0.9, 0.9)),
            ],
        ),
        "changes-smooth": edited(changes, HANDLES, STOPS, ramp="smooth"),
        "changes-hold": edited(
            changes,
            HANDLES,
            STOPS,
            {"a1": "linear", "stop1": "smooth", "bm": "linear"},
            ramp="hold",
        ),
        **picked_documents(),
        "changes-back": edited(changes, {"b0": (1.0, 0.0, 0.0)}, []),
    }


DOCUMENTS = all_documents()

EDITED = [name for name in DOCUMENTS if "-" in name and name != "changes-back"]
UNEDITED = [name for name in DOCUMENTS if name not in EDITED]

#: How closely a picture must agree with the reference's: half a unit in the last place of float32
#: either way, and the weights' own rounding.
PICTURE_TOLERANCE = {"rtol": 1.3e-7, "atol": 3e-8}

#: The same for what computes in float32 wherever that is within 1e-4 (`Precision::kSingle`).
FAST_TOLERANCE = {"rtol": 1.3e-7, "atol": 1e-4}

NUDGE = 1e-6


def times_of(name: str) -> list[float]:
    """A few times within and around a document's clip."""
    blocks = DOCUMENTS[name]["polytope"]["blocks"]
    first, last = blocks[0]["first"], blocks[-1]["last"]
    return [first - 1, first, first + 0.29 * (last - first), first + 0.72 * (last - first), last]


def frames_of(name: str) -> list[float]:
    """Times at, beside and between everything that happens in a document, and outside the clip."""
    polytope = DOCUMENTS[name]["polytope"]
    marks = {vertex["frame"] for vertex in polytope["vertices"]}
    marks |= {block[end] for block in polytope["blocks"] for end in ("first", "last")}
    marks |= {stop["frame"] for stop in DOCUMENTS[name]["edits"]["stops"]}
    for pick in DOCUMENTS[name]["edits"].get("picks", ()):
        marks |= {key["frame"] for key in pick.get("path", ())}
        marks |= {pick[end] for end in ("from", "until") if end in pick}
    times = sorted(float(mark) for mark in marks)
    between = [a + 0.37 * (b - a) for a, b in itertools.pairwise(times)]
    beside = [mark + side for mark in times for side in (-NUDGE, NUDGE)]
    outside = [times[0] - 1000.25, times[-1] + 3, float("-inf"), float("inf")]
    return times + between + beside + outside


@dataclass(frozen=True)
class Body:
    """A palette, points to weigh, and how closely float64 implementations must agree."""

    name: str
    rgb: F64
    faces: list[list[int]]
    points: F64
    tolerance: float = 1e-9


def cube() -> tuple[F64, list[list[int]]]:
    """The unit cube."""
    rgb = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return rgb, [list(t) for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def concave_cube() -> tuple[F64, list[list[int]]]:
    """The cube with its top pushed in to a point: not convex."""
    rgb, faces = cube()
    top = (4, 5, 7, 6)
    rgb = np.vstack([rgb, [0.5, 0.5, 0.3]])
    faces = faces[:2] + faces[4:] + [[top[k], top[(k + 1) % 4], 8] for k in range(4)]
    return rgb, faces


def random_hull(seed: int, points: int) -> tuple[F64, list[list[int]]]:
    """The convex hull of random points on an ellipsoid, faces anticlockwise from outside."""
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(points, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rgb = 0.5 + directions * rng.uniform(0.2, 0.6, 3)
    hull = ConvexHull(rgb)
    faces = []
    for (a, b, c), equation in zip(hull.simplices.tolist(), hull.equations, strict=True):
        outwards = np.cross(rgb[b] - rgb[a], rgb[c] - rgb[a]) @ equation[:3] > 0
        faces.append([a, b, c] if outwards else [a, c, b])
    return rgb, faces


def surface_points(rgb: F64, faces: list[list[int]], rng: np.random.Generator) -> F64:
    """Points on vertices, edges and faces, and just inside and outside of the latter."""
    centre = rgb.mean(axis=0)
    points = [*rgb]
    for face in faces:
        corners = rgb[face]
        points.append(0.3 * corners[0] + 0.7 * corners[1])
        inner = rng.dirichlet([2, 2, 2]) @ corners
        points += [inner, *(inner + step * (centre - inner) for step in (1e-4, -1e-4, 0.02, -0.02))]
    return np.array(points)


def all_bodies() -> list[Body]:
    """Palettes of every kind."""
    rng = np.random.default_rng(20)
    anywhere = rng.uniform(-0.6, 1.6, (60, 3))
    tetrahedron = np.array([[0, 0, 0], [1, 0, 0.1], [0, 1, 0], [0.1, 0.2, 1]], float)
    square = np.array([[0, 0, 0.5], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0.5]], float)
    on_square = np.column_stack([rng.uniform(-0.5, 1.5, (20, 2)), np.full(20, 0.5)])
    bodies = [
        Body("one-colour", np.array([[0.3, 0.2, 0.1]]), [], anywhere),
        Body("two-colours", np.array([[0.1, 0.1, 0.1], [0.9, 0.8, 0.9]]), [], anywhere),
        Body("triangle", tetrahedron[:3], [[0, 1, 2], [2, 1, 0]], anywhere),
        Body("square", square, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
             np.vstack([anywhere, on_square])),
        # Two corners coincide, as where a colour splits.
        Body("at-a-split", np.vstack([tetrahedron, tetrahedron[3]]), SPLIT_TETRAHEDRON,
             np.vstack([anywhere, rng.dirichlet(np.ones(4), 20) @ tetrahedron])),
    ]  # fmt: skip
    solids = {
        "tetrahedron": (tetrahedron, TETRAHEDRON),
        "cube": cube(),
        "concave-cube": concave_cube(),
        **{f"hull-{n}": random_hull(n, n) for n in (5, 8, 13, 21)},
    }
    for name, (rgb, faces) in solids.items():
        inside = rng.dirichlet(np.ones(len(rgb)), 30) @ rgb
        # The textbook formula loses digits close to the planes of faces, most of all in dents.
        close = surface_points(rgb, faces, rng)
        bodies.append(Body(name, rgb, faces, np.vstack([inside, anywhere]), 1e-8))
        bodies.append(
            Body(f"{name}-surface", rgb, faces, close, 1e-4 if name == "concave-cube" else 1e-8)
        )
    return bodies


BODIES = all_bodies()


def picture(channels: int = 3) -> NDArray[np.float32]:
    """(6, 11, channels) float32: colours inside and outside 0..1, and everything awkward.

    The first row holds NaN, infinities and negative zero, the last alpha 0 and above 1.
    """
    rng = np.random.default_rng(channels)
    image = rng.uniform(-0.25, 1.35, (6, 11, channels)).astype(np.float32)
    image[0, 0, 0] = np.nan
    image[0, 1, 1] = np.inf
    image[0, 2, 2] = -np.inf
    image[0, 3, :3] = -0.0
    image[0, 4, :3] = 0.0
    image[0, 5, :3] = 1.0
    image[0, 6, :3] = 1e-42
    image[0, 7, :3] = (65504.0, -12.0, 0.5)
    image[1, :, :3] = np.linspace(0, 1, 11, dtype=np.float32)[:, None]
    if channels == 4:
        image[:, :, 3] = rng.uniform(0.1, 1, (6, 11))
        image[5, :4, 3] = (0.0, -0.0, 1.75, 1e-3)
    return image


def same_bits(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Where two float32 arrays hold the same bits."""
    return np.ascontiguousarray(a).view(np.uint32) == np.ascontiguousarray(b).view(np.uint32)
