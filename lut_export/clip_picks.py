"""A clip's picks and holds as constants: `clip_grids.inc` and `clip_table.inc` read them.

A matte changes with the picked colour. Stored is each pick's matte where it was picked, and what it
takes to make the matte of a frame from it: a table, whose numbers have keys of their own where they
change.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.clip_keys import F64, bends, keys_of

from palette4d import _core

#: `layout.inc` of the kernel: numbers of the head, where it says where picks are and which display
#: curve, numbers of a pick, and where in it its plan, its strength and its shade begin; of a hold.
HEAD, PICKS, DISPLAY, PICK, PLAN, STRENGTH, SHADE, HOLD = 28, 14, 17, 33, 13, 21, 26, 9
#: Part of a number of the table, or of 1, by which an interpolated one may differ.
TOLERANCE = 4e-6


Curve = tuple[int, float, float, list[float]]


@dataclass(frozen=True)
class PickConstants:
    """The constants.

    Number i of a frame's table is number columns[i] of those in `tracks`, which change, or number
    -1 - columns[i] of `fixed`. `stills` are the grids, `books` their values after the display's.
    """

    columns: list[int]
    fixed: list[float]
    moving: int  #: numbers that change
    tracks: list[list[int]]  #: as `clip_table.inc` says; times are counted in `times`
    times: list[float]
    values: list[float]
    display: list[float]
    stills: list[int]
    books: list[float]
    base: int  #: how many values a code of the still grids may have

    @property
    def table_size(self) -> int:
        """Bytes without grids and their values."""
        numbers = len(self.columns) + len(self.fixed) + len(self.times) + len(self.values)
        return 4 * (numbers + 5 * len(self.tracks))

    @property
    def size(self) -> int:
        """Bytes."""
        return self.table_size + 4 * (len(self.stills) + len(self.books))

    @property
    def texture(self) -> NDArray[np.uint8]:
        """(h, 256, 4) bytes: grids, then values, each number as four bytes, the lowest first."""
        numbers = np.array(self.stills, np.int64).astype("<u4")
        data = numbers.tobytes() + np.array(self.books, "<f4").tobytes()
        return np.frombuffer(data + bytes(-len(data) % 1024), np.uint8).reshape(-1, 256, 4)

    def with_mattes(self, edits: _core.Edits) -> "PickConstants":
        """Return the same picks with these edits' mattes."""
        mattes = edits.still_mattes()
        stills, books, base = _stills([mattes[i][1:4] for i in _order(mattes)], self.display)
        return replace(self, stills=stills, books=books, base=base)


def pick_constants(
    edits: _core.Edits, times: Sequence[float], recolourers: Sequence[_core.Recolourer]
) -> PickConstants | None:
    """Return the picks of a clip's edits; None without any.

    `recolourers` are the edit at each of the times.
    """
    mattes = edits.still_mattes()
    moments = [edits.pick_moments(time) for time in times]
    if not any(moments):
        return None
    order = _order(mattes)
    rows = [_row(order, mattes, now, edit) for now, edit in zip(moments, recolourers, strict=True)]
    curve = next((curve for _, curve in rows if curve is not None), None)
    table = np.stack([row for row, _ in rows])
    _fill(table, sum(not mattes[number][0] for number in order), len(order))
    display: list[float] = []
    if curve is not None:
        count, start, scale, display = curve
        table[:, DISPLAY : DISPLAY + 4] = count, 0, start, scale
    fixed, places = np.unique(table[0], return_inverse=True)
    columns, moving = -1 - places, 0
    tracks: list[list[int]] = []
    at: list[float] = []
    values: list[float] = []
    changes = np.ptp(table, axis=0) > 0
    changes[0] |= not changes.any()  # no array is empty
    spans = [(0, HEAD, True)]
    for start, size in _parts(table, len(order)):
        # The node goes in steps, all else along cubics.
        spans += [(start, start + 3, True), (start + 3, start + size, False)]
    for start, end, held in spans:
        own = start + np.flatnonzero(changes[start:end])
        if len(own) > 0:
            keys, numbers = _track(np.asarray(times), table[:, own], held=held)
            tracks.append([len(at), len(at) + len(keys) - 1, len(values), len(own), int(held)])
            columns[own] = moving + np.arange(len(own))
            moving += len(own)
            at += [times[key] for key in keys]
            values += numbers
    kept = columns.tolist(), fixed.tolist(), moving, tracks, at, values, display
    return PickConstants(*kept, [], [], 0).with_mattes(edits)


