"""The timeline: bands, forks, blocks, discs and the frame axis.

Everything is on one matplotlib Axes; its unit is the point (1/72 inch), y upwards.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.plotting import style
from palette4d.plotting.rows import Palette, Rows

F64 = NDArray[np.float64]
#: x0, y0, x1, y1 in points.
Box = tuple[float, float, float, float]

#: Length of the pieces of a band, in points: short enough for a smooth gradient.
PIECE = 2.5
#: Space around a disc beyond its radius, for the dark rim or a stop's second ring.
COLLAR = 2.6
#: Half the width of a band, and the largest radius of a vertex, in rows.
BAND, RADIUS = 0.17, 0.33
#: Space for the block names above the rows, for the axis below them, and at the sides.
HEAD, FOOT, SIDE = 34.0, 34.0, 46.0


@dataclass
class Panel:
    """The timeline's place on the page, in points, and the mapping of rows and times to it."""

    palette: Palette
    rows: Rows
    left: float
    right: float
    row_height: float
    top: float = 0.0

    @property
    def height(self) -> float:
        """The height of the panel."""
        return HEAD + self.rows.count * self.row_height + FOOT

    @property
    def bottom(self) -> float:
        """The y of the panel's lower side."""
        return self.top - self.height

    @property
    def floor(self) -> float:
        """The y where the rows end and the axis begins."""
        return self.bottom + FOOT

    def x(self, frame: ArrayLike) -> Any:
        """Return the x of frame numbers; a clip of one frame is in the middle."""
        first, last = self.palette.first, self.palette.last
        ends = [self.left + SIDE, self.right - SIDE]
        if last <= first:
            return np.full(np.shape(frame), sum(ends) / 2)
        share = (np.asarray(frame, dtype=np.float64) - first) / (last - first)
        return ends[0] + share * (ends[1] - ends[0])

    def y(self, row: ArrayLike) -> F64:
        """Return the y of a row's middle."""
        return self.top - HEAD - (np.asarray(row, dtype=np.float64) + 0.5) * self.row_height


def disc(
    axes: Any, x: float, y: float, radius: float, halves: F64, kind: str, zorder: float
) -> tuple[Any, ...]:
    """Draw a disc: the upper half is the colour before, the lower half the colour after.

    `halves` is (2, 3); kind: "plain" (unedited vertex), "edited" (edited vertex) or "stop". Return
    the markers, the rim last.
    """

    def marker(name: str, size: float, **how: Any) -> Any:
        how = {"markeredgewidth": 0, "linestyle": "none", "zorder": zorder, **how}
        return axes.plot([x], [y], marker=name, markersize=2 * size, **how)[0]

    ring = style.RING if kind == "plain" else style.BRIGHT
    upper, lower = (tuple(colour) for colour in halves)
    markers = [marker("o", radius + 1.9, markerfacecolor=style.INK)]
    if kind == "stop":  # a second ring tells a stop from a vertex
        second = {"markeredgecolor": ring, "markeredgewidth": 0.9}
        markers = [marker("o", radius + COLLAR, markerfacecolor=style.INK, **second)]
    # Halves of one colour are one disc: no seam.
    fill = "full" if upper == lower else "top"
    filled = {"fillstyle": fill, "markerfacecolor": upper, "markerfacecoloralt": lower}
    markers.append(marker("o", radius, **filled))
    if kind != "plain":
        markers.append(marker("_", radius, markeredgecolor=style.INK, markeredgewidth=0.9))
    width = 1.7 if kind == "edited" else 1.0
    rim = {"markerfacecolor": "none", "markeredgecolor": ring, "markeredgewidth": width}
    return (*markers, marker("o", radius, **rim))


