"""The page: heading, frames before and after, the timeline, the polyhedra, and a legend."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.text import counted
from palette4d.grade.clip_colours import Share
from palette4d.plotting import polyhedron, style, timeline
from palette4d.plotting.rows import PlottedPalette, arrange, track_ids
from palette4d.plotting.solid import Shape, View, even_sample, extent_of

F32 = NDArray[np.float32]

#: The page's width in points; --width scales a PNG with the same proportions.
WIDTH = 1200.0
MARGIN = 28.0
GUTTER = 14.0
HEADER = 76.0
#: Space for the lines between the timeline and the frames above and below it.
LEADER = 30.0
#: Space for the frame number above a polyhedron and below a picture.
CAPTION = 18.0
#: Space for the notes at the bottom.
NOTE = 28.0
#: Space between the pictures before and after the edits.
GAP = 4.0


@dataclass(frozen=True)
class Column:
    """The page's content for one frame.

    Attributes
    ----------
    frame : float
        The time of the palette.
    shape : Shape
        The sliced palette; with the clip, also pixels.
    ids : tuple of str
        The tracks of its colours.
    pictures : tuple of (h, w, 3) float32
        The clip's frame at reduced size, and its recolouring if the sidecar has edits. Empty
        without the clip.
    """

    frame: float
    shape: Shape
    ids: tuple[str, ...]
    pictures: tuple[F32, ...] = ()


def column(
    sidecar: _core.Sidecar,
    frame: float,
    image: F32 | None,
    against: _core.Edits | None = None,
    *,
    width: int = 640,
    pixels: int = 4000,
) -> Column:
    """Slice the palette at a time and recolour the clip's frame there.

    Parameters
    ----------
    sidecar : Sidecar
        Palette and edits.
    frame : float
        The time.
    image : (h, w, 3) float32 or None
        Straight colours of the clip's frame, in the palette's colour space.
    against : Edits, optional
        Other edits, whose result stands in the place of the clip's colours.
    width : int
        Pictures are at least this wide, or as wide as a smaller clip, and less than twice as wide.
    pixels : int
        The polyhedron shows at most about this many pixels, evenly chosen.
    """
    palette = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, palette)
    rgb, faces = np.asarray(palette.rgb), np.asarray(palette.faces)
    if against is not None:
        rgb = np.asarray(_core.edited_colours(sidecar.polytope, against, palette))
    track_of = track_ids(sidecar.polytope)
    vertices, edges = sidecar.polytope.vertex_ids, sidecar.polytope.edge_ids
    ids = tuple(
        track_of[vertices[ends[0]] if edge < 0 else edges[edge]]
        for edge, ends in zip(palette.edges, palette.ends, strict=True)
    )
    if image is None:
        return Column(frame, Shape(rgb, np.asarray(edited), faces), ids)
    shape = Shape(rgb, np.asarray(edited), faces, even_sample(image, pixels))
    step = max(1, image.shape[1] // width)
    small = np.ascontiguousarray(image[::step, ::step], dtype=np.float32)

    def recoloured(edits: _core.Edits | None) -> F32:
        if edits is None or edits.empty:
            return small
        colours = _core.edited_colours(sidecar.polytope, edits, palette)
        picks = edits.picks_at(palette.frame)
        recolourer = _core.Recolourer(palette.rgb, colours, palette.faces, picks=picks)
        return recolourer.apply(small, threads=0, picture=True)

    if sidecar.edits.empty and against is None:
        return Column(frame, shape, ids, (small,))
    return Column(frame, shape, ids, (recoloured(against), recoloured(sidecar.edits)))


def build(
    sidecar: _core.Sidecar,
    columns: Sequence[Column],
    against: _core.Edits | None = None,
    named: Sequence[str] = ("before", "after"),
    colours: Mapping[str, str] | None = None,
    shares: Mapping[str, Share] | None = None,
) -> Any:
    """Lay out and draw the page; return a matplotlib Figure of `WIDTH` points.

    `colours` has the names of the handles' colours, `shares` those of the tracks, by id.
    """
    from matplotlib.figure import Figure

    palette = PlottedPalette.of(sidecar, against)
    encoding = str(sidecar.clip["encoding"])
    clip_rgb = np.asarray(sidecar.polytope.vertices).reshape(-1, 4)[:, :3]
    rows = arrange(palette.frames, clip_rgb, palette.edges)
    row_height = float(np.clip(1100.0 / max(rows.count, 1), 16.0, 50.0))
    panel = timeline.Panel(palette, rows, MARGIN, WIDTH - MARGIN, row_height)

    wide = (WIDTH - 2 * MARGIN + GUTTER) / max(len(columns), 1) - GUTTER
    shapes = [picture.shape for c in columns for picture in c.pictures]
    aspect = max((shape[0] / shape[1] for shape in shapes), default=0.0)
    picture_width = min(wide, 420.0, 260.0 / aspect if aspect else wide)
    picture_height = picture_width * aspect
    names = named if any(len(c.pictures) > 1 for c in columns) else ["clip"]
    pictures = len(names) * (picture_height + GAP) - 2 + LEADER + CAPTION if shapes else 0.0
    cube = min(wide * 0.96, 300.0)
    height = HEADER + pictures + panel.height + MARGIN
    height += LEADER + 46 + cube if columns else 0.0
    height += NOTE
    top = height - HEADER
    panel.top = top - pictures

    figure = Figure(figsize=(WIDTH / 72, height / 72), facecolor=style.PAGE)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, WIDTH), ylim=(0, height), autoscale_on=False)
    axes.set_axis_off()
    _draw_heading(axes, sidecar, palette, height)
    _draw_notes(axes, palette, bool(shares), columns)
    timeline.draw(axes, panel, encoding, colours or {}, shares or {})
    if shapes:
        for k, name in enumerate(names):
            y = top - (k + 0.5) * picture_height - GAP * k
            axes.text(MARGIN / 2 + 2, y, name, rotation=90, **style.CENTRED)
    extent = extent_of([c.shape for c in columns])
    for k, shown in enumerate(columns):
        centre = MARGIN + wide / 2 + k * (wide + GUTTER)
        _draw_leaders(axes, panel, shown.frame, centre, above=bool(shapes))
        for row, picture in enumerate(shown.pictures):
            upper = top - row * (picture_height + GAP)
            lower = upper - picture_width * picture.shape[0] / picture.shape[1]
            ends = (centre - picture_width / 2, centre + picture_width / 2, lower, upper)
            axes.imshow(style.shown(picture, encoding), extent=ends, aspect="auto", zorder=4)
        middle = panel.bottom - LEADER - 38 - cube / 2
        view = View.fit(extent, (centre, middle), cube)
        polyhedron.draw(axes, shown.shape, view, encoding, shown.ids)
    return figure


def _draw_heading(
    axes: Any, sidecar: _core.Sidecar, palette: PlottedPalette, height: float
) -> None:
    """Write the title, the facts below it, and the legend at its right."""
    from matplotlib.legend_handler import HandlerTuple

    clip = sidecar.clip
    numerator, denominator = clip["rate"]
    ends = dict.fromkeys((style.number(palette.first), style.number(palette.last)))
    blocks, edited = _blocks(palette), int(palette.changed.sum())
    encoding = str(clip["encoding"])
    facts = [
        f"frame{'s' if len(ends) > 1 else ''} {'–'.join(ends)}",
        f"{style.number(numerator / denominator)} fps",
        f"{clip['width']}×{clip['height']}",
        encoding if encoding != "unknown" else "encoding unknown, shown as sRGB",
        counted(len(palette.ids), "handle"),
        counted(blocks, "block") if blocks > 1 else "",
        f"{edited} edited" if edited else "",
        counted(len(palette.stops), "stop") if palette.stops else "",
    ]
    line = style.printable("   ·   ".join(fact for fact in facts if fact), 200)
    title = {"fontsize": 17, "fontweight": "bold", "color": style.BRIGHT, "va": "center"}
    axes.text(MARGIN, height - 30, style.printable(clip["name"], 48), **title)
    axes.text(MARGIN, height - 52, line, fontsize=8.5, color=style.FAINT, va="center")
    grey, light = np.full(3, 0.42), np.full(3, 0.78)
    entries = [("plain", 7.5, light, "handle: a palette colour at a frame")]
    if edited:
        entries.append(("edited", 7.5, grey, "edited: before above, after below"))
    if palette.stops:
        entries.append(("stop", 6.0, grey, "stop: a handle added by hand"))
    # Discs outside the page, which the legend copies.
    handles = [
        timeline.disc(axes, np.nan, np.nan, radius, np.stack([before, light]), kind, 5)
        for kind, radius, before, _ in entries
    ]
    legend = axes.legend(
        handles,
        [text for *_, text in entries],
        handler_map={tuple: HandlerTuple(ndivide=1)},
        loc="center right",
        bbox_to_anchor=(WIDTH - MARGIN, height - 30),
        bbox_transform=axes.transData,
        ncols=len(entries),
        fontsize=8.5,
        labelcolor=style.TEXT,
        frameon=False,
        borderpad=0,
        borderaxespad=0,
        handlelength=2,
        columnspacing=2.6,
    )
    legend.set_zorder(5)


def _draw_notes(
    axes: Any, palette: PlottedPalette, shares: bool, columns: Sequence[Column]
) -> None:
    """Say at the bottom of the page what its parts are."""
    rows = "A row: one palette colour through time; a scene's change may take it to another thing."
    if shares:
        rows += " Percentages: how much of the picture all its handles move, on average over its"
        rows += " frames and at most."
    if _blocks(palette) > 1:
        rows += " Block: frames in which no colour splits or merges."
    notes = [rows]
    if columns:
        solids = "Below the rows: the palette as a solid in the RGB cube (black below, white above)"
        if any(column.shape.pixels is not None for column in columns):
            solids += "; small points: the frame's pixels"
        solids += "; white lines: the solid's edges"
        if any((column.shape.rgb != column.shape.edited).any() for column in columns):
            solids += "; arrows and dashed lines: after the edits"
        notes.append(f"{solids}.")
    for k, note in enumerate(reversed(notes)):
        axes.text(MARGIN, MARGIN - 6 + 13 * k, note, fontsize=8.5, color=style.TEXT)


def _blocks(palette: PlottedPalette) -> int:
    return sum(not section["transition"] for section in palette.sections)


def _draw_leaders(
    axes: Any, panel: timeline.Panel, frame: float, centre: float, *, above: bool
) -> None:
    """Mark a frame on the timeline, with lines to its pictures and its polyhedron."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Line

    x = float(panel.x(frame))
    dotted = {"linewidth": 0.7, "linestyle": (0, (1, 3)), "zorder": 2}
    axes.plot([x, x], [panel.floor, panel.top], color=style.GUIDE, **dotted)
    caption = {**style.CENTRED, "fontsize": 9, "color": style.TEXT, "zorder": 4}
    for near, way in ((panel.bottom, -1), (panel.top, 1))[: 1 + above]:
        far = near + way * (LEADER - 2)
        middle = (near + far) / 2
        curve = [(x, near), (x, middle), (centre, middle), (centre, far)]
        line = Line(curve, [Line.MOVETO, *[Line.CURVE4] * 3])
        how = {"fill": False, "edgecolor": style.GUIDE, "linewidth": 0.9, "zorder": 2}
        axes.add_patch(PathPatch(line, **how))
        axes.plot([x], [near], marker="o", markersize=3.4, color=style.FAINT, zorder=3)
        axes.text(centre, far + way * CAPTION / 2, f"frame {style.number(frame)}", **caption)


def save(figure: Any, path: Path, kind: str, width: int) -> None:
    """Write the figure as "png" (`width` pixels wide), "svg" or "pdf", without dates in it."""
    # Add a fraction of a pixel, so that rounding does not lose the last column.
    dpi = (width + 0.01) / (WIDTH / 72)
    creator = f"palette4d {_core.__version__}"
    metadata: dict[str, dict[str, Any]] = {
        "png": {"Software": creator},
        "svg": {"Date": None, "Creator": creator},
        "pdf": {"CreationDate": None, "Creator": creator},
    }
    figure.savefig(path, format=kind, dpi=dpi, metadata=metadata[kind], facecolor=style.PAGE)
