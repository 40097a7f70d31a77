"""The timeline: bands, forks, half discs, labels, blocks and the frame axis.

Everything is drawn on one Axes whose unit is the point (1/72 inch), y upwards, so that discs are
round and gaps are known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.plotting import layout as layouts
from palette4d.plotting import style

F64 = NDArray[np.float64]

#: Length of the pieces of a band, in points: short enough for a smooth gradient.
PIECE = 2.5


@dataclass
class Palette:
    """What is drawn: the polytope and its edits as arrays.

    Attributes
    ----------
    frames, rgb, edited : (n,), (n, 3), (n, 3) float64
        Time and colours of the vertices, before and after the edit.
    edges : list of (int, int)
        Vertex indices.
    stops : list of (str, int, float, (3,) array)
        Id, edge index, frame, edited colour.
    changed : (n,) bool array
        The vertex has an edited colour.
    """

    ids: list[str]
    frames: F64
    rgb: F64
    edited: F64
    changed: NDArray[np.bool_]
    edges: list[tuple[int, int]]
    edge_ids: list[str]
    stops: list[tuple[str, int, float, F64]]
    sections: list[dict[str, Any]]
    first: float
    last: float

    @classmethod
    def of(cls, sidecar: _core.Sidecar) -> "Palette":
        """Read the arrays from a sidecar."""
        polytope, edits = sidecar.polytope, sidecar.edits
        vertices = np.asarray(polytope.vertices, dtype=np.float64).reshape(-1, 4)
        edited = vertices[:, :3].copy()
        changed = np.zeros(len(vertices), dtype=bool)
        new_colours = edits.vertex_rgb
        for index, name in enumerate(polytope.vertex_ids):
            if name in new_colours:
                edited[index] = new_colours[name]
                changed[index] = True
        edge_ids = list(polytope.edge_ids)
        number = {name: index for index, name in enumerate(edge_ids)}
        stops = [
            (s["id"], number[s["edge"]], float(s["frame"]), np.asarray(s["rgb"], dtype=np.float64))
            for s in edits.stops
        ]
        return cls(
            ids=list(polytope.vertex_ids),
            frames=vertices[:, 3].copy(),
            rgb=vertices[:, :3].copy(),
            edited=edited,
            changed=changed,
            edges=[(int(a), int(b)) for a, b in np.asarray(polytope.edges).reshape(-1, 2)],
            edge_ids=edge_ids,
            stops=sorted(stops, key=lambda stop: (stop[1], stop[2])),
            sections=list(polytope.sections),
            first=float(polytope.first_frame),
            last=float(polytope.last_frame),
        )

    def before(self, edge: int, frames: F64) -> F64:
        """Return the original colours on an edge at (k,) times, (k, 3)."""
        start, end = self.edges[edge]
        knots = [self.frames[start], self.frames[end]]
        colours = np.stack([self.rgb[start], self.rgb[end]])
        return np.stack([np.interp(frames, knots, colours[:, c]) for c in range(3)], axis=-1)

    def after(self, edge: int, frames: F64) -> F64:
        """Return the edited colours on an edge at (k,) times, (k, 3): linear between stops."""
        start, end = self.edges[edge]
        inner = [stop for stop in self.stops if stop[1] == edge]
        knots = [self.frames[start], *(s[2] for s in inner), self.frames[end]]
        colours = np.stack([self.edited[start], *(s[3] for s in inner), self.edited[end]])
        return np.stack([np.interp(frames, knots, colours[:, c]) for c in range(3)], axis=-1)

    @property
    def edited_times(self) -> list[float]:
        """Return the frames of edited vertices and of stops."""
        return [float(t) for t in self.frames[self.changed]] + [stop[2] for stop in self.stops]

    def touched(self, edge: int) -> bool:
        """Whether anything on this edge is edited."""
        start, end = self.edges[edge]
        return bool(
            self.changed[start] or self.changed[end] or any(s[1] == edge for s in self.stops)
        )


@dataclass
class Frame:
    """Where the timeline stands on the page, in points, and how rows and times map onto it."""

    left: float
    right: float
    top: float
    first: float
    last: float
    rows: int
    row_height: float

    #: Room for the block names above the rows and for the axis below them.
    HEAD = 34.0
    FOOT = 34.0
    #: Room between the panel's sides and the first and last frame.
    SIDE = 46.0

    @property
    def height(self) -> float:
        """Return the height of the panel."""
        return self.HEAD + self.rows * self.row_height + self.FOOT

    @property
    def bottom(self) -> float:
        """Return the y of the panel's lower side."""
        return self.top - self.height

    @property
    def floor(self) -> float:
        """Return the y where the rows end and the axis begins."""
        return self.bottom + self.FOOT

    def x(self, frame: Any) -> Any:
        """Return the x of frame numbers; a clip of one frame stands in the middle."""
        low, high = self.left + self.SIDE, self.right - self.SIDE
        span = self.last - self.first
        if span <= 0:
            return np.zeros_like(np.asarray(frame, dtype=np.float64)) + (low + high) / 2
        return low + (np.asarray(frame, dtype=np.float64) - self.first) / span * (high - low)

    def y(self, row: Any) -> Any:
        """Return the y of a row's middle."""
        return self.top - self.HEAD - (np.asarray(row, dtype=np.float64) + 0.5) * self.row_height


