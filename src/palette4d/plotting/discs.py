"""Vertices and stops on a timeline: half discs that make way for each other, and their labels."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.plotting import style
from palette4d.plotting.panel import Frame, Palette

F64 = NDArray[np.float64]


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


def draw(
    axes: Any,
    palette: Palette,
    frame: Frame,
    vertex_y: F64,
    paths: dict[int, tuple[F64, F64]],
    crossing: F64,
    encoding: str,
) -> None:
    """Draw the vertices and stops of a palette.

    Parameters
    ----------
    axes : matplotlib Axes, in points.
    palette, frame, encoding
        What is shown, where, and in which numbers.
    vertex_y : (n,) float64
        The y of each vertex.
    paths : dict of int to ((k,), (k, 2)) float64
        Times and points of each edge's middle line.
    crossing : (m, 4) float64
        Boxes x0, y0, x1, y1 that labels keep off as far as they can: bands between rows.
    """
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
    _draw_labels(axes, marks, crossing, frame)


def _draw_labels(
    axes: Any,
    marks: Sequence[tuple[float, float, float, str, bool]],
    crossing: F64,
    frame: Frame,
) -> None:
    """Write the ids beside their discs, beside forks rather than across them; an id that finds no
    room is left out of the picture."""
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
        places: list[tuple[bool, int, tuple[float, float, float, float]]] = []
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
            inside = inside and box[1] > frame.floor + 1
            if inside and labels.free(box):
                places.append((_meets(box, crossing), len(places), box))
        if not places:
            continue
        _, _, box = min(places)
        labels.take(box)
        axes.text(
            (box[0] + box[2]) / 2,
            (box[1] + box[3]) / 2,
            text,
            fontsize=size,
            color=style.BRIGHT if bright else style.TEXT,
            fontweight="bold" if bright else "normal",
            ha="center",
            va="center_baseline",
            zorder=20,
            parse_math=False,
            bbox={"facecolor": style.PANEL, "alpha": 0.85, "linewidth": 0, "pad": 0.8},
        )


def _meets(box: tuple[float, float, float, float], others: F64) -> bool:
    """Whether a box meets any of (n, 4) others."""
    x0, y0, x1, y1 = box
    apart = (
        (others[:, 2] <= x0) | (x1 <= others[:, 0]) | (others[:, 3] <= y0) | (y1 <= others[:, 1])
    )
    return not bool(apart.all())