def draw(axes: Any, panel: Panel, encoding: str) -> None:
    """Draw the timeline."""
    _draw_ground(axes, panel)
    _draw_axis(axes, panel)
    palette, rows = panel.palette, panel.rows
    vertex_y = panel.y(rows.row[rows.vertex_chain])
    edge_y = panel.y(rows.row[rows.edge_chain])
    # Forks first: a row's own band covers the bands that leave and join it.
    forks = [
        (vertex_y[list(ends)] != y).any() for ends, y in zip(palette.edges, edge_y, strict=True)
    ]
    order = sorted(range(len(palette.edges)), key=lambda edge: not forks[edge])
    paths = {edge: _path(panel, edge, vertex_y, float(edge_y[edge])) for edge in order}
    for rank, edge in enumerate(order):
        _draw_band(axes, panel, edge, paths[edge], encoding, 4 + rank / len(order))
    _draw_discs(axes, panel, vertex_y, paths, encoding)


def _draw_ground(axes: Any, panel: Panel) -> None:
    """Draw the panel, its blocks with their names, and its transitions."""
    from matplotlib.patches import FancyBboxPatch, Rectangle

    corner, width = (panel.left, panel.bottom), panel.right - panel.left
    box: dict[str, Any] = {
        "facecolor": style.PANEL,
        "edgecolor": style.LINE,
        "linewidth": 0.8,
        "zorder": 1,
    }
    rounded = "round,pad=0,rounding_size=8"
    axes.add_patch(FancyBboxPatch(corner, width, panel.height, boxstyle=rounded, **box))
    tall = panel.top - 1 - panel.floor
    number, named = 0, -np.inf
    for section in panel.palette.sections:
        x0, x1 = panel.x([section["first"], section["last"]])
        if section["transition"]:
            ground = Rectangle((x0, panel.floor), x1 - x0, tall, linewidth=0, zorder=1.3)
            ground.set_facecolor(style.TRANSITION)
            axes.add_patch(ground)
            axes.vlines(
                [x0, x1], panel.floor, panel.top - 1, colors=style.LINE, linewidth=0.8, zorder=1.5
            )
            continue
        number += 1
        if number % 2 == 0:
            ground = Rectangle((x0, panel.floor), x1 - x0, tall, linewidth=0, zorder=1.2)
            ground.set_facecolor(style.PANEL_ALTERNATE)
            axes.add_patch(ground)
        ends = dict.fromkeys((style.number(section["first"]), style.number(section["last"])))
        long = f"block {number}   {'–'.join(ends)}"
        for text in (long, f"block {number}", f"{number}"):
            half = _width(text, 8) / 2 + 4
            fits = 2 * half <= x1 - x0 or x0 == x1 or text == f"{number}"
            if fits and (x0 + x1) / 2 - half >= named:
                axes.text((x0 + x1) / 2, panel.top - 15, text, zorder=3, **style.CENTRED)
                named = (x0 + x1) / 2 + half
                break


def _draw_axis(axes: Any, panel: Panel) -> None:
    from matplotlib.ticker import MaxNLocator

    first, last = panel.palette.first, panel.palette.last
    low, high = (float(x) for x in panel.x([first, last]))
    most = max(2, int((high - low) / 70))
    inner = (
        MaxNLocator(most, integer=True, steps=[1, 2, 5, 10]).tick_values(first, last)
        if last > first
        else []
    )
    room = (high - low) / most * 0.55
    ticks = [v for v in inner if min(panel.x(v) - low, high - panel.x(v)) > room]
    ends = [min(low, panel.left + 12), max(high, panel.right - 12)]
    line = {"colors": style.GUIDE, "linewidth": 0.8, "zorder": 2}
    axes.hlines(panel.floor, *ends, **line)
    label = {**style.CENTRED, "zorder": 3, "fontsize": 8.5, "color": style.TEXT}
    for value in sorted({first, *ticks, last}):
        x = float(panel.x(value))
        axes.vlines(x, panel.floor - 4, panel.floor, **line)
        axes.text(x, panel.floor - 12, style.number(value), **label)
    faint = {**style.CENTRED, "ha": "left", "zorder": 3}
    axes.text(panel.left + 14, panel.floor - 12, "frame", **faint)