def row_height(rows: int) -> float:
    """Return the height of a row in points: generous for few, tight for many."""
    return float(np.clip(1100.0 / max(rows, 1), 16.0, 50.0))


@dataclass
class Labels:
    """Places text where nothing else is: boxes are (x0, y0, x1, y1) in points."""

    taken: list[tuple[float, float, float, float]] = field(default_factory=list)

    def free(self, box: tuple[float, float, float, float]) -> bool:
        """Whether a box meets none that is taken."""
        x0, y0, x1, y1 = box
        return all(x1 <= a or c <= x0 or y1 <= b or d <= y0 for a, b, c, d in self.taken)

    def take(self, box: tuple[float, float, float, float]) -> None:
        """Mark a box as taken."""
        self.taken.append(box)


def text_width(text: str, size: float) -> float:
    """Return the width of a line of text in points."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), text, size=size, prop=FontProperties(family=[style.FONT]), usetex=False)
    return float(path.get_extents().x1) if len(path.vertices) else 0.0


def _ease(u: F64) -> F64:
    return u * u * (3 - 2 * u)


def draw(axes: Any, palette: Palette, layout: layouts.Layout, frame: Frame, encoding: str) -> None:
    """Draw the timeline."""
    _draw_ground(axes, palette, frame)
    chain_rows = layout.rows
    vertex_y = frame.y(chain_rows[layout.vertex_chain])
    edge_y = frame.y(chain_rows[layout.edge_chain])
    # Forks first: a row's own band runs over what leaves and joins it.
    forking = [
        e
        for e, (a, b) in enumerate(palette.edges)
        if vertex_y[a] != edge_y[e] or vertex_y[b] != edge_y[e]
    ]
    order = forking + [e for e in range(len(palette.edges)) if e not in set(forking)]
    paths = {e: _path(palette, frame, e, vertex_y, float(edge_y[e])) for e in order}
    for rank, edge in enumerate(order):
        _draw_band(axes, palette, frame, edge, paths[edge], encoding, 4 + rank / len(order))
    _draw_discs(axes, palette, frame, vertex_y, paths, encoding)


def _draw_ground(axes: Any, palette: Palette, frame: Frame) -> None:
    from matplotlib.patches import FancyBboxPatch, Rectangle

    panel = FancyBboxPatch(
        (frame.left, frame.bottom),
        frame.right - frame.left,
        frame.height,
        boxstyle="round,pad=0,rounding_size=8",
        facecolor=style.PANEL,
        edgecolor=style.LINE,
        linewidth=0.8,
        zorder=1,
    )
    axes.add_patch(panel)
    top = frame.top - 1
    labels = Labels()
    blocks = [s for s in palette.sections if not s["transition"]]
    for number, block in enumerate(blocks):
        x0, x1 = float(frame.x(block["first"])), float(frame.x(block["last"]))
        if number % 2:
            axes.add_patch(
                Rectangle(
                    (x0, frame.floor),
                    x1 - x0,
                    top - frame.floor,
                    facecolor=style.PANEL_ALTERNATE,
                    linewidth=0,
                    zorder=1.2,
                )
            )
        span = style.number(block["first"])
        if block["last"] != block["first"]:
            span += f"–{style.number(block['last'])}"
        for text in (f"block {number + 1}   {span}", f"block {number + 1}", f"{number + 1}"):
            width = text_width(text, 8) + 8
            middle = (x0 + x1) / 2
            box = (middle - width / 2, 0.0, middle + width / 2, 1.0)
            if (width <= x1 - x0 or len(blocks) == 1) and labels.free(box):
                labels.take(box)
                axes.text(
                    middle,
                    frame.top - 15,
                    text,
                    fontsize=8,
                    color=style.FAINT,
                    ha="center",
                    va="center",
                    zorder=3,
                )
                break
    for section in palette.sections:
        if section["transition"]:
            x0, x1 = float(frame.x(section["first"])), float(frame.x(section["last"]))
            axes.add_patch(
                Rectangle(
                    (x0, frame.floor),
                    x1 - x0,
                    top - frame.floor,
                    facecolor=style.TRANSITION,
                    linewidth=0,
                    zorder=1.3,
                )
            )
            for x in (x0, x1):
                axes.plot([x, x], [frame.floor, top], color=style.LINE, linewidth=0.8, zorder=1.5)
    _draw_axis(axes, palette, frame)


def _draw_axis(axes: Any, palette: Palette, frame: Frame) -> None:
    low, high = float(frame.x(palette.first)), float(frame.x(palette.last))
    axes.plot(
        [min(low, frame.left + 12), max(high, frame.right - 12)],
        [frame.floor] * 2,
        color=style.GUIDE,
        linewidth=0.8,
        zorder=2,
    )
    most = max(2, int((high - low) / 70))
    values: list[float] = [palette.first]
    if palette.last > palette.first:
        inner = style.ticks(palette.first, palette.last, most)
        room = (high - low) / max(most, 1) * 0.55
        values += [v for v in inner if min(frame.x(v) - low, high - frame.x(v)) > room]
        values.append(palette.last)
    for value in values:
        x = float(frame.x(value))
        axes.plot(
            [x, x], [frame.floor, frame.floor - 4], color=style.GUIDE, linewidth=0.8, zorder=2
        )
        axes.text(
            x,
            frame.floor - 12,
            style.number(value),
            fontsize=8.5,
            color=style.TEXT,
            ha="center",
            va="center",
            zorder=3,
        )
    axes.text(
        frame.left + 14,
        frame.floor - 12,
        "frame",
        fontsize=8,
        color=style.FAINT,
        ha="left",
        va="center",
        zorder=3,
    )


def _path(
    palette: Palette, frame: Frame, edge: int, vertex_y: F64, row_y: float
) -> tuple[F64, F64]:
    """Return the (k,) times and (k, 2) points of an edge's middle line."""
    start, end = palette.edges[edge]
    x0, x1 = float(frame.x(palette.frames[start])), float(frame.x(palette.frames[end]))
    y0, y1 = float(vertex_y[start]), float(vertex_y[end])
    rise, fall = abs(y0 - row_y), abs(y1 - row_y)
    length = x1 - x0
    reach0 = min(length if not fall else length / 2, max(1.3 * rise, 36.0)) if rise else 0.0
    reach1 = min(length if not rise else length / 2, max(1.3 * fall, 36.0)) if fall else 0.0
    pieces = int(np.clip((length + rise + fall) / PIECE, 2, 600))
    # Finer where the line is steep: equal steps along the line, not along time.
    u = np.linspace(0, 1, 4 * pieces + 1)
    x = x0 + u * length
    y = np.full_like(x, row_y)
    if reach0:
        y += (y0 - row_y) * _ease(np.clip(1 - (x - x0) / reach0, 0, 1))
    if reach1:
        y += (y1 - row_y) * _ease(np.clip(1 - (x1 - x) / reach1, 0, 1))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.linspace(0, along[-1], pieces + 1)
    points = np.stack([np.interp(at, along, x), np.interp(at, along, y)], axis=-1)
    share = (points[:, 0] - x0) / length if length > 0 else np.linspace(0, 1, pieces + 1)
    times = palette.frames[start] + share * (palette.frames[end] - palette.frames[start])
    return times, points


