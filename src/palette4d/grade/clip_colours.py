"""The colours of a clip that its sidecar keeps, at any time."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

F64 = NDArray[np.float64]


class ClipColours:
    """The stored colours of a clip, from its palette and a sidecar's members.

    `frames` are the frames with stored colours, in rising order; `colours` their (n, 4) colours,
    with the share of the pixels of each.
    """

    def __init__(self, polytope: _core.Polytope, fields: Mapping[str, Any]) -> None:
        self.polytope = polytope
        # Without pixels a frame has no colours, whatever a file says.
        entries = [e for e in fields.get("colours", ()) if any(row[3] > 0 for row in e["rgbw"])]
        self.frames: list[float] = [entry["frame"] for entry in entries]
        self.colours: list[F64] = [
            np.array(entry["rgbw"], float).reshape(-1, 4) for entry in entries
        ]

    def colours_at(self, time: float) -> F64:
        """Return (m, 4) colours of the clip at a time, and each one's share of the pixels.

        Without stored colours: the palette's, and the middles of its faces.
        """
        if not self.frames:
            cut = _core.slice_at(self.polytope, time)
            middles = cut.rgb[cut.faces].mean(axis=1) if len(cut.faces) else cut.rgb
            rgb = np.concatenate([cut.rgb, middles])
            return np.column_stack([rgb, np.full(len(rgb), 1 / len(rgb))])
        after = int(np.searchsorted(self.frames, time))
        if after == 0 or after == len(self.frames):
            return self.colours[min(after, len(self.frames) - 1)]
        before = after - 1
        part = (time - self.frames[before]) / (self.frames[after] - self.frames[before])
        rows = [self.colours[before], self.colours[after]]
        return np.concatenate([rows[0] * [1, 1, 1, 1 - part], rows[1] * [1, 1, 1, part]])