def _path(panel: Panel, edge: int, vertex_y: F64, row_y: float) -> tuple[F64, F64]:
    """Return the (k,) times and (k, 2) points of an edge's middle line."""
    start, end = panel.palette.edges[edge]
    times = panel.palette.frames[[start, end]]
    x0, x1 = (float(x) for x in panel.x(times))
    rise, fall = float(vertex_y[start]) - row_y, float(vertex_y[end]) - row_y
    length = x1 - x0
    x = np.linspace(x0, x1, 4 * int(np.clip((length + abs(rise) + abs(fall)) / PIECE, 2, 600)) + 1)
    y = np.full_like(x, row_y)
    for height, away in ((rise, x - x0), (fall, x1 - x)):
        if height:
            reach = min(length / 2 if rise and fall else length, max(1.3 * abs(height), 36.0))
            u = np.clip(1 - away / max(reach, 1e-9), 0, 1)
            y += height * u * u * (3 - 2 * u)
    # Equal steps along the line, not along time: finer where the line is steep.
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.linspace(0, along[-1], len(x) // 4 + 1)
    points = np.stack([np.interp(at, along, x), np.interp(at, along, y)], axis=-1)
    return np.interp(at, along, np.linspace(times[0], times[1], len(x))), points


def _draw_band(
    axes: Any, panel: Panel, edge: int, path: tuple[F64, F64], encoding: str, zorder: float
) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    times, points = path
    tangent = np.gradient(points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=-1) * BAND * panel.row_height
    middle = (times[1:] + times[:-1]) / 2
    touched = panel.palette.touched(edge)
    parts = [(1.0, 0.0, False), (0.0, -1.0, True)] if touched else [(1.0, -1.0, False)]
    for upper, lower, edited in parts:
        # Pieces overlap a little: no seams.
        a, b = points[:-1], points[1:] + 0.35 * tangent[1:]
        n, m = normal[:-1], normal[1:]
        quads = np.stack([a + n * upper, b + m * upper, b + m * lower, a + n * lower], axis=1)
        colours = style.shown(panel.palette.colours(edge, middle, edited=edited), encoding)
        # Antialiasing would show seams between the pieces. The rims smooth the sides.
        band = PolyCollection(
            list(quads), facecolors=colours, linewidths=0, antialiaseds=False, zorder=zorder
        )
        band.set_gid(f"band-{panel.palette.edge_ids[edge]}")
        axes.add_collection(band, autolim=False)
    rims = [(points + normal, style.RIM), (points - normal, style.RIM)]
    rims += [(points, style.INK)] if touched else []
    lines = LineCollection([line for line, _ in rims], colors=[grey for _, grey in rims])
    lines.set(linewidths=0.8, zorder=zorder + 0.001)
    axes.add_collection(lines, autolim=False)


def _draw_discs(
    axes: Any, panel: Panel, vertex_y: F64, paths: dict[int, tuple[F64, F64]], encoding: str
) -> None:
    """Draw vertices and stops, and their ids."""
    palette = panel.palette
    on_edges = [
        [np.interp(when, paths[edge][0], paths[edge][1][:, k]) for k in range(2)]
        for _, edge, when, _ in palette.stops
    ]
    stop_xy = np.array(on_edges).reshape(-1, 2)
    home = np.concatenate([panel.x(palette.frames), stop_xy[:, 0]])
    y = np.concatenate([vertex_y, stop_xy[:, 1]])
    largest = RADIUS * panel.row_height
    wanted = np.repeat([largest, 0.66 * largest], [len(palette.ids), len(palette.stops)])
    x, radius = _place(wanted, home, y, panel.left + 4, panel.right - 4)
    names = [*palette.ids, *(stop[0] for stop in palette.stops)]
    kinds = ["edited" if changed else "plain" for changed in palette.changed]
    kinds += ["stop"] * len(palette.stops)
    halves = [*np.stack([palette.rgb, palette.edited], axis=1)]
    for _, edge, when, colour in palette.stops:
        halves.append(np.stack([palette.colours(edge, np.array([when]), edited=False)[0], colour]))
    for k, name in enumerate(names):
        if abs(x[k] - home[k]) > 2.5:
            # A line from a moved disc to its time.
            foot = y[k] - BAND * panel.row_height - 3.5
            bent = [home[k], home[k], x[k]], [y[k], foot, y[k] - radius[k]]
            axes.plot(*bent, color=style.RING, linewidth=0.8, zorder=9)
        zorder = 11 if kinds[k] == "stop" else 10
        colours = style.shown(halves[k], encoding)
        rim = disc(axes, x[k], y[k], radius[k], colours, kinds[k], zorder)[-1]
        rim.set_gid(f"{'stop' if kinds[k] == 'stop' else 'vertex'}-{name}")
    _draw_ids(axes, panel, names, kinds, np.stack([x, y, radius + COLLAR], axis=-1))


def _place(largest: F64, x: F64, y: F64, low: float, high: float) -> tuple[F64, F64]:
    """Shrink discs that are close in a row; if that is not enough, move them apart.

    Parameters
    ----------
    largest : (n,) float64
        The largest radius of each disc.
    x, y : (n,) float64
        Their ideal places; discs of equal y are in one row.
    low, high : float
        The ends of a row, in x.

    Returns
    -------
    x, radius : (n,) float64
        Discs of a row keep their order and do not overlap, up to about a hundred of them.
    """
    from scipy.optimize import isotonic_regression

    order = np.lexsort((x, y))
    in_rows = np.split(order, np.flatnonzero(np.diff(y[order])) + 1)
    radius, placed = largest.copy(), x.copy()
    for row in in_rows:
        each = (high - low) / len(row)
        least = np.minimum(0.5 * largest[row], max(1.6, each / 2 - COLLAR))
        room = np.diff(x[row]) / 2 - COLLAR
        for side, bound in ((row[:-1], least[:-1]), (row[1:], least[1:])):
            radius[side] = np.minimum(radius[side], np.maximum(room, bound))
    # Similar sizes: size has no meaning here.
    radius = np.minimum(radius, 1.5 * np.median(radius))
    for row in in_rows:
        reach = radius[row] + COLLAR
        apart = np.concatenate([[0.0], np.cumsum(reach[:-1] + reach[1:])])
        apart *= min(1.0, (high - low - reach[0] - reach[-1]) / max(apart[-1], 1e-9))
        # The nearest places with these distances: least squares with a fixed order.
        free = isotonic_regression(x[row] - apart).x
        placed[row] = np.clip(free, low + reach[0], high - reach[-1] - apart[-1]) + apart
    return placed, radius


def _draw_ids(axes: Any, panel: Panel, names: list[str], kinds: list[str], discs: F64) -> None:
    """Write the ids above or below their discs, edited ids first; leave out ids without space.

    `discs` is (n, 3): x, y, radius.
    """
    size = float(np.clip(0.18 * panel.row_height, 6.0, 8.0))
    taken: list[Box] = [(x - r, y - r, x + r, y + r) for x, y, r in discs.tolist()]
    for k in sorted(range(len(names)), key=lambda k: kinds[k] == "plain"):
        (x, y, radius), bright = discs[k].tolist(), kinds[k] != "plain"
        text = style.printable(names[k], 14)
        half, tall = _width(text, size) / 2, 0.95 * size
        for bottom in (y + radius + 0.5, y - radius - 0.5 - tall):
            box = (x - half, bottom, x + half, bottom + tall)
            if bottom <= panel.floor + 1 or any(_meet(box, other) for other in taken):
                continue
            taken.append(box)
            label = {**style.CENTRED, "fontsize": size, "va": "center_baseline", "zorder": 20}
            label["color"] = style.BRIGHT if bright else style.TEXT
            label["fontweight"] = "bold" if bright else "normal"
            label["bbox"] = {"facecolor": style.PANEL, "alpha": 0.85, "linewidth": 0, "pad": 0.8}
            axes.text(x, bottom + tall / 2, text, **label)
            break


def _meet(one: Box, two: Box) -> bool:
    return one[0] < two[2] and two[0] < one[2] and one[1] < two[3] and two[1] < one[3]


def _width(text: str, size: float) -> float:
    """Return about the width of a line of text in points."""
    return 0.64 * size * len(text) + 3
