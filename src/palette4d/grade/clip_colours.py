"""The colours of a clip that its sidecar keeps, and the share of them that each track moves."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.tracks import Track

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


@dataclass(frozen=True)
class Share:
    """How much of the picture a track moves: its mean weight for the pixels, 0..1.

    `mean` is over the frames that have the track; `most` is the largest, at `frame`.
    """

    mean: float
    most: float
    frame: float


def track_shares(clip: ClipColours, tracks: Iterable[Track]) -> dict[str, Share]:
    """Return the shares of tracks by their names; empty without stored colours of the clip."""
    tracks = list(tracks)
    row_of = {id_: row for row, t in enumerate(tracks) for id_ in (*t.vertices, *t.edges)}
    polytope = clip.polytope
    of_vertex = np.array([row_of[id_] for id_ in polytope.vertex_ids], int)
    of_edge = np.array([*(row_of[id_] for id_ in polytope.edge_ids), -1], int)
    shares = np.zeros((len(tracks), len(clip.frames)))
    there = np.zeros(shares.shape, bool)
    for k, (frame, rgbw) in enumerate(zip(clip.frames, clip.colours, strict=True)):
        cut = _core.slice_at(polytope, frame)
        weights = _core.palette_weights(rgbw[:, :3], cut.rgb, cut.faces)[0]
        rows = np.where(cut.edges < 0, of_vertex[cut.ends[:, 0]], of_edge[cut.edges])
        np.add.at(shares[:, k], rows, rgbw[:, 3] @ weights / rgbw[:, 3].sum())
        there[rows, k] = True
    if not clip.frames:
        return {}
    mean = shares.sum(axis=1) / there.sum(axis=1).clip(1)
    most = shares.argmax(axis=1)
    return {
        track.name: Share(float(mean[row]), float(shares[row, index]), float(clip.frames[index]))
        for row, (track, index) in enumerate(zip(tracks, most, strict=True))
    }
