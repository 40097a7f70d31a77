"""A clip's picks and holds as constants: `clip_grids.inc` of the kernel reads them.

A matte changes with the picked colour. Stored is each pick's matte where it was picked, without
loss, and at some frames (keys) what it takes to make the matte of a frame from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

F64 = NDArray[np.float64]

#: `layout.inc` of the kernel: numbers of the head, where it says where picks are and which display
#: curve, numbers of a pick, and where in it its plan, its strength and its shade begin; of a hold.
HEAD, PICKS, DISPLAY, PICK, PLAN, STRENGTH, SHADE, HOLD = 28, 14, 17, 33, 13, 21, 26, 9
#: Part of a number of the table, or of 1, by which an interpolated one may differ.
TOLERANCE = 4e-6


@dataclass(frozen=True)
class PickConstants:
    """The constants.

    At some frames (`times`) there is a table. Its number i is column columns[i] of `tables`, which
    changes, or number -1 - columns[i] of `fixed`. `stills` are the grids, `values` theirs.
    """

    times: list[float]
    tables: F64  #: (times, columns)
    columns: list[int]
    fixed: list[float]
    stills: list[int]
    values: list[float]
    bits: int  #: of a code in the still grids

    @property
    def table_size(self) -> int:
        """Bytes without grids and values."""
        return 4 * (len(self.times) + self.tables.size + len(self.columns) + len(self.fixed))

    @property
    def size(self) -> int:
        """Bytes."""
        return self.table_size + 4 * (len(self.stills) + len(self.values))

    @property
    def texture(self) -> NDArray[np.uint8]:
        """(h, 256, 4) bytes: grids, then values, each number as four bytes, the lowest first."""
        numbers = np.array(self.stills, np.int64).astype("<u4")
        data = numbers.tobytes() + np.array(self.values, "<f4").tobytes()
        return np.frombuffer(data + bytes(-len(data) % 1024), np.uint8).reshape(-1, 256, 4)


def pick_constants(
    edits: _core.Edits, times: Sequence[float], recolourers: Sequence[_core.Recolourer]
) -> PickConstants | None:
    """Return the picks of a clip's edits; None without any.

    `recolourers` are the edit at each of the times.
    """
    mattes = edits.still_mattes()
    if not mattes:
        return None
    order = sorted(mattes, key=lambda number: mattes[number][0])  # holds last
    stills, values, bits = _stills([mattes[number][1:4] for number in order])
    moments = [edits.pick_moments(time) for time in times]
    if not any(moments):
        return None
    rows = [_row(order, mattes, now, edit) for now, edit in zip(moments, recolourers, strict=True)]
    curve = next((curve for _, curve in rows if curve is not None), None)
    table = np.stack([row for row, _ in rows])
    _fill(table, sum(not mattes[number][0] for number in order), len(order))
    if curve is not None:
        count, start, scale, samples = curve
        table[:, DISPLAY : DISPLAY + 4] = count, len(values), start, scale
        values += samples
    keys = _keys(np.asarray(times), table)
    moving = np.ptp(table, axis=0) > 0
    moving[0] |= not moving.any()  # no array is empty
    fixed, places = np.unique(table[0], return_inverse=True)
    columns = np.where(moving, np.cumsum(moving) - 1, -1 - places)
    return PickConstants(
        [times[key] for key in keys],
        table[np.ix_(keys, moving)],
        columns.tolist(),
        fixed.tolist(),
        stills,
        values,
        bits,
    )


Curve = tuple[int, float, float, list[float]]


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
    for place in range(count):
        is_pick = place < picks
        start = HEAD + PICK * place if is_pick else HEAD + PICK * picks + 1 + HOLD * (place - picks)
        part = table[:, start : start + (PICK if is_pick else HOLD)]
        on = np.flatnonzero(~np.isnan(part).any(axis=1))
        if len(on) == 0:
            part[np.isnan(part)] = 0
            continue
        for frame in np.setdiff1d(np.arange(len(table)), on):
            part[frame] = part[on[np.argmin(np.abs(on - frame))]]
            part[frame, slice(STRENGTH, SHADE) if is_pick else -1] = 0


def _keys(times: F64, table: F64) -> list[int]:
    """Return the fewest rows between which all others follow in straight lines."""
    scale = TOLERANCE * np.maximum(np.abs(table).max(axis=0), 1.0)
    keys, start, last = [0], 0, len(table) - 1
    while start < last:
        end, step, growing = start + 1, 1, True
        while step > 0:
            trial = min(end + step, last)
            part = (times[start : trial + 1] - times[start]) / (times[trial] - times[start])
            line = table[start] + part[:, None] * (table[trial] - table[start])
            fits = trial > end and bool((np.abs(line - table[start : trial + 1]) <= scale).all())
            end = trial if fits else end
            growing = growing and fits
            step = step * 2 if growing else step // 2
        keys.append(end)
        start = end
    return keys


def _stills(
    mattes: Sequence[tuple[NDArray[np.float32], Sequence[float], Sequence[float]]],
) -> tuple[list[int], list[float], int]:
    """Return the still grids; the values, shares and first points that they need; bits a code."""
    heads: list[int] = []
    rest: list[int] = []
    values: list[float] = []
    books = [np.unique(grid, return_inverse=True) for grid, _, _ in mattes]
    bits = max(len(levels) - 1 for levels, _ in books).bit_length() or 1
    for (grid, shares, point), (levels, inverse) in zip(mattes, books, strict=True):
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
        rest += lines + _packed(shell, bits)
        values += book.tolist() + list(shares) + list(point)
    return heads + rest, values, bits


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


def _packed(codes: bytes, bits: int) -> list[int]:
    """Return codes of some bits in numbers of 32."""
    each = 32 // bits
    padded = np.frombuffer(codes + bytes(-len(codes) % each), np.uint8).astype(np.uint64)
    places = np.arange(each, dtype=np.uint64) * np.uint64(bits)
    return [int(number) for number in (padded.reshape(-1, each) << places).sum(axis=1)]


def _longest(run: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the ends of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], run, [False]]).astype(int)))
    if len(edges) == 0:
        return 0, 0
    longest = int((edges[1::2] - edges[::2]).argmax())
    return int(edges[2 * longest]), int(edges[2 * longest + 1])
