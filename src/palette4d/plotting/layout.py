"""The timeline as plain numbers: rows, bands, forks, discs, block names and ticks.

`palette4d plot` and the window draw the same layout. The unit is the drawing's own (points or
pixels). x is right. y is down; 0 is the top of the first row.
"""

import collections
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.plotting.rows import PlottedPalette, Rows
from palette4d.plotting.style import number

F64 = NDArray[np.float64]
#: left, top, right, bottom.
Box = tuple[float, float, float, float]
Kind = Literal["plain", "edited", "stop"]

#: Length of the pieces of a band: short enough for a smooth gradient.
PIECE = 2.5
#: Space around a disc beyond its radius, for the dark rim or a stop's second ring.
COLLAR = 2.6
#: Half the width of a band, and the largest radius of a vertex, in rows.
BAND, RADIUS = 0.17, 0.33
#: Ids around a disc are tried in so many directions, at so many distances.
DIRECTIONS, RINGS = 16, 4
#: The radius of a stop, in radii of a vertex.
STOP = 0.66


@dataclass(frozen=True)
class Scale:
    """The x of frames: `first` is at `left`, `last` at `right`; one frame alone is in the middle.

    The window's scale may reach beyond what is seen: `left` is then negative.
    """

    first: float
    last: float
    left: float
    right: float

    def x(self, frame: ArrayLike) -> Any:
        """Return the x of frame numbers."""
        if self.last <= self.first:
            return np.full(np.shape(frame), (self.left + self.right) / 2)
        share = (np.asarray(frame, dtype=np.float64) - self.first) / (self.last - self.first)
        return self.left + share * (self.right - self.left)

    def frame(self, x: ArrayLike) -> Any:
        """Return the frame numbers at x, within the clip."""
        if self.last <= self.first:
            return np.full(np.shape(x), self.first)
        share = (np.asarray(x, dtype=np.float64) - self.left) / (self.right - self.left)
        return self.first + np.clip(share, 0, 1) * (self.last - self.first)

    @property
    def per_frame(self) -> float:
        """The distance of two frames in x."""
        return (self.right - self.left) / max(self.last - self.first, 1e-9)

    def ticks(self, low: float, high: float, apart: float = 70.0) -> list[float]:
        """Return the frames to name between two x: the clip's ends, and round numbers."""
        first, last = self.first, self.last
        start, end = (float(self.frame(x)) for x in (low, high))
        if last <= first or end <= start:
            return [first]
        least = (end - start) / max(2, int((high - low) / apart))
        step = next(n * 10**k for k in range(9) for n in (1, 2, 5) if n * 10**k >= least)
        inner = np.arange(np.ceil(start / step) * step, end + step / 2, step)
        # No round number close to the clip's ends, which are always named.
        near = 0.55 * apart / self.per_frame
        kept = inner[(inner - first > near) & (last - inner > near)].tolist()
        return sorted(t for t in {first, *kept, last} if start <= t <= end)


@dataclass(frozen=True)
class Disc:
    """A vertex or a stop.

    Attributes
    ----------
    id, kind, frame
        The handle; "edited" is a vertex with a new colour.
    edge : int
        The edge of a stop; -1 for a vertex.
    x, y, radius : float
        Its place; discs of a row do not overlap.
    home : float
        The x of its frame; `x` differs where discs are too close.
    before, after : (3,) float64
        Colours without and with the edits.
    """

    id: str
    kind: Kind
    frame: float
    edge: int
    x: float
    y: float
    radius: float
    home: float
    before: F64
    after: F64


@dataclass(frozen=True)
class Label:
    """Text centred at a point."""

    text: str
    x: float
    y: float
    bright: bool = False


@dataclass(frozen=True)
class Section:
    """A block (numbered from 1) or a transition (0), from `left` to `right`."""

    left: float
    right: float
    number: int


