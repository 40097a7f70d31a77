"""The timeline: bands, forks, blocks and the frame axis; `discs` draws what stands on the bands.

Everything is drawn on one Axes whose unit is the point (1/72 inch), y upwards, so that discs are
round and gaps are known.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.plotting import discs, style
from palette4d.plotting import layout as layouts
from palette4d.plotting.discs import Labels, text_width
from palette4d.plotting.panel import Frame, Palette

F64 = NDArray[np.float64]

#: Length of the pieces of a band, in points: short enough for a smooth gradient.
PIECE = 2.5


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
    crossing = _crossings([paths[e] for e in forking], frame)
    discs.draw(axes, palette, frame, vertex_y, paths, crossing, encoding)


def _crossings(paths: Sequence[tuple[F64, F64]], frame: Frame) -> F64:
    """Return (n, 4) boxes x0, y0, x1, y1 of where forks run between rows: no place for letters."""
    half = 0.17 * frame.row_height
    boxes = []
    for _, points in paths:
        steep = np.abs(np.diff(points[:, 1])) > 0.3 * np.abs(np.diff(points[:, 0]))
        start, end = points[:-1][steep], points[1:][steep]
        boxes.append(np.hstack([np.minimum(start, end) - half, np.maximum(start, end) + half]))
    return np.vstack(boxes) if boxes else np.zeros((0, 4))


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
            # A block of one frame has its number, if nothing else.
            fits = width <= x1 - x0 or len(blocks) == 1 or text == f"{number + 1}"
            if fits and labels.free(box):
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
