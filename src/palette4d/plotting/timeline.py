"""The timeline, drawn by matplotlib: bands, forks, blocks, discs and the frame axis.

Everything is on one matplotlib Axes; its unit is the point (1/72 inch), y upwards.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.common.text import percent
from palette4d.grade.clip_colours import Share
from palette4d.plotting import style
from palette4d.plotting.layout import (
    BAND,
    COLLAR,
    Box,
    Disc,
    Label,
    Scale,
    Timeline,
    disc_names,
    half_bands,
    meet,
)
from palette4d.plotting.rows import PlottedPalette, Rows, track_ids

F64 = NDArray[np.float64]

#: Space for the block names above the rows, for the axis below them, and at the sides.
HEAD, FOOT, SIDE = 34.0, 34.0, 56.0


class Panel:
    """The timeline's place on the page, in points."""

    def __init__(
        self, palette: PlottedPalette, rows: Rows, left: float, right: float, row_height: float
    ) -> None:
        scale = Scale(palette.first, palette.last, left + SIDE, right - SIDE)
        self.layout = Timeline(palette, rows, scale, row_height)
        self.left, self.right, self.top = left, right, 0.0

    @property
    def height(self) -> float:
        """The height of the panel."""
        return HEAD + self.layout.height + FOOT

    @property
    def bottom(self) -> float:
        """The y of the panel's lower side."""
        return self.top - self.height

    @property
    def floor(self) -> float:
        """The y where the rows end and the axis begins."""
        return self.bottom + FOOT

    def x(self, frame: ArrayLike) -> Any:
        """Return the x of frame numbers."""
        return self.layout.scale.x(frame)

    def y(self, y: ArrayLike) -> Any:
        """Return the page's y of the layout's y."""
        return self.top - HEAD - np.asarray(y, dtype=np.float64)


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

    ring = style.TEXT if kind == "plain" else style.BRIGHT
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


def draw(
    axes: Any,
    panel: Panel,
    encoding: str,
    colours: Mapping[str, str],
    shares: Mapping[str, Share],
) -> None:
    """Draw the timeline.

    `colours` has the names of the discs' colours, `shares` those of the tracks, by id.
    """
    _draw_ground(axes, panel)
    _draw_axis(axes, panel)
    for rank, edge in enumerate(panel.layout.paths):
        _draw_band(axes, panel, edge, encoding, 4 + rank / len(panel.layout.paths))
    discs = panel.layout.discs(panel.left + 4, panel.right - 4)
    for each in discs:
        _draw_disc(axes, panel, each, encoding)
    names = _draw_ids(axes, panel, discs, colours)
    _draw_tracks(axes, panel, discs, names, shares)


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
    for section in panel.layout.sections():
        x0, x1 = section.left, section.right
        if section.number % 2:
            continue
        ground = Rectangle((x0, panel.floor), x1 - x0, tall, linewidth=0, zorder=1.2)
        ground.set_facecolor(style.PANEL_ALTERNATE if section.number else style.TRANSITION)
        axes.add_patch(ground)
        if not section.number:
            line = {"colors": style.LINE, "linewidth": 0.8, "zorder": 1.5}
            axes.vlines([x0, x1], panel.floor, panel.top - 1, **line)
    names = panel.layout.block_names(15 - HEAD, lambda text: text_width(text, 8))
    for name in names if len(panel.layout.palette.sections) > 1 else ():
        axes.text(name.x, panel.y(name.y), name.text, zorder=3, **style.CENTRED)


def _draw_axis(axes: Any, panel: Panel) -> None:
    scale = panel.layout.scale
    ends = [scale.left, scale.right]
    if scale.last <= scale.first:
        ends = [sum(ends) / 2] * 2
    line = {"colors": style.GUIDE, "linewidth": 0.8, "zorder": 2}
    axes.hlines(panel.floor, min(ends[0], panel.left + 12), max(ends[1], panel.right - 12), **line)
    label = {**style.CENTRED, "zorder": 3, "fontsize": 8.5, "color": style.TEXT}
    for value in scale.ticks(*ends):
        x = float(panel.x(value))
        axes.vlines(x, panel.floor - 4, panel.floor, **line)
        axes.text(x, panel.floor - 12, style.number(value), **label)
    faint = {**style.CENTRED, "ha": "left", "zorder": 3}
    axes.text(panel.left + 14, panel.floor - 24, "frame", **faint)


def _draw_band(axes: Any, panel: Panel, edge: int, encoding: str, zorder: float) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    palette, (times, line) = panel.layout.palette, panel.layout.paths[edge]
    sides = half_bands(line, BAND * panel.layout.row_height)
    upper, middle, lower = (
        np.stack([side[:, 0], panel.y(side[:, 1])], axis=-1) for side in (sides[0], line, sides[1])
    )
    touched = palette.touched(edge)
    parts = [(upper, middle, False), (middle, lower, True)] if touched else [(upper, lower, False)]
    for above, below, edited in parts:
        # Pieces overlap a little: no seams.
        more = 0.35 * np.diff(middle, axis=0)
        more /= np.maximum(np.linalg.norm(more, axis=1, keepdims=True) / 0.35, 1e-9)
        quads = [above[:-1], above[1:] + more, below[1:] + more, below[:-1]]
        seen = palette.colours(edge, (times[1:] + times[:-1]) / 2, edited=edited)
        # Antialiasing would show seams between the pieces. The rims smooth the sides.
        band = PolyCollection(
            list(np.stack(quads, axis=1)),
            facecolors=style.shown(seen, encoding),
            linewidths=0,
            antialiaseds=False,
            zorder=zorder,
        )
        band.set_gid(f"band-{palette.edge_ids[edge]}")
        axes.add_collection(band, autolim=False)
    rims = [(upper, style.RING), (lower, style.RING)]
    rims += [(middle, style.INK)] if touched else []
    lines = LineCollection([rim for rim, _ in rims], colors=[grey for _, grey in rims])
    lines.set(linewidths=0.8, zorder=zorder + 0.001)
    axes.add_collection(lines, autolim=False)