def _normals(points: F64) -> F64:
    tangent = np.gradient(points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    return np.stack([-tangent[:, 1], tangent[:, 0]], axis=-1)


def _draw_band(
    axes: Any,
    palette: Palette,
    frame: Frame,
    edge: int,
    path: tuple[F64, F64],
    encoding: str,
    zorder: float,
) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    times, points = path
    normals = _normals(points)
    half = 0.17 * frame.row_height
    middle = (times[1:] + times[:-1]) / 2
    touched = palette.touched(edge)
    halves = [(half, -half if not touched else 0.0, palette.before(edge, middle))]
    if touched:
        halves.append((0.0, -half, palette.after(edge, middle)))
    tangent = np.stack([normals[:, 1], -normals[:, 0]], axis=-1) * 0.35
    for upper, lower, colours in halves:
        quads = np.stack(
            [
                points[:-1] + normals[:-1] * upper,
                points[1:] + normals[1:] * upper + tangent[1:],
                points[1:] + normals[1:] * lower + tangent[1:],
                points[:-1] + normals[:-1] * lower,
            ],
            axis=1,
        )
        # Not antialiased: pieces would show their seams. The outline below smooths the rim.
        band = PolyCollection(
            list(quads),
            facecolors=style.shown(colours, encoding),
            edgecolors="none",
            linewidths=0,
            antialiaseds=False,
            zorder=zorder,
        )
        band.set_gid(f"band-{palette.edge_ids[edge]}")
        axes.add_collection(band, autolim=False)
    rims = [points + normals * half, points - normals * half]
    axes.add_collection(
        LineCollection(rims, colors=style.RIM, linewidths=0.8, zorder=zorder + 0.001),
        autolim=False,
    )
    if touched:
        axes.add_collection(
            LineCollection([points], colors=style.INK, linewidths=0.8, zorder=zorder + 0.002),
            autolim=False,
        )


def half_disc(
    axes: Any,
    x: float,
    y: float,
    radius: float,
    before: F64,
    after: F64,
    *,
    kind: str,
    zorder: float,
    gid: str | None = None,
) -> None:
    """Draw a disc whose upper half is the colour before, the lower half the colour after.

    kind: "plain" (unedited vertex), "edited" (edited vertex) or "stop".
    """
    from matplotlib.patches import Circle, Patch, Wedge

    ring = {"plain": style.RING, "edited": style.BRIGHT, "stop": style.BRIGHT}[kind]
    parts: list[Patch] = [
        Circle((x, y), radius + 1.9, facecolor=style.INK, linewidth=0, zorder=zorder)
    ]
    if kind == "stop":
        # A second ring, apart from the first, tells a stop from a vertex.
        parts.append(
            Circle(
                (x, y),
                radius + 2.6,
                facecolor=style.INK,
                edgecolor=ring,
                linewidth=0.9,
                zorder=zorder,
            )
        )
    if np.array_equal(before, after):
        parts.append(Circle((x, y), radius, facecolor=before, linewidth=0, zorder=zorder + 0.01))
    else:
        for colour, start in ((before, 0), (after, 180)):
            half = Wedge((x, y), radius, start, start + 180, facecolor=colour, linewidth=0)
            half.set_zorder(zorder + 0.01)
            parts.append(half)
    for part in parts:
        axes.add_patch(part)
    if kind != "plain":
        axes.plot(
            [x - radius, x + radius],
            [y, y],
            color=style.INK,
            linewidth=0.9,
            solid_capstyle="butt",
            zorder=zorder + 0.02,
        )
    rim = Circle(
        (x, y),
        radius,
        fill=False,
        edgecolor=ring,
        linewidth=1.7 if kind == "edited" else 1.0,
        zorder=zorder + 0.03,
    )
    if gid is not None:
        rim.set_gid(gid)
    axes.add_patch(rim)


#: Room that a disc takes beyond its radius: the dark rim, or a stop's second ring.
COLLAR = 2.6


def _place(largest: F64, x: F64, y: F64, low: float, high: float) -> tuple[F64, F64]:
    """Make discs that stand close in a row smaller, and where that is not enough push them apart.

    Parameters
    ----------
    largest : (n,) float64
        The radius that each would have with room enough.
    x, y : (n,) float64
        Where they belong; discs of equal y are in one row.
    low, high : float
        What a row offers, in x.

    Returns
    -------
    x, radius : (n,) float64
        Discs of a row keep their order and do not overlap, as long as a row has fewer than some
        hundred of them.
    """
    radius, placed = largest.copy(), x.copy()
    for row in np.unique(y):
        members = np.flatnonzero(y == row)
        members = members[np.argsort(x[members], kind="stable")]
        if len(members) < 2:
            continue
        gaps = np.diff(x[members])
        each = (high - low) / len(members)
        least = np.minimum(0.5 * largest[members], max(1.6, each / 2 - COLLAR))
        for side, bound in ((members[:-1], least[:-1]), (members[1:], least[1:])):
            radius[side] = np.minimum(radius[side], np.maximum(gaps / 2 - COLLAR, bound))
    # Not too different from each other: size has no meaning here.
    if len(radius):
        radius = np.minimum(radius, 1.5 * np.median(radius))
    for row in np.unique(y):
        members = np.flatnonzero(y == row)
        members = members[np.argsort(x[members], kind="stable")]
        reach = radius[members] + COLLAR
        apart = np.concatenate([[0.0], np.cumsum(reach[:-1] + reach[1:])])
        apart *= min(1.0, (high - low - reach[0] - reach[-1]) / max(apart[-1], 1e-9))
        # The nearest places that keep these distances: least squares under an order, with what
        # a disc must stand off from the row's first one taken away.
        free = _increasing(x[members] - apart)
        free = np.clip(free, low + reach[0], high - reach[-1] - apart[-1])
        placed[members] = free + apart
    return placed, radius


def _increasing(values: F64) -> F64:
    """Return the non-decreasing sequence that is nearest to `values`: neighbours are pooled."""
    pools: list[tuple[float, int]] = []
    for value in values:
        mean, count = float(value), 1
        while pools and pools[-1][0] > mean:
            before, many = pools.pop()
            mean, count = (before * many + mean * count) / (many + count), many + count
        pools.append((mean, count))
    return np.concatenate([np.full(count, mean) for mean, count in pools])


def _draw_discs(
    axes: Any,
    palette: Palette,
    frame: Frame,
    vertex_y: F64,
    paths: dict[int, tuple[F64, F64]],
    encoding: str,
) -> None:
    largest = 0.33 * frame.row_height
    vertex_x = np.asarray(frame.x(palette.frames), dtype=np.float64)
    stop_xy = np.array(
        [
            [np.interp(when, paths[edge][0], paths[edge][1][:, k]) for k in range(2)]
            for _, edge, when, _ in palette.stops
        ]
    ).reshape(-1, 2)
    home_x = np.concatenate([vertex_x, stop_xy[:, 0]])
    home_y = np.concatenate([vertex_y, stop_xy[:, 1]])
    wanted = np.repeat([largest, 0.66 * largest], [len(vertex_x), len(stop_xy)])
    placed, radii = _place(wanted, home_x, home_y, frame.left + 4, frame.right - 4)
    for x, home, y, radius in zip(placed, home_x, home_y, radii, strict=True):
        # A disc that had to make way: a line from where it belongs, in time, to where it stands.
        if abs(x - home) > 2.5:
            foot = y - 0.17 * frame.row_height - 3.5
            axes.plot(
                [home, home, x],
                [y, foot, y - radius],
                color=style.RING,
                linewidth=0.8,
                zorder=9,
            )
    marks = []  # (x, y, radius, text, bright)
    for index, name in enumerate(palette.ids):
        before = style.shown(palette.rgb[index], encoding)
        after = style.shown(palette.edited[index], encoding)
        x, y, radius = float(placed[index]), float(vertex_y[index]), float(radii[index])
        changed = bool(palette.changed[index])
        half_disc(
            axes,
            x,
            y,
            radius,
            before,
            after,
            kind="edited" if changed else "plain",
            zorder=10,
            gid=f"vertex-{name}",
        )
        marks.append((x, y, radius + 2, name, changed))
    for index, (name, edge, when, colour) in enumerate(palette.stops):
        x, y = float(placed[len(palette.ids) + index]), float(stop_xy[index, 1])
        before = style.shown(palette.before(edge, np.array([when]))[0], encoding)
        radius = float(radii[len(palette.ids) + index])
        half_disc(
            axes,
            x,
            y,
            radius,
            before,
            style.shown(colour, encoding),
            kind="stop",
            zorder=11,
            gid=f"stop-{name}",
        )
        marks.append((x, y, radius + 3.5, name, True))
    _draw_labels(axes, marks, frame)


def _draw_labels(
    axes: Any, marks: Sequence[tuple[float, float, float, str, bool]], frame: Frame
) -> None:
    """Write the ids beside their discs; an id that finds no room is left out of the picture."""
    size = float(np.clip(0.18 * frame.row_height, 6.0, 8.0))
    height = size * 0.95
    labels = Labels()
    for x, y, radius, _, _ in marks:
        labels.take((x - radius, y - radius, x + radius, y + radius))
    # Edited ones choose first.
    for x, y, radius, name, bright in sorted(marks, key=lambda mark: not mark[4]):
        text = style.printable(name, 14)
        width = text_width(text, size) + 3
        side = radius + 2 + width / 2
        up = radius + 1.5 + height / 2
        for dx, dy in (
            (0.0, up),
            (0.0, -up),
            (side * 0.75, up * 0.8),
            (-side * 0.75, up * 0.8),
            (side * 0.75, -up * 0.8),
            (-side * 0.75, -up * 0.8),
        ):
            box = (
                x + dx - width / 2,
                y + dy - height / 2,
                x + dx + width / 2,
                y + dy + height / 2,
            )
            inside = box[0] >= frame.left + 2 and box[2] <= frame.right - 2
            if inside and labels.free(box):
                labels.take(box)
                axes.text(
                    x + dx,
                    y + dy,
                    text,
                    fontsize=size,
                    color=style.BRIGHT if bright else style.TEXT,
                    fontweight="bold" if bright else "normal",
                    ha="center",
                    va="center_baseline",
                    zorder=20,
                    parse_math=False,
                    bbox={"facecolor": style.PANEL, "alpha": 0.6, "linewidth": 0, "pad": 0.8},
                )
                break
