"""Where things of the timeline are: frames, rows, handles and ranges, and what a point hits.

It draws nothing. Input: a session, the view's size, zoom and scroll. It uses the layout of
`palette4d.plotting.layout`, as `palette4d plot` does.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from PySide6.QtCore import QPointF

from palette4d.grade.picks import Pick
from palette4d.plotting.layout import BAND, COLLAR, Disc, Scale, Timeline
from palette4d.plotting.rows import PlottedPalette, Rows, arrange
from palette4d.studio import paint
from palette4d.studio.session import Session

#: The column of colours at the left, the ruler, the frame strip, and the zoom bar, in pixels.
GUTTER, RULER, STRIP, FOOT = 84, 24, 46, 12
#: Below this height of the timeline its rows have the strip's place.
NO_STRIP = 220
#: The height of a pick's range, that of more than two above each other, and the most of these.
LANE, THIN_LANE, MOST_LANES = 13, 7, 5
#: Space for the block names above the rows, below them, and beside the first and last frame.
HEAD, TAIL, SIDE = 24.0, 10.0, 40.0
#: The same space where there is one block, whose name says nothing.
LOW_HEAD = 13.0
#: The heights of a row, and the largest radius of a disc, in rows. Ten of the lowest rows fit below
#: five picks in a window of 1000x600.
LOWEST, HIGHEST, RADIUS = 9.0, 46.0, 0.27
#: Rows of this height leave room for the ranges of many picks.
ROOMY = 30.0
#: How many times as high rows can be made on demand.
TALLEST = 6.0
#: The fewest frames that fill the width.
CLOSEST = 4.0


@dataclass(frozen=True)
class Hit:
    """What is under the pointer.

    Attributes
    ----------
    what : str
    id : str
        The handle of a disc, the edge of a band, the id of a pick.
    stop : bool
        The disc is a stop.
    grip : str
        The end of a pick's range: "start" or "until"; or of its fade: "fade in", "fade out".
    """

    what: Literal["ruler", "lane", "pick", "gutter", "disc", "band", "zoom", "scroll", "ground"]
    id: str = ""
    stop: bool = False
    grip: str = ""


class Places:
    """The places in a timeline of this size.

    Parameters
    ----------
    session : Session
    size : callable
        Returns the view's width and height in pixels.

    Attributes
    ----------
    revision : int
        The session's revision that is shown; while something is dragged it may be older.
    zoomed : (float, float) or None
        The frames that the width shows; None: the clip.
    scroll : float
        Pixels that the rows are scrolled by.
    tall : float
        Rows are so many times as high as the room asks for.
    dragged : (str, float, float, float, float) or None
        A pick whose range is being dragged: start, until, and the fades before and after.
    """

    def __init__(self, session: Session, size: Callable[[], tuple[int, int]]) -> None:
        """Show the whole clip."""
        self.session, self._size = session, size
        self.revision = session.revision
        self.zoomed: tuple[float, float] | None = None
        self.scroll = 0.0
        self.tall = 1.0
        self.dragged: tuple[str, float, float, float, float] | None = None
        self._palette: tuple[object, PlottedPalette, Rows] | None = None
        self._layout: tuple[object, Timeline, list[Disc]] | None = None
        self._lanes: tuple[int, list[tuple[Pick, int]]] | None = None

    @property
    def width(self) -> int:
        """The view's width."""
        return self._size()[0]

    @property
    def height(self) -> int:
        """The view's height."""
        return self._size()[1]

    @property
    def strip(self) -> int:
        """The height of the frame strip."""
        return STRIP if self.height >= NO_STRIP else 0

    @property
    def rows(self) -> Rows | None:
        """The rows of the palette."""
        return None if self.content is None or self._palette is None else self._palette[2]

    @property
    def key(self) -> object:
        """Changes with the layout."""
        return self._layout and self._layout[0]

    # ------------------------------------------------------------------------------------- layout

    @property
    def content(self) -> PlottedPalette | None:
        """The palette through time."""
        document, key = self.session.document, self.revision
        if document is None:
            return None
        if self._palette is None or self._palette[0] != key:
            palette = PlottedPalette.of(document.grade.core)
            old = self._palette
            if old is not None and old[1].edges == palette.edges and old[1].ids == palette.ids:
                rows = old[2]  # the rows depend on the clip's palette alone, not on edits
            else:
                rows = arrange(palette.frames, palette.rgb, palette.edges)
            self._palette = key, palette, rows
        return self._palette[1]

    @property
    def span(self) -> tuple[float, float]:
        """The first and last frame that the width shows."""
        first, last, _ = self.session.frames
        return self.zoomed or (float(first), float(last))

    @property
    def scale(self) -> Scale:
        """The x of the clip's frames; it reaches beyond the widget when zoomed."""
        first, last, _ = self.session.frames
        start, end = self.span
        left, right = GUTTER + SIDE, max(self.width - SIDE, GUTTER + SIDE + 1)
        if last <= first:
            return Scale(first, last, left, right)
        per_frame = (right - left) / max(end - start, 1e-9)
        begin = left - (start - first) * per_frame
        return Scale(first, last, begin, begin + (last - first) * per_frame)

    @property
    def timeline(self) -> tuple[Timeline, list[Disc]] | None:
        """The places of rows and discs; y is 0 at the first row's top."""
        palette = self.content
        if palette is None or self._palette is None:
            return None
        rows = self._palette[2]
        usual = float(np.clip(self.room / max(rows.count, 1), LOWEST, HIGHEST))
        height = usual * self.tall
        scale = self.scale
        key = (self._palette[0], scale, height)
        if self._layout is None or self._layout[0] != key:
            layout = Timeline(palette, rows, scale, height, RADIUS / self.tall)
            old = None if self._layout is None else self._layout[1]
            if (
                old is not None
                and old.rows is rows
                and (old.scale, old.row_height) == (scale, height)
            ):
                vars(layout)["paths"] = old.paths  # they do not depend on the edits
            discs = layout.discs(scale.left - SIDE + 4, scale.right + SIDE - 4)
            self._layout = key, layout, discs
        return self._layout[1], self._layout[2]

    @property
    def upper(self) -> float:
        """The y below the frame strip and the ranges of the picks."""
        lanes = self._lane_count
        return RULER + self.strip + (lanes * self.lane_height + 4 if lanes else 0)

    @property
    def _lane_count(self) -> int:
        return max((lane for _, lane in self.lanes()), default=-1) + 1

    @property
    def lane_height(self) -> int:
        """The height of a pick's range."""
        count = 0 if self.content is None or self._palette is None else self._palette[2].count
        left = self.height - RULER - self.strip - HEAD - TAIL - FOOT - self._lane_count * LANE
        return LANE if self._lane_count <= 2 or left >= count * ROOMY else THIN_LANE

    @property
    def head(self) -> float:
        """The height above the rows: for the names of blocks, or of the first row's discs."""
        content = self.content
        return LOW_HEAD if content is None or len(content.sections) < 2 else HEAD

    def lanes(self) -> list[tuple[Pick, int]]:
        """Return the picks and holds with the lanes of their ranges, in the list's order.

        Each has a lane of its own; those beyond the last lane share it.
        """
        document = self.session.document
        if document is None:
            return []
        if self._lanes is None or self._lanes[0] != self.session.revision:
            picks = enumerate(document.grade.picks)
            placed = [(pick, min(k, MOST_LANES - 1)) for k, pick in picks]
            self._lanes = self.session.revision, placed
        return self._lanes[1]

    def reach(self, pick: Pick) -> tuple[float, float, float, float]:
        """Return where a pick begins to act, acts fully, no longer fully, and no more."""
        first, last, _ = self.session.frames
        start = float(first if pick.start is None else pick.start)
        until = float(last if pick.until is None else pick.until)
        before, after = pick.fades
        if self.dragged is not None and self.dragged[0] == pick.id:
            _, start, until, before, after = self.dragged
        return max(start - before, first), start, until, min(until + after, last)

    def lane_y(self, lane: int) -> float:
        """Return the middle of a lane."""
        return RULER + self.strip + 4 + (lane + 0.5) * self.lane_height

    def _hit_lane(self, at: QPointF) -> Hit:
        """Return the pick at a point, and which end of its range or of its fades."""
        found = Hit("lane")
        for pick, lane in self.lanes():
            begin, start, until, end = (self.x_of(t) for t in self.reach(pick))
            if (
                abs(at.y() - self.lane_y(lane)) > self.lane_height / 2
                or not begin - 7 <= at.x() <= end + 7
            ):
                continue
            ends = {"start": start, "until": until, "fade in": begin, "fade out": end}
            grip = min(ends, key=lambda name: abs(at.x() - ends[name]))  # of equals the range's
            found = Hit("pick", pick.id, grip=grip if abs(at.x() - ends[grip]) <= 7 else "")
        return found

    @property
    def room(self) -> float:
        """The height that rows can have."""
        return self.height - self.upper - self.head - TAIL - FOOT

    @property
    def hidden(self) -> float:
        """The height of rows that there is no room for."""
        found = self.timeline
        return 0.0 if found is None else max(0.0, found[0].height - self.room)

    @property
    def top(self) -> float:
        """The widget's y of the first row's top."""
        self.scroll = min(max(self.scroll, 0.0), self.hidden)
        return self.upper + self.head - self.scroll

    def frame_at(self, x: float, *, snap: bool = True) -> float:
        """Return the time at an x; snapped to the clip's frames."""
        first, last, step = self.session.frames
        time = float(self.scale.frame(x))
        return float(min(first + round((time - first) / step) * step, last)) if snap else time

    def x_of(self, frame: float) -> float:
        """Return the x of a time."""
        return float(self.scale.x(frame))

    def hit(self, at: QPointF) -> Hit:
        """Return what is at a point."""
        if at.y() < RULER + self.strip:
            return Hit("ruler")
        if at.y() < self.upper:
            return self._hit_lane(at)
        if at.y() >= self.height - FOOT:
            return Hit("zoom")
        found = self.timeline
        if found is None:
            return Hit("ground")
        if at.x() >= self.width - FOOT and self.hidden:
            return Hit("scroll")
        layout, discs = found
        y = at.y() - self.top
        if at.x() < GUTTER:
            edge = self.edge_now(y)
            return Hit("gutter", "" if edge is None else layout.palette.edge_ids[edge])
        reached = [
            (away, disc)
            for disc in discs
            if (away := float(np.hypot(disc.x - at.x(), disc.y - y)))
            <= max(disc.radius + COLLAR, paint.REACH)
        ]
        if reached:
            disc = min(reached, key=lambda pair: pair[0])[1]
            return Hit("disc", disc.id, disc.kind == "stop")
        band = layout.edge_near(at.x(), y, max(BAND * layout.row_height + 1, paint.REACH))
        if band is not None:
            return Hit("band", layout.palette.edge_ids[band])
        return Hit("ground")

    def edge_now(self, y: float) -> int | None:
        """Return the edge at the playhead in the row at a y."""
        found = self.timeline
        if found is None:
            return None
        layout = found[0]
        return layout.edge_near(self.x_of(self.session.frame), y, layout.row_height / 2)

    # ------------------------------------------------------------------------------ zoom and pan

    def show(self, start: float, wide: float) -> None:
        """Show so many frames from a time on."""
        first, last, _ = self.session.frames
        whole = float(last - first)
        if wide >= whole:
            self.zoomed = None
        else:
            start = min(max(start, first), last - wide)
            self.zoomed = (start, start + wide)

    def zoom(self, factor: float, at: float | None = None) -> None:
        """Show `factor` times as many frames; the frame at x (default: the playhead) stays."""
        first, last, _ = self.session.frames
        start, end = self.span
        fixed = self.session.frame if at is None else float(self.scale.frame(at))
        fixed = min(max(fixed, start), end)
        wide = float(np.clip((end - start) * factor, min(CLOSEST, last - first), last - first))
        share = (fixed - start) / max(end - start, 1e-9)
        self.show(fixed - share * wide, wide)

    def show_all(self) -> None:
        """Show the whole clip."""
        self.zoomed = None

    def make_taller(self, factor: float) -> None:
        """Make rows so many times as high; the row in the middle stays there."""
        before, middle = self.tall, self.scroll + self.room / 2
        self.tall = min(max(self.tall * factor, 1.0), TALLEST)
        self.scroll = middle * self.tall / before - self.room / 2

    # ------------------------------------------------------------------------------------ handles

    def point_of(self, id_: str) -> QPointF | None:
        """Return where a handle, a palette colour or a pick is; None if it is not shown."""
        disc, row = self.disc(id_), self.row_of(id_)
        if disc is not None:
            return QPointF(disc.x, disc.y + self.top)
        for pick, lane in self.lanes():
            if pick.id == id_:
                return QPointF(self.x_of(pick.frame), self.lane_y(lane))
        if row is None or self.timeline is None:
            return None
        tall = self.timeline[0].row_height
        return QPointF(self.x_of(self.session.frame), self.top + (row + 0.5) * tall)

    def disc(self, id_: str) -> Disc | None:
        """Return the disc of a handle."""
        found = self.timeline
        discs = [] if found is None else found[1]
        return next((disc for disc in discs if disc.id == id_), None)

    def place_for(self, id_: str, frame: float) -> float | None:
        """Return the time nearest to a wanted one that a stop can have; None: it stays."""
        content, document = self.content, self.session.document
        if content is None or document is None:
            return None
        stop = next((stop for stop in content.stops if stop[0] == id_), None)
        if stop is None:
            return None
        first, _, step = self.session.frames
        start, end = (float(t) for t in content.frames[list(content.edges[stop[1]])])
        low = first + (np.floor((start - first) / step) + 1) * step
        high = first + (np.ceil((end - first) / step) - 1) * step
        if float(frame).is_integer() and low <= high:
            frame = float(min(max(frame, low), high))
        else:
            room = 1e-3 * (end - start)
            frame = float(np.clip(frame, start + room, end - room))
        edge = stop[1]
        taken = [other[2] for other in content.stops if other[1] == edge and other[0] != id_]
        return None if frame in taken else frame

    def row_of(self, id_: str) -> int | None:
        """Return the row of a handle or an edge."""
        content = self.content
        if content is None or self._palette is None:
            return None
        rows = self._palette[2]
        if id_ in content.ids:
            return int(rows.row[rows.vertex_chain[content.ids.index(id_)]])
        stops = {stop[0]: stop[1] for stop in content.stops}
        edge = stops.get(id_)
        if id_ in content.edge_ids:
            edge = content.edge_ids.index(id_)
        return None if edge is None else int(rows.row[rows.edge_chain[edge]])

    def selected_row(self) -> int | None:
        """Return the row of the first selected handle."""
        return self.row_of(self.session.selection[0]) if self.session.selection else None

    def edges_of_row(self, row: int) -> list[int]:
        """Return the edges of a row."""
        assert self._palette is not None
        rows = self._palette[2]
        return np.flatnonzero(rows.row[rows.edge_chain] == row).tolist()

    @staticmethod
    def edges_at(layout: Timeline, x: float) -> list[tuple[int, float]]:
        """Return the edges at an x and the middles of their rows; one for each row."""
        chosen: dict[float, int] = {}
        for edge, (_, points) in layout.paths.items():
            if points[0, 0] - 1e-6 <= x <= points[-1, 0] + 1e-6:
                chosen[float(layout.edge_y[edge])] = edge
        return [(edge, y) for y, edge in chosen.items()]