def _order(mattes: dict[int, Any]) -> list[int]:
    """Return the picks, then the holds."""
    return sorted(mattes, key=lambda number: mattes[number][0])


def _parts(table: F64, count: int) -> list[tuple[int, int]]:
    """Return where each pick and hold is in a table, and how many numbers it has."""
    picks = int(table[0, PICKS])
    left = HEAD + PICK * picks
    holds = [(left + 1 + HOLD * i, HOLD) for i in range(count - picks)]
    return [(HEAD + PICK * i, PICK) for i in range(picks)] + holds


def _track(times: F64, part: F64, *, held: bool) -> tuple[list[int], list[float]]:
    """Return the keys of these columns of the table, and their values."""
    most = TOLERANCE * np.maximum(np.abs(part).max(axis=0), 1.0)

    def fits(key: int, end: int) -> bool:
        if held:
            return bool((part[key:end] == part[key]).all())
        return bool((bends(times[key : end + 1], part[key : end + 1])[1] <= most).all())

    keys = keys_of(len(times), fits)
    if held:
        return keys, part[keys].ravel().tolist()
    bent = np.zeros((len(keys), 2, part.shape[1]))
    for i, (key, end) in enumerate(pairwise(keys)):
        bent[i] = bends(times[key : end + 1], part[key : end + 1])[0]
    return keys, np.concatenate([part[keys, None], bent], axis=1).swapaxes(1, 2).ravel().tolist()


def _row(
    order: Sequence[int],
    mattes: dict[int, Any],
    now: Sequence[tuple[int, Sequence[float], float]],
    edit: _core.Recolourer,
) -> tuple[F64, Curve | None]:
    """Return the table of a frame, and the display's curve; NaN where a pick asks for nothing."""
    holds = sum(mattes[number][0] for number in order)
    picks = len(order) - holds
    left = HEAD + PICK * picks
    row = np.zeros(left + 1 + HOLD * holds)
    row[PICKS : PICKS + 3] = picks, HEAD, left if holds else 0
    row[left] = holds
    table, grids = _core.kernel_table(edit)
    plans = int(table[PICKS + 1])
    active = {number: i for i, (number, _, _) in enumerate(now)}
    for place, number in enumerate(order):
        i = active.get(number)
        if place < picks:
            start = HEAD + PICK * place
            row[start : start + PICK] = 0
            row[start + PLAN : start + PICK] = np.nan
            row[start : start + 3] = np.nan
            if i is not None:
                plan = plans + PICK * i + PLAN
                row[start + PLAN : start + PICK] = table[plan : plan + PICK - PLAN]
                row[start : start + 3] = _node(now[i][1])
            row[start + 3] = place
        else:
            start = left + 1 + HOLD * (place - picks)
            row[start : start + HOLD] = np.nan
            if i is not None:
                row[start : start + 3] = _node(now[i][1])
                row[start + 4 : start + 7] = now[i][1]
                row[start + 7 : start + 9] = mattes[number][4], now[i][2]
            row[start + 3] = place
    curve = None
    if table[DISPLAY] > 0:
        count, first = int(table[DISPLAY]), int(table[DISPLAY + 1])
        samples = grids[first : first + count].tolist()
        curve = (count, float(table[DISPLAY + 2]), float(table[DISPLAY + 3]), samples)
    return row, curve


def _node(point: Sequence[float]) -> list[float]:
    """Return the node below a point, as `MatteGrid::place` finds it, and 1/4, to round down."""
    per = 95 / 1.4
    scaled = [(point[0] + 0.7) * per, (point[1] + 0.7) * per, point[2] * 15]
    return [
        min(int(min(max(x, 0.0), last)), last - 1) + 0.25
        for x, last in zip(scaled, (95, 95, 15), strict=True)
    ]


