"""Moves of palette colours: of handles along a colour's way, over all time or within a range.

A move is a function from a palette colour, as the user has edited it, to its new colour. Within a
range the move comes and goes with ramps, and nothing changes outside of it: this needs stops at the
ends of the ramps, also on other edges of vertices that move.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade.edits import Colour, Ramp, Setting, as_colour, new_id
from palette4d.grade.handles import Handles

Move = Callable[[Colour], Colour]


@dataclass(frozen=True)
class Range:
    """A range of time: the move is full from `first` to `last`, with ramps above 0 frames."""

    first: float
    last: float
    fade: float
    fade_out: float

    def weight(self, frame: float) -> float:
        """Return the share of the move at a frame, 0..1."""
        away = max((self.first - frame) / self.fade, (frame - self.last) / self.fade_out, 0.0)
        return max(0.0, 1 - away)

    @property
    def start(self) -> float:
        """The last frame before the move."""
        return self.first - self.fade

    @property
    def end(self) -> float:
        """The first frame after the move."""
        return self.last + self.fade_out


def shift(offset: Colour) -> Move:
    """Return the move by an offset."""
    return lambda colour: as_colour([a + b for a, b in zip(colour, offset, strict=True)])


def shift_to(before: Colour, after: Colour) -> Move:
    """Return the move of one colour to another, as it moves other colours of a track.

    They move by the same difference, and darker colours by less: by their share of the luma of
    `before`. So black stays black where a track fades out.
    """
    luma = _luma(before)

    def move(colour: Colour) -> Colour:
        if colour == before:
            return after
        share = min(1.0, max(0.0, _luma(colour)) / luma) if luma > 0 else 1.0
        result = [c + share * (b - a) for a, b, c in zip(before, after, colour, strict=True)]
        return as_colour(result)

    return move


def _luma(colour: Colour) -> float:
    """Return the Rec. 709 luma."""
    r, g, b = colour
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def range_of(
    start: float | None,
    until: float | None,
    fade: float | None,
    fade_out: float | None,
    *,
    frames: tuple[int, int, int],
) -> Range | None:
    """Return the range for frames that the user gave; None for the whole clip."""
    first, last, step = frames
    if start is None and until is None:
        if fade is not None or fade_out is not None:
            raise Palette4dError(
                "found a fade without a range; expected also its first or its last frame: "
                f"{Arg('start')} or {Arg('until')}"
            )
        return None
    # Without a first or last frame the range goes on beyond the clip.
    begin = min(first, until if until is not None else first) - step if start is None else start
    end = max(last, begin) + step if until is None else until
    fade_in = fade or 0.0
    fade_out = fade_in if fade_out is None else fade_out
    if not begin <= end or end < first or begin > last or not (fade_in >= 0 and fade_out >= 0):
        faded = f" with {fades_text(fade_in, fade_out)}" if fade_in or fade_out else ""
        raise Palette4dError(
            f"found the range {range_text(start, until)}{faded}; expected a range in order that "
            f"meets the clip, which has the frames {first} to {last}, and fades of 0 or more"
        )
    # Nothing is between two frames, so that a fade of one is a cut.
    fades = (max(ramp, 1.0) for ramp in (fade_in, fade_out))
    return Range(float(begin), float(end), *fades)


def fades_text(before: float, after: float) -> str:
    """Return the ramps of a range for people: "fades of 4 frames", "fades of 4 and 2 frames"."""
    return f"fades of {before:g}{'' if before == after else f' and {after:g}'} frames"


def range_text(start: float | None, until: float | None) -> str:
    """Return a range for people: "from frame 3 to 5", "until frame 5"."""
    if start is None:
        return f"until frame {until:g}"
    return f"from frame {start:g} on" if until is None else f"from frame {start:g} to {until:g}"


def moved(
    handles: Handles,
    settings: Mapping[str, Setting],
    way: tuple[set[str], set[str]],
    move: Move,
    colour_at: Callable[[str, float], Colour],
    *,
    within: Range | None = None,
    ramp: Ramp | None = None,
    clip_ramp: Ramp = "linear",
    exact: tuple[str, float] | None = None,
) -> dict[str, Setting]:
    """Return the settings of the handles that change.

    Parameters
    ----------
    way : (set of str, set of str)
        The vertices and edges whose colours move (`tracks.way_of`); or one stop.
    colour_at : callable
        The user's colour of an edge at a frame inside it.
    within : Range, optional
        The range; None: the whole clip.
    ramp : str, optional
        The ramp of the handles that move; in a range: of its fades.
    exact : (str, float), optional
        An edge and a frame where the colour moves exactly, by a stop.
    """
    vertices, edges = way
    result: dict[str, Setting] = {}

    def give(id_: str, before: Setting, frame: float) -> None:
        share = 1.0 if within is None else within.weight(frame)
        if share:
            new = replace(before, rgb=_mixed(before.rgb, move(before.rgb), share))
            result[id_] = replace(new, ramp=ramp) if ramp and within is None else new

    for id_, vertex in handles.vertices.items():
        if id_ in vertices:
            own = Setting(as_colour(vertex["rgb"]))
            give(id_, settings.get(id_, own), vertex["frame"])
    for id_, stop in settings.items():
        if stop.frame is not None and (stop.edge in edges or id_ in vertices):
            give(id_, stop, stop.frame)
    touched = {id_ for id_ in result if id_ in handles.vertices}
    for edge, ends in handles.edges.items():
        times = {exact[1]} if exact is not None and exact[0] == edge else set()
        if within is not None and edge in edges:
            times |= {within.start, within.first, within.last, within.end}
        elif within is not None and (ends["to"] in touched or ends["from"] in touched):
            times |= {within.start, within.end}  # the neighbour stays outside of the range
        if not times:
            continue
        knots = _knots_of(handles, settings, edge)
        for frame in sorted(times):
            if not knots[0][0] < frame < knots[-1][0] or any(at == frame for at, _ in knots):
                continue
            to_next = next(own for at, own in reversed(knots) if at < frame)
            colour = colour_at(edge, frame)
            if edge in edges:
                share = 1.0 if within is None else within.weight(frame)
                colour = _mixed(colour, move(colour), share)
                if within is not None and frame in (within.start, within.last):  # begins a fade
                    to_next = ramp or ("linear" if (to_next or clip_ramp) == "hold" else to_next)
            id_ = new_id("s", {*handles.vertices, *handles.edges, *settings, *result})
            result[id_] = Setting(colour, edge, frame, to_next)
    return result


def _knots_of(
    handles: Handles, settings: Mapping[str, Setting], edge: str
) -> list[tuple[float, Ramp | None]]:
    """Return the times of an edge's handles in order, with their own ramps."""
    ends = [handles.edges[edge][end] for end in ("from", "to")]
    knots = [
        (handles.vertices[id_]["frame"], settings[id_].ramp if id_ in settings else None)
        for id_ in ends
    ]
    knots += [
        (s.frame, s.ramp) for s in settings.values() if s.edge == edge and s.frame is not None
    ]
    return sorted(knots, key=lambda knot: knot[0])


def _mixed(before: Colour, after: Colour, share: float) -> Colour:
    if share == 1:
        return as_colour(after)
    return as_colour([a + share * (b - a) for a, b in zip(before, after, strict=True)])
