"""A polytope of four colours, one of which goes there and back, and what it holds at a time."""

from __future__ import annotations

import numpy as np
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.polytope import Section, SkewPolytope

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces


def bent(middle=6.0):
    """Frames 0 to 10; three colours rest, colour 1 goes to blue-ish by `middle` and back."""
    ends = [[*c, t] for t in (0.0, 10.0) for c in FOUR]
    vertices = np.array([*ends, [0.9, 0.2, 0.7, middle]])
    tracks = ((0, 4), (1, 8, 5), (2, 6), (3, 7))
    return SkewPolytope(vertices, (Section(0.0, 10.0, tracks, FACES),), ())


def colours_at(polytope, time):
    """(n, 3) colours of the first block's tracks."""
    tracks = [polytope.vertices[list(track)] for track in polytope.blocks[0].tracks]
    return np.array([[np.interp(time, t[:, 3], t[:, c]) for c in range(3)] for t in tracks])