def _fill(table: F64, picks: int, count: int) -> None:
    """Give what asks for nothing the numbers of its nearest frame, without strength and change."""
    for place, (start, size) in enumerate(_parts(table, count)):
        part = table[:, start : start + size]
        on = np.flatnonzero(~np.isnan(part).any(axis=1))
        if len(on) == 0:
            part[np.isnan(part)] = 0
            continue
        for frame in np.setdiff1d(np.arange(len(table)), on):
            part[frame] = part[on[np.argmin(np.abs(on - frame))]]
            part[frame, slice(STRENGTH, SHADE) if place < picks else -1] = 0


def _stills(
    mattes: Sequence[tuple[NDArray[np.float32], Sequence[float], Sequence[float]]],
    display: Sequence[float],
) -> tuple[list[int], list[float], int]:
    """Return the still grids; the display, then values, shares and first points; codes' base."""
    heads: list[int] = []
    rest: list[int] = []
    values = list(display)
    found = [np.unique(grid, return_inverse=True) for grid, _, _ in mattes]
    base = max(2, *(len(levels) for levels, _ in found))
    for (grid, shares, point), (levels, inverse) in zip(mattes, found, strict=True):
        used = np.flatnonzero(grid.any(axis=(1, 2)))
        first, last = (int(used[0]), int(used[-1])) if len(used) else (0, -1)
        codes = inverse.reshape(grid.shape)
        # The commonest value but 0 is the first: it needs no codes within a line.
        counts = np.bincount(codes.ravel(), weights=(grid.ravel() != 0), minlength=len(levels))
        swapped = np.arange(len(levels))
        swapped[[0, int(counts.argmax())]] = swapped[[int(counts.argmax()), 0]]
        book, codes = levels[swapped], swapped[codes]
        lines, shell = _lines(codes, book, first, last)
        start = 6 * len(mattes) + len(rest)
        heads += [first, last - first + 1, start, start + len(lines), len(values)]
        heads.append(len(values) + len(book))
        rest += lines + _packed(shell, base)
        values += book.tolist() + list(shares) + list(point)
    return heads + rest, values, base


def _lines(
    codes: NDArray[np.intp], book: NDArray[np.float32], first: int, last: int
) -> tuple[list[int], bytes]:
    """Return each line's runs and where its codes are, and the codes."""
    runs: list[int] = []
    own: list[bytes] = []
    for u in range(first, last + 1):
        for light in range(codes.shape[2]):
            line = codes[u, :, light]
            some = np.flatnonzero(book[line] != 0)
            start, end = (int(some[0]), int(some[-1]) + 1) if len(some) else (0, 0)
            a, b = _longest(line[start:end] == 0)
            a, b = a + start, b + start
            runs.append(start | a << 7 | b << 14 | end << 21)
            own.append(bytes(line[start:a].tolist() + line[b:end].tolist()))
    # Most lines are like a neighbour's.
    shell = bytearray()
    for one in sorted(set(own), key=lambda one: (-len(one), one)):
        if one not in shell:
            shell += one
    offsets = [shell.find(one) for one in own]
    lines: list[int] = []
    for i in range(0, len(runs), 2):
        # The high bits of where codes are have room in the runs.
        lines += [
            run | offset >> 16 << 28
            for run, offset in zip(runs[i : i + 2], offsets[i : i + 2], strict=True)
        ]
        lines.append(offsets[i] & 65535 | (offsets[i + 1] & 65535) << 16)
    return lines, bytes(shell)


def _packed(codes: bytes, base: int) -> list[int]:
    """Return codes in words."""
    each = codes_in_word(base)
    padded = np.frombuffer(codes + bytes(-len(codes) % each), np.uint8).reshape(-1, each)
    words: list[int] = (padded @ base ** np.arange(each)).tolist()
    return words


def codes_in_word(base: int) -> int:
    """Return the codes below a number that have room in 31 bits."""
    return next(n for n in range(31, 0, -1) if base**n <= 1 << 31)


def _longest(run: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the ends of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], run, [False]]).astype(int)))
    if len(edges) == 0:
        return 0, 0
    longest = int((edges[1::2] - edges[::2]).argmax())
    return int(edges[2 * longest]), int(edges[2 * longest + 1])
