"""The page: heading, frames before and after, the timeline, the polyhedra, and how to read it."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.plotting import discs, polyhedron, style, timeline
from palette4d.plotting import layout as layouts
from palette4d.plotting.panel import Frame, Palette, row_height

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

#: The page's width in points; --width scales a PNG, a page keeps its proportions.
WIDTH = 1200.0
MARGIN = 28.0
GUTTER = 14.0
HEADER = 76.0
#: Room between the frames and the timeline, for the lines that say when a frame is.
LEADER = 30.0


@dataclass(frozen=True)
class Moment:
    """What is shown of one time.

    Attributes
    ----------
    frame : float
        The time of the palette.
    shape : polyhedron.Shape
        The sliced palette, with pixels when the clip is at hand.
    before, after : (h, w, 3) float32 or None
        The clip's frame and its recolouring, reduced in size; `after` only where there are edits.
    """

    frame: float
    shape: polyhedron.Shape
    before: F32 | None = None
    after: F32 | None = None


def default_frames(
    first: float, last: float, edited: Sequence[float] = (), count: int = 4, most: int = 5
) -> list[float]:
    """Choose what to show: whole frame numbers spread over the clip, and those that are edited.

    Parameters
    ----------
    first, last : float
        The clip's first and last frame.
    edited : sequence of float
        Times of edited vertices and stops.
    count, most : int
        How many to show, and how many when edits ask for more; none closer than a tenth of the
        clip, but where the clip has no more frames.
    """
    if last <= first:
        return [first]

    def whole(time: float) -> float:
        return min(max(float(round(time)), first), last)

    if not edited:
        return sorted({whole(v) for v in np.linspace(first, last, count)})
    gap = max(1.0, (last - first) / 10)
    wanted = sorted({whole(v) for v in edited})
    # The clip's ends, or an edited frame that is as good as one.
    chosen = {
        min([v for v in wanted if v - first < gap], default=first),
        max([v for v in wanted if last - v < gap], default=last),
    }

    def distance(time: float) -> float:
        return min(abs(time - v) for v in chosen)

    while len(chosen) < most:
        best = max(wanted, key=distance)
        if distance(best) < gap:
            break
        chosen.add(best)
    while len(chosen) < count:
        ordered = sorted(chosen)
        start, end = max(itertools.pairwise(ordered), key=lambda pair: pair[1] - pair[0])
        middle = whole((start + end) / 2)
        if distance(middle) < gap:
            break
        chosen.add(middle)
    return sorted(chosen)


def moment(
    sidecar: _core.Sidecar,
    frame: float,
    image: F32 | None,
    *,
    thumbnail: int = 640,
    pixels: int = 4000,
) -> Moment:
    """Slice the palette at a time and recolour the clip's frame there.

    Parameters
    ----------
    sidecar : Sidecar
        Palette and edits.
    frame : float
        The time.
    image : (h, w, 3) float32 or None
        Straight colours of the clip's frame.
    thumbnail : int
        Largest width of the pictures.
    pixels : int
        At most about this many pixels go into the cloud, evenly picked.
    """
    polytope = sidecar.polytope
    palette = _core.slice_at(polytope, frame)
    edited = _core.edited_colours(polytope, sidecar.edits, palette)
    rgb, faces = np.asarray(palette.rgb), np.asarray(palette.faces)
    if image is None:
        return Moment(frame, polyhedron.Shape(rgb, np.asarray(edited), faces))
    after: F32 | None = None
    if sidecar.edits.vertex_rgb or sidecar.edits.stops:
        recolourer = _core.Recolourer(palette.rgb, edited, palette.faces)
        after = recolourer.apply(np.ascontiguousarray(image, dtype=np.float32), threads=0)
    flat = image.reshape(-1, 3)
    # A golden-ratio sequence picks evenly without following rows or columns.
    count = min(pixels, len(flat))
    picked = flat[(np.arange(count) * 0.6180339887498949 % 1 * len(flat)).astype(np.int64)]
    cloud: F64 = picked[np.isfinite(picked).all(axis=1)].astype(np.float64)
    return Moment(
        frame,
        polyhedron.Shape(rgb, np.asarray(edited), faces, cloud),
        _reduced(image, thumbnail),
        None if after is None else _reduced(after, thumbnail),
    )


def _reduced(image: F32, width: int) -> F32:
    """Average whole blocks of pixels until the image is at most `width` wide."""
    block = -(-image.shape[1] // width)
    if block == 1:
        return image
    rows, columns = max(1, image.shape[0] // block), image.shape[1] // block
    tall = min(block, image.shape[0])
    cut = image[: rows * tall, : columns * block].astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        mean = cut.reshape(rows, tall, columns, block, 3).mean(axis=(1, 3))
    return np.asarray(mean, dtype=np.float32)


def heading(sidecar: _core.Sidecar, palette: Palette) -> tuple[str, str]:
    """Return the title and the line below it."""
    clip = sidecar.clip
    blocks = sum(not s["transition"] for s in palette.sections)
    numerator, denominator = clip["rate"]

    def some(count: int, one: str, many: str) -> str:
        return f"{count} {one if count == 1 else many}"

    facts = [
        f"frames {style.number(palette.first)}–{style.number(palette.last)}"
        if palette.last > palette.first
        else f"frame {style.number(palette.first)}",
        f"{style.number(numerator / denominator)} fps",
        f"{clip['width']}×{clip['height']}",
        str(clip["encoding"]),
        some(len(palette.ids), "palette vertex", "palette vertices"),
        some(blocks, "block", "blocks"),
        some(int(palette.changed.sum()), "edited vertex", "edited vertices"),
        some(len(palette.stops), "stop", "stops"),
    ]
    return style.printable(clip["name"], 48), style.printable(
        "   ·   ".join(f for f in facts if f), 200
    )


def build(sidecar: _core.Sidecar, moments: Sequence[Moment]) -> Any:
    """Lay out and draw the page; return a matplotlib Figure of `WIDTH` points."""
    from matplotlib.figure import Figure

    palette = Palette.of(sidecar)
    encoding = str(sidecar.clip["encoding"])
    rows = layouts.arrange(palette.frames, palette.rgb, palette.edges)

    count = max(len(moments), 1)
    column = (WIDTH - 2 * MARGIN - (count - 1) * GUTTER) / count
    pictures = any(m.before is not None for m in moments)
    aspect = max(
        (m.before.shape[0] / m.before.shape[1] for m in moments if m.before is not None),
        default=0.0,
    )
    picture_width = min(column, 420.0, 260.0 / aspect if aspect else column)
    picture_height = picture_width * aspect
    names = ["before", "after"] if any(m.after is not None for m in moments) else ["clip"]
    pictures_height = len(names) * (picture_height + 4) - 2 + LEADER if pictures else 0.0
    cube = min(column * 0.96, 300.0)
    solids_height = LEADER + 30 + cube + 8 if moments else 0.0

    row = row_height(rows.row_count)
    panel = Frame(
        left=MARGIN,
        right=WIDTH - MARGIN,
        top=0.0,
        first=palette.first,
        last=palette.last,
        rows=rows.row_count,
        row_height=row,
    )
    height = HEADER + pictures_height + panel.height + solids_height + MARGIN
    panel.top = height - HEADER - pictures_height

    figure = Figure(figsize=(WIDTH / 72, height / 72), facecolor=style.PAGE)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, WIDTH)
    axes.set_ylim(0, height)
    axes.set_axis_off()
    axes.set_autoscale_on(False)

    _draw_heading(axes, sidecar, palette, height)
    timeline.draw(axes, palette, rows, panel, encoding)
    if pictures:
        for row_above, name in enumerate(names):
            axes.text(
                MARGIN / 2 + 2,
                height - HEADER - (row_above + 0.5) * picture_height - 4 * row_above,
                name,
                fontsize=8,
                color=style.FAINT,
                rotation=90,
                ha="center",
                va="center",
            )
    centres = [MARGIN + column / 2 + k * (column + GUTTER) for k in range(count)]
    extent = polyhedron.extent_of([m.shape for m in moments])
    for centre, shown in zip(centres, moments, strict=False):
        _draw_pin(axes, panel, shown, centre, pictures)
        top = height - HEADER
        if shown.before is not None:
            _draw_picture(axes, shown.before, centre, top, picture_width, encoding)
        if shown.after is not None:
            below = top - picture_height - 4
            _draw_picture(axes, shown.after, centre, below, picture_width, encoding)
        middle = panel.bottom - LEADER - 30 - cube / 2
        view = polyhedron.View.fit(extent, (centre, middle), cube)
        polyhedron.draw(axes, shown.shape, view, encoding)
    return figure


def _draw_heading(axes: Any, sidecar: _core.Sidecar, palette: Palette, height: float) -> None:
    title, facts = heading(sidecar, palette)
    axes.text(
        MARGIN,
        height - 30,
        title,
        fontsize=17,
        fontweight="bold",
        color=style.BRIGHT,
        ha="left",
        va="center",
        parse_math=False,
    )
    axes.text(
        MARGIN,
        height - 52,
        facts,
        fontsize=8.5,
        color=style.FAINT,
        ha="left",
        va="center",
        parse_math=False,
    )
    _draw_legend(axes, height - 30)


def _draw_legend(axes: Any, y: float) -> None:
    """Explain the discs, at the right of the title."""
    grey, light = np.array([0.42] * 3), np.array([0.78] * 3)
    entries = [
        ("plain", light, light, "palette vertex"),
        ("edited", grey, light, "edited: before above, after below"),
        ("stop", grey, light, "stop: a colour added between vertices"),
    ]
    x = WIDTH - MARGIN
    for kind, before, after, text in reversed(entries):
        x -= discs.text_width(text, 8.5)
        axes.text(x, y, text, fontsize=8.5, color=style.TEXT, ha="left", va="center_baseline")
        x -= 15
        radius = 6.0 if kind == "stop" else 7.5
        discs.half_disc(axes, x, y, radius, before, after, kind=kind, zorder=5)
        x -= 32


def _draw_pin(axes: Any, panel: Frame, shown: Moment, centre: float, pictures: bool) -> None:
    """Mark a moment on the timeline and lead from its pictures to it and on to its polyhedron."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Line

    x = float(panel.x(shown.frame))
    axes.plot(
        [x, x],
        [panel.floor, panel.top],
        color=style.GUIDE,
        linewidth=0.7,
        linestyle=(0, (1, 3)),
        zorder=2,
    )
    ends = [(panel.bottom, panel.bottom - LEADER + 2)]
    if pictures:
        ends.append((panel.top, panel.top + LEADER - 2))
    for near, far in ends:
        middle = (near + far) / 2
        axes.add_patch(
            PathPatch(
                Line(
                    [(x, near), (x, middle), (centre, middle), (centre, far)],
                    [Line.MOVETO, Line.CURVE4, Line.CURVE4, Line.CURVE4],
                ),
                fill=False,
                edgecolor=style.GUIDE,
                linewidth=0.9,
                zorder=2,
            )
        )
        axes.plot([x], [near], marker="o", markersize=3.4, color=style.FAINT, zorder=3)
    axes.text(
        centre,
        panel.bottom - LEADER - 9,
        f"frame {style.number(shown.frame)}",
        fontsize=9,
        color=style.TEXT,
        ha="center",
        va="center",
        bbox={"facecolor": style.PAGE, "linewidth": 0, "pad": 1.5},
        zorder=4,
    )


def _draw_picture(
    axes: Any, image: F32, centre: float, top: float, width: float, encoding: str
) -> None:
    height = width * image.shape[0] / image.shape[1]
    left, bottom = centre - width / 2, top - height
    axes.imshow(
        style.shown(image, encoding),
        extent=(left, left + width, bottom, top),
        aspect="auto",
        interpolation="auto",
        zorder=4,
    )


def save(figure: Any, path: Path, kind: str, width: int) -> None:
    """Write the figure as "png" (`width` pixels wide), "svg" or "pdf", without dates in it."""
    # A fraction of a pixel more, so that rounding does not lose the last column.
    dpi = (width + 0.01) / (WIDTH / 72)
    creator = f"palette4d {_core.__version__}"
    metadata: dict[str, dict[str, Any]] = {
        "png": {"Software": creator},
        "svg": {"Date": None, "Creator": creator},
        "pdf": {"CreationDate": None, "Creator": creator},
    }
    figure.savefig(path, format=kind, dpi=dpi, metadata=metadata[kind], facecolor=style.PAGE)
