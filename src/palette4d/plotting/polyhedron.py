"""A sliced polyhedral palette in the RGB cube, with the frame's pixels inside it, by matplotlib.

The drawing order is from far to near: cube, far faces and edges, pixels, near faces and edges,
palette colours.
"""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.plotting import style, timeline
from palette4d.plotting.layout import Disc, Kind, names_around
from palette4d.plotting.solid import CORNERS, CUBE, Shape, View, facing
from palette4d.plotting.timeline import disc

F64 = NDArray[np.float64]

#: The kinds and radii of discs, and the size of ids.
PLAIN: tuple[Kind, float] = ("plain", 5.0)
EDITED: tuple[Kind, float] = ("edited", 6.5)
ID_SIZE = 6.5


def draw(axes: Any, shape: Shape, view: View, encoding: str, ids: Sequence[str] = ()) -> None:
    """Draw one polyhedron; `ids` are those of its colours' tracks."""
    from matplotlib.collections import LineCollection, TriMesh
    from matplotlib.tri import Triangulation

    letters = _draw_cube(axes, view)
    seen = view.project(shape.rgb)
    points, faces = seen[:, :2], shape.faces
    towards = facing(points, faces)
    colours = style.shown(shape.rgb, encoding)
    for side, alpha, zorder in ((~towards, 0.20, 4.0), (towards, 0.13, 6.0)):
        if side.any():
            gradient = TriMesh(
                Triangulation(points[:, 0], points[:, 1], faces[side]), rasterized=True
            )
            gradient.set(facecolor=np.insert(colours, 3, alpha, axis=1), zorder=zorder)
            axes.add_collection(gradient, autolim=False)

    edges = [tuple(edge) for edge in shape.edges.tolist()]
    corners = [set(face) for face in faces[towards].tolist()]
    near = {edge for edge in edges if not len(faces) or any(set(edge) <= c for c in corners)}
    edge_styles = ((style.GUIDE, 0.7, 4.5), (style.TEXT, 1.0, 7.0))
    for edge in edges:
        colour, width, zorder = edge_styles[edge in near]
        axes.plot(*points[list(edge)].T, color=colour, linewidth=width, zorder=zorder)

    if shape.pixels is not None and len(shape.pixels):
        cloud = view.project(shape.pixels)
        order = np.argsort(cloud[:, 2], kind="stable")
        at, seen_as = cloud[order], style.shown(shape.pixels[order], encoding)
        axes.scatter(*at[:, :2].T, s=1.6, c=seen_as, linewidths=0, zorder=5, rasterized=True)

    # Edited colours: an arrow to each, and dashed edges.
    after = view.project(shape.edited)[:, :2]
    moved = np.flatnonzero((shape.rgb != shape.edited).any(axis=1)).tolist()
    dashed = [after[list(edge)] for edge in edges if set(edge) & set(moved)]
    outline = LineCollection(dashed, colors=style.BRIGHT, linewidths=0.8, zorder=7.5)
    outline.set(linestyle=(0, (3, 2.4)), alpha=0.75)
    axes.add_collection(outline, autolim=False)
    arrow: dict[str, Any] = {
        "arrowstyle": "-|>,head_width=0.28,head_length=0.5",
        "color": style.BRIGHT,
    }
    arrow |= {"linewidth": 1.2, "shrinkA": 6, "shrinkB": 0}
    for index in moved:
        axes.annotate("", xy=after[index], xytext=points[index], arrowprops=arrow, zorder=8)
    before_and_after = np.stack([colours, style.shown(shape.edited, encoding)], axis=1)
    for index in np.argsort(seen[:, 2], kind="stable"):
        kind, radius = EDITED if index in moved else PLAIN
        x, y = points[index].tolist()
        disc(axes, x, y, radius, before_and_after[index], kind, 9)
    _draw_ids(axes, points, shape, set(moved), ids, letters)


def _draw_ids(
    axes: Any,
    points: F64,
    shape: Shape,
    moved: set[int],
    ids: Sequence[str],
    letters: Sequence[tuple[float, float]],
) -> None:
    discs = []
    for index, (id_, (x, y)) in enumerate(zip(ids, points.tolist(), strict=False)):
        kind, radius = EDITED if index in moved else PLAIN
        colours = shape.rgb[index], shape.edited[index]
        # In a layout y is down.
        discs.append(Disc(style.printable(id_, 14), kind, 0.0, -1, x, -y, radius, x, *colours))
    taken = [(x - 4, -y - 4, x + 4, -y + 4) for x, y in letters]
    width = functools.partial(timeline.text_width, size=ID_SIZE)
    for name, named in names_around(discs, ID_SIZE, width, taken):
        # The id covers the line's other half.
        line = {"color": style.GUIDE, "linewidth": 0.6, "zorder": 8.9}
        axes.plot([named.x, name.x], [-named.y, -name.y], **line)
        timeline.draw_id(axes, name, -name.y, ID_SIZE, style.PAGE)


def _draw_cube(axes: Any, view: View) -> list[tuple[float, float]]:
    """Draw the RGB cube; return the places of the letters at its corners."""
    corners = view.project(CORNERS)
    farthest = int(np.argmin(corners[:, 2]))
    for ends in CUBE:
        hidden = farthest in ends
        how = {"color": style.LINE, "linestyle": (0, (2, 3))} if hidden else {}
        line = {"color": style.GUIDE, "linewidth": 0.6, "zorder": 3, **how}
        axes.plot(*corners[list(ends), :2].T, **line)
    places = []
    for bit, name in ((1, "R"), (2, "G"), (4, "B")):
        away = corners[bit, :2] - corners[0, :2]
        place = corners[bit, :2] + 9 * away / max(float(np.linalg.norm(away)), 1e-9)
        axes.text(*place, name, zorder=8, **style.CENTRED | {"fontsize": 7.5, "color": style.TEXT})
        places.append((float(place[0]), float(place[1])))
    return places
