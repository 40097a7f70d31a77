"""How much of the picture each track moves, by the clip's stored colours."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.tracks import Track

F64 = NDArray[np.float64]


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