def _draw_disc(axes: Any, panel: Panel, shown: Disc, encoding: str) -> None:
    y = float(panel.y(shown.y))
    if abs(shown.x - shown.home) > 2.5:
        # A line from a moved disc to its time.
        foot = y - BAND * panel.layout.row_height - 3.5
        bent = [shown.home, shown.home, shown.x], [y, foot, y - shown.radius]
        axes.plot(*bent, color=style.RING, linewidth=0.8, zorder=9)
    zorder = 11 if shown.kind == "stop" else 10
    halves = style.shown(np.stack([shown.before, shown.after]), encoding)
    rim = disc(axes, shown.x, y, shown.radius, halves, shown.kind, zorder)[-1]
    rim.set_gid(f"{'stop' if shown.kind == 'stop' else 'vertex'}-{shown.id}")


def _draw_ids(
    axes: Any, panel: Panel, discs: list[Disc], colours: Mapping[str, str]
) -> list[Label]:
    size = _id_size(panel)
    names = disc_names(
        discs,
        size,
        lambda text: text_width(text, size),
        panel.layout.height - 1,
        lambda text: style.printable(text, 14),
        longer={id_: style.printable(colour, 30) for id_, colour in colours.items()},
        ends=(panel.left + 4, panel.right - 4),
    )
    for name in names:
        draw_id(axes, name, float(panel.y(name.y)), size, style.PANEL)
    return names


def _id_size(panel: Panel) -> float:
    return float(np.clip(0.18 * panel.layout.row_height, 6.0, 8.0))


def _draw_tracks(
    axes: Any, panel: Panel, discs: list[Disc], names: list[Label], shares: Mapping[str, Share]
) -> None:
    """Write tracks' ids at the left of their rows, and at the right what they move.

    Where a track begins or ends inside the clip, both are below its band.
    """
    layout, size = panel.layout, _id_size(panel)
    palette = layout.palette
    track_of = track_ids(palette.sidecar.polytope)
    of_vertex = {disc.id: disc for disc in discs}
    taken = [_box(disc.x, disc.y, 2 * disc.radius, 2 * disc.radius) for disc in discs]
    taken += [_box(name.x, name.y, text_width(name.text, size), size) for name in names]

    def beside(disc: Disc, way: int, text: str) -> bool:
        """Write at the left (-1) or right (1) of the rows, if the text fits."""
        x = disc.x + way * (disc.radius + 6)
        end = x + way * text_width(text, size + 1)
        border = layout.scale.left if way < 0 else layout.scale.right
        if disc.home != border or not panel.left <= end <= panel.right:
            return False
        how = {"fontsize": size + 1, "color": style.BRIGHT, "fontweight": "bold"}
        align = {"ha": "left" if way > 0 else "right", "va": "center_baseline", "zorder": 20}
        axes.text(x, float(panel.y(disc.y)), text, **how, **align)
        return True

    def below(x: float, y: float, way: int, text: str, colour: str) -> bool:
        """Write below a band at the left (-1) or right (1) of x, if the text fits."""
        width = text_width(text, size)
        box = _box(x + way * width / 2, y + BAND * layout.row_height + 0.8 * size, width, size)
        if box[3] > layout.height or any(meet(box, other) for other in taken):
            return False
        taken.append(box)
        how = {"ha": "left" if way > 0 else "right", "va": "center_baseline", "zorder": 19}
        y = float(panel.y((box[1] + box[3]) / 2))
        axes.text(x, y, text, fontsize=size, color=colour, **how)
        return True

    for chain in layout.rows.chains:
        members = [palette.ids[vertex] for vertex in chain.vertices]
        id_ = track_of[(members or [palette.edge_ids[edge] for edge in chain.edges])[0]]
        share, name = shares.get(id_), style.printable(id_, 14)
        said = [] if share is None else [percent(share.mean)]
        most = (
            "" if share is None else f"most at {style.number(share.frame)}: {percent(share.most)}"
        )
        if not members:
            x, y = layout.at(chain.edges[0], (chain.first + chain.last) / 2)
            below(x, y, 1, "  ".join([name, *said]), style.TEXT)
            continue
        first, last = of_vertex[members[0]], of_vertex[members[-1]]
        if said and beside(last, 1, said[0]):
            said = []
            below(last.x - last.radius - 6, last.y, -1, most, style.TEXT)
        named = beside(first, -1, name)
        if said or not named:
            words = "  ".join([*([] if named else [name]), *said])
            for text in dict.fromkeys((f"{words}  {most}" if said else words, words)):
                if below(first.x + first.radius + 6, first.y, 1, text, style.TEXT):
                    break


def _box(x: float, y: float, width: float, height: float) -> Box:
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def draw_id(axes: Any, name: Label, y: float, size: float, ground: str) -> None:
    """Write the id of a disc at a page's y, with little of its ground around it."""
    label = {**style.CENTRED, "fontsize": size, "va": "center_baseline", "zorder": 20}
    label["color"] = style.BRIGHT if name.bright else style.TEXT
    label["fontweight"] = "bold" if name.bright else "normal"
    label["bbox"] = {"facecolor": ground, "alpha": 0.85, "linewidth": 0, "pad": 0.8}
    axes.text(name.x, y, name.text, **label)


def text_width(text: str, size: float) -> float:
    """Return about the width of a line of text in points."""
    return 0.64 * size * len(text) + 3