@dataclass(frozen=True)
class Timeline:
    """The places of a palette's rows, bands and discs.

    Attributes
    ----------
    palette, rows, scale
        The content, its rows and its times.
    row_height : float
        The height of a row.
    radius : float
        The largest radius of a vertex, in rows.
    """

    palette: PlottedPalette
    rows: Rows
    scale: Scale
    row_height: float
    radius: float = RADIUS

    @property
    def height(self) -> float:
        """The height of all rows."""
        return self.rows.count * self.row_height

    @cached_property
    def vertex_y(self) -> F64:
        """The y of each vertex, (n,)."""
        return self._middle(self.rows.row[self.rows.vertex_chain])

    @cached_property
    def edge_y(self) -> F64:
        """The y of the row of each edge, (m,)."""
        return self._middle(self.rows.row[self.rows.edge_chain])

    def _middle(self, row: NDArray[np.int64]) -> F64:
        return (row.astype(np.float64) + 0.5) * self.row_height

    @cached_property
    def paths(self) -> dict[int, tuple[F64, F64]]:
        """The (k,) times and (k, 2) points of the middle line of every edge, in drawing order.

        Forks come first: a row's own band covers the bands that leave and join it.
        """
        forks = [
            bool((self.vertex_y[list(ends)] != y).any())
            for ends, y in zip(self.palette.edges, self.edge_y, strict=True)
        ]
        order = sorted(range(len(forks)), key=lambda edge: not forks[edge])
        return {edge: self._path(edge) for edge in order}

    def _path(self, edge: int) -> tuple[F64, F64]:
        start, end = self.palette.edges[edge]
        times = self.palette.frames[[start, end]]
        row_y = float(self.edge_y[edge])
        x0, x1 = (float(x) for x in self.scale.x(times))
        rise, fall = float(self.vertex_y[start]) - row_y, float(self.vertex_y[end]) - row_y
        length = x1 - x0
        pieces = int(np.clip((length + abs(rise) + abs(fall)) / PIECE, 2, 600))
        x = np.linspace(x0, x1, 4 * pieces + 1)
        y = np.full_like(x, row_y)
        for height, away in ((rise, x - x0), (fall, x1 - x)):
            if height:
                reach = min(length / 2 if rise and fall else length, max(1.3 * abs(height), 36.0))
                u = np.clip(1 - away / max(reach, 1e-9), 0, 1)
                y += height * u * u * (3 - 2 * u)
        # Equal steps along the line, not along time: finer where the line is steep.
        along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        spread = np.linspace(0, along[-1], len(x) // 4 + 1)
        points = np.stack([np.interp(spread, along, x), np.interp(spread, along, y)], axis=-1)
        return np.interp(spread, along, np.linspace(times[0], times[1], len(x))), points

    def at(self, edge: int, frame: float) -> tuple[float, float]:
        """Return the point of an edge at a time."""
        times, points = self.paths[edge]
        return float(np.interp(frame, times, points[:, 0])), float(
            np.interp(frame, times, points[:, 1])
        )

    def edge_near(self, x: float, y: float, reach: float) -> int | None:
        """Return the edge whose band is nearest to a point, within `reach` up and down."""
        nearest, least = None, reach
        for edge, (_, points) in self.paths.items():
            if points[0, 0] <= x <= points[-1, 0]:
                away = abs(float(np.interp(x, points[:, 0], points[:, 1])) - y)
                if away <= least:
                    nearest, least = edge, away
        return nearest

    def discs(self, low: float, high: float) -> list[Disc]:
        """Return the vertices and then the stops; of more stops than units of width, some.

        Parameters
        ----------
        low, high : float
            The smallest and largest x that discs may cover.
        """
        palette = self.palette
        stops = palette.stops
        places = [self.at(edge, when) for _, edge, when, _ in stops]
        if len(stops) > high - low:  # nobody can tell these apart: one of each edge and unit
            first = {(stop[1], round(places[k][0])): k for k, stop in enumerate(stops)}
            stops, places = [stops[k] for k in first.values()], [places[k] for k in first.values()]
        stop_xy = np.array(places).reshape(-1, 2)
        home = np.concatenate([self.scale.x(palette.frames), stop_xy[:, 0]])
        y = np.concatenate([self.vertex_y, stop_xy[:, 1]])
        largest = self.radius * self.row_height
        counts = [len(palette.ids), len(stops)]
        x, radius = place(np.repeat([largest, STOP * largest], counts), home, y, low, high)
        kinds: list[Kind] = ["edited" if changed else "plain" for changed in palette.changed]
        kinds += ["stop"] * len(stops)
        before = [*palette.rgb]
        for _, edge, when, _ in stops:
            before.append(palette.colours(edge, np.array([when]), edited=False)[0])
        after = [*palette.edited, *(stop[3] for stop in stops)]
        ids = [*palette.ids, *(stop[0] for stop in stops)]
        frames = [*palette.frames, *(stop[2] for stop in stops)]
        edges = [-1] * counts[0] + [stop[1] for stop in stops]
        return [
            Disc(
                ids[k],
                kinds[k],
                float(frames[k]),
                edges[k],
                x=float(x[k]),
                y=float(y[k]),
                radius=float(radius[k]),
                home=float(home[k]),
                before=before[k],
                after=after[k],
            )
            for k in range(len(ids))
        ]

    def sections(self) -> list[Section]:
        """Return the blocks and transitions."""
        result, count = [], 0
        for section in self.palette.sections:
            left, right = (float(x) for x in self.scale.x([section["first"], section["last"]]))
            count += not section["transition"]
            result.append(Section(left, right, 0 if section["transition"] else count))
        return result

    def block_names(self, y: float, width: Callable[[str], float]) -> list[Label]:
        """Return the longest name of each block that fits; blocks without space have none.

        Parameters
        ----------
        y : float
            The middle of the text.
        width : callable
            The width of a text.
        """
        blocks = [section for section in self.palette.sections if not section["transition"]]
        places = [section for section in self.sections() if section.number]
        labels, taken = [], -np.inf
        for block, there in zip(blocks, places, strict=True):
            ends = dict.fromkeys((number(block["first"]), number(block["last"])))
            name, middle = f"block {there.number}", (there.left + there.right) / 2
            for text in (f"{name}   {'–'.join(ends)}", name, f"{there.number}"):
                half = width(text) / 2 + 4
                alone = there.left == there.right or text == f"{there.number}"
                if (2 * half <= there.right - there.left or alone) and middle - half >= taken:
                    labels.append(Label(text, middle, y))
                    taken = middle + half
                    break
        return labels


def half_bands(points: F64, half: float) -> tuple[F64, F64]:
    """Return the (k, 2) upper and lower side of a band around a middle line."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    across = np.stack([tangent[:, 1], -tangent[:, 0]], axis=-1) * half
    return points + across, points - across


def place(largest: F64, x: F64, y: F64, low: float, high: float) -> tuple[F64, F64]:
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
    order = np.lexsort((x, y))
    in_rows = np.split(order, np.flatnonzero(np.diff(y[order])) + 1)
    radius, placed = largest.copy(), x.copy()
    for row in in_rows:
        each = (high - low) / max(len(row), 1)
        least = np.minimum(0.5 * largest[row], max(1.6, each / 2 - COLLAR))
        room = np.diff(x[row]) / 2 - COLLAR
        for side, bound in ((row[:-1], least[:-1]), (row[1:], least[1:])):
            radius[side] = np.minimum(radius[side], np.maximum(room, bound))
    # Similar sizes: size has no meaning here.
    if radius.size:
        radius = np.minimum(radius, 1.5 * np.median(radius))
    for row in in_rows:
        reach = radius[row] + COLLAR
        gaps = reach[:-1] + reach[1:]
        inside = row.size and low + reach[0] <= x[row[0]] and x[row[-1]] <= high - reach[-1]
        if inside and (np.diff(x[row]) >= gaps).all():
            continue
        placed[row] = _apart(x[row], reach, gaps, low, high)
    return placed, radius


def _apart(x: F64, reach: F64, gaps: F64, low: float, high: float) -> F64:
    """Return the nearest places with these distances: least squares with a fixed order."""
    from scipy.optimize import isotonic_regression

    if not x.size:
        return x
    apart = np.concatenate([[0.0], np.cumsum(gaps)])
    apart *= min(1.0, (high - low - reach[0] - reach[-1]) / max(apart[-1], 1e-9))
    free: F64 = isotonic_regression(x - apart).x
    kept: F64 = np.clip(free, low + reach[0], high - reach[-1] - apart[-1]) + apart
    return kept


def disc_names(
    discs: Sequence[Disc],
    size: float,
    width: Callable[[str], float],
    bottom: float,
    shorten: Callable[[str], str] = str,
    collar: float = COLLAR,
    beside: tuple[float, float, float] | None = None,
    longer: Mapping[str, str] | None = None,
    ends: tuple[float, float] = (-np.inf, np.inf),
) -> list[Label]:
    """Return the ids above or below their discs, edited ids first; ids without space are left out.

    Parameters
    ----------
    discs : sequence of Disc
        What is drawn; names do not cover any of them.
    size : float
        The height of the text.
    width : callable
        The width of a text.
    bottom : float
        No name reaches below this y.
    shorten : callable
        Returns the text to draw for an id.
    collar : float
        Space that a disc takes beyond its radius.
    beside : (float, float, float), optional
        The x of the first and last frame, and the space beyond them, where ids may be too.
    longer : mapping of str to str, optional
        What to write after an id where there is still space.
    ends : (float, float)
        The smallest and largest x of these longer texts.
    """
    tall = 0.95 * size

    def boxed(text: str, x: float, y: float) -> Box:
        half = width(text) / 2
        return (x - half, y - tall / 2, x + half, y + tall / 2)

    # What is drawn, by columns of the text's height: a box is compared with few others.
    columns: dict[int, dict[tuple[str, str], Box]] = collections.defaultdict(dict)

    def across(box: Box) -> range:
        return range(int(box[0] // tall), int(box[2] // tall) + 1)

    def take(kind: str, id_: str, box: Box) -> None:
        for column in across(box):
            columns[column][kind, id_] = box

    def free(box: Box, own: str = "") -> bool:
        return box[3] < bottom and not any(
            meet(box, other)
            for column in across(box)
            for key, other in columns[column].items()
            if key != ("name", own)
        )

    for disc in discs:
        reach = disc.radius + collar
        box = (disc.x - reach, disc.y - reach, disc.x + reach, disc.y + reach)
        take("disc", disc.id, box)
    labels: dict[str, Label] = {}
    order = sorted(discs, key=lambda disc: disc.kind == "plain")
    for disc in order:
        text, away = shorten(disc.id), disc.radius + collar + 0.5
        half = width(text) / 2
        places = [(disc.x, disc.y + side * (away + tall / 2)) for side in (-1, 1)]
        if beside is not None and disc.home in beside[:2] and away + 2 * half <= beside[2]:
            way = -1 if disc.home == beside[0] else 1
            places.insert(0, (disc.x + way * (away + half), disc.y))
        free_places = (place for place in places if free(boxed(text, *place)))
        for x, y in itertools.islice(free_places, 1):
            take("name", disc.id, boxed(text, x, y))
            labels[disc.id] = Label(text, x, y, disc.kind != "plain")
    for disc in order if longer else ():
        if disc.id not in labels or disc.id not in (longer or {}):
            continue
        text, away = f"{labels[disc.id].text} {(longer or {})[disc.id]}", disc.radius + collar + 0.5
        shift = width(text) / 2 - disc.radius
        for side, way in itertools.product((-1, 1), (0, 1, -1)):
            x, y = disc.x + way * shift, disc.y + side * (away + tall / 2)
            box = boxed(text, x, y)
            if ends[0] <= box[0] and box[2] <= ends[1] and free(box, disc.id):
                for column in columns.values():
                    column.pop(("name", disc.id), None)
                take("name", disc.id, box)
                labels[disc.id] = Label(text, x, y, disc.kind != "plain")
                break
    return list(labels.values())


def names_around(
    discs: Sequence[Disc],
    size: float,
    width: Callable[[str], float],
    taken: Iterable[Box] = (),
) -> list[tuple[Label, Disc]]:
    """Return the ids beside their discs, away from the middle of all; farther where it is tight.

    Parameters
    ----------
    discs : sequence of Disc
        What is drawn; names cover neither these nor each other. Those without space are left out.
    size : float
        The height of the text.
    width : callable
        The width of a text.
    taken : iterable of Box
        What else names do not cover.
    """
    middle = np.mean([(disc.x, disc.y) for disc in discs], axis=0)
    boxes = list(taken)
    for disc in discs:
        reach = disc.radius + COLLAR / 2
        boxes.append((disc.x - reach, disc.y - reach, disc.x + reach, disc.y + reach))
    names = []
    turns = np.linspace(0, 2 * np.pi, DIRECTIONS, endpoint=False)
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    for disc in sorted(discs, key=lambda disc: disc.kind == "plain"):
        half, tall = width(disc.id) / 2, 0.95 * size / 2
        outward = np.array([disc.x, disc.y]) - middle
        inward = -ways @ outward / max(float(np.linalg.norm(outward)), 1e-9)
        # Farther outwards rather than near inwards.
        costs = np.arange(RINGS)[:, None] + inward
        for place in np.argsort(costs, axis=None, kind="stable"):
            farther, way = divmod(int(place), DIRECTIONS)
            away = disc.radius + COLLAR / 2 + 2 * tall * farther
            x, y = np.array([disc.x, disc.y]) + ways[way] * (away + np.array([half, tall]))
            box = (x - half, y - tall, x + half, y + tall)
            if not any(meet(box, other) for other in boxes):
                boxes.append(box)
                names.append((Label(disc.id, float(x), float(y), disc.kind != "plain"), disc))
                break
    return names


def meet(a: Box, b: Box) -> bool:
    """Whether two boxes overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
