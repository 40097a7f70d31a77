"""Clip colours: a few weighted colours of the clip, for the solver of picks.

Input: the statistics of the frames. Output: the sidecar's member "colours". Each entry stands for
the frames around it, so that a brief colour counts too. Colours far from all others are kept
however rare they are. The clip is not read again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import LOST_SHARE

from palette4d.grade.edits import DIGITS

F64 = NDArray[np.float64]

# Entries and colours per entry: with four digits each, about 25 KB as JSON.
MOST_ENTRIES, MOST_COLOURS = 12, 64
# Colours of one cell are averaged. Cells per unit of the gamut's longest side.
CELLS = 32
# Weight of a candidate colour: its share of the pixels, at least `LOST_SHARE`, to this power. With
# larger powers, a lamp of a few pixels is not chosen for its distance.
ROOT = 0.25


def clip_colours(frames: Sequence[FrameStatistics]) -> list[dict[str, Any]]:
    """Return the sidecar's member "colours" of at least one frame, in order of time.

    Each entry has a ``frame`` and its ``rgbw``: (m, 4) colours in the palette's code values, and
    the share of the pixels that each stands for.
    """
    gamut = Gamut.of(frames)
    count = min(MOST_ENTRIES, len(frames))
    centres = np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))
    nearest = np.abs(np.arange(len(frames))[:, None] - centres).argmin(axis=1)
    return [
        {
            "frame": frames[centre].frame,
            "rgbw": _reduced(
                [frame for frame, place in zip(frames, nearest, strict=True) if place == entry],
                gamut,
            ),
        }
        for entry, centre in enumerate(centres.tolist())
    ]


def _reduced(frames: Sequence[FrameStatistics], gamut: Gamut) -> list[list[float]]:
    rgb = np.concatenate([frame.coarse.rgb for frame in frames])
    shares = np.concatenate([frame.coarse.counts / frame.coarse.total for frame in frames])
    shares /= len(frames)
    cells = np.floor((rgb - gamut.low) * (CELLS / gamut.scale)).astype(np.int64)
    keys = cells @ np.array([(CELLS + 1) ** 2, CELLS + 1, 1], np.int64)
    rgb, shares = _grouped(rgb, shares, keys)
    worth = np.maximum(shares, LOST_SHARE) ** ROOT
    channels = np.ascontiguousarray(rgb.T)  # much quicker than row by row

    def distances(chosen: int) -> F64:
        red, green, blue = (channels - channels[:, chosen : chosen + 1]) ** 2
        away: F64 = np.sqrt(red + green + blue)
        return away

    distance = distances(int(shares.argmax()))
    nearest = np.zeros(len(rgb), np.int64)
    for entry in range(1, min(MOST_COLOURS, len(rgb))):
        to_chosen = distances(int((distance * worth).argmax()))
        nearest[to_chosen < distance] = entry
        distance = np.minimum(distance, to_chosen)
    rgb, shares = _grouped(rgb, shares, nearest)
    rows: list[list[float]] = np.column_stack([rgb, shares]).round(DIGITS).tolist()
    return sorted(rows, key=lambda row: (-row[3], row))


def _grouped(rgb: F64, shares: F64, keys: NDArray[np.int64]) -> tuple[F64, F64]:
    """Return the means and the shares of the colours with equal keys."""
    _, group = np.unique(keys, return_inverse=True)
    total = np.bincount(group, shares)
    means = [np.bincount(group, shares * rgb[:, channel]) / total for channel in range(3)]
    return np.column_stack(means), np.asarray(total, np.float64)
