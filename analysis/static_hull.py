"""One palette for the whole clip: the static, refined RGB hull of section 6.2.

Input: the colours of all frames. Output: a ladder of static palettes, `SkewPolytope`s of one block
whose colours do not change. Each colour has one vertex at the first and one at the last frame, the
keyframes of section 6.2. The first has `palette_size` colours, each other one fewer. The ladder is
a start of the structure search; its palette of the least price is the method `static`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_hulls import refined, simple_hull
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut, pooled
from palette4d.analysis.losses import NO_FACES, shaped_weights
from palette4d.analysis.objective import Priced, frame_losses, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import LEAST_COLOURS, FramePalette, Section, SkewPolytope

F64 = NDArray[np.float64]

# Gradient steps on each rung.
STEPS = 40
# Number of evenly spaced frames on which rungs are refined and compared.
EVEN_FRAMES = 24
# Colours of the first rung's hull, as a multiple of the coarse colours of one frame.
POOLED = 2


def ladder(
    frames: Sequence[FrameStatistics], gamut: Gamut, options: AnalysisOptions
) -> list[Priced]:
    """Return static palettes from `palette_size` colours down to four, with their values.

    Each rung has one colour fewer than the rung before. Two ladders are built, without `convexity`
    and with it; for each number of colours the better rung is returned. Colours inside the hull are
    removed too. Colours without volume have one palette.
    """
    sampled = [*frames[: -1 : -(-len(frames) // EVEN_FRAMES)], frames[-1]]
    colours = pooled([f.coarse for f in frames], POOLED * options.coarse_colours)
    roomy = dataclasses.replace(options, refinement_box=2 * options.refinement_box)
    weights = shaped_weights(options, gamut.scale, faces=False)

    def bare(rgb: F64) -> SkewPolytope:
        return _still(FramePalette(rgb, NO_FACES), sampled)

    def loss(rgb: F64, every: int = 1) -> float:
        rows = frame_losses(
            bare(rgb), sampled, range(0, len(sampled), every), weights, options, coarse=True
        )
        return float((options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]).mean())

    def rungs(rgb: F64, start: Callable[[F64], SkewPolytope]) -> Iterator[FramePalette]:
        while True:
            moved, _ = refine_jointly(start(rgb), sampled, gamut, roomy, STEPS, coarse=True)
            palette = hull_mesh(moved.vertices[:, :3])
            yield palette
            count = len(palette.rgb)
            if count <= LEAST_COLOURS:
                return
            poorer = (np.delete(palette.rgb, i, axis=0) for i in range(count))
            rgb = min(poorer, key=lambda rest: loss(rest, every=2))

    simple = simple_hull(colours, options, options.palette_size)
    if isinstance(simple, FramePalette):
        return [Priced(_lasting(simple, frames), loss(simple.rgb))]
    first = refined(colours, simple, gamut, dataclasses.replace(options, merge_distance=0.0)).rgb
    best: dict[int, tuple[float, FramePalette]] = {}
    # With faces, `convexity` keeps colours at corners of the hull; inside it they are removed.
    for start in (bare, lambda rgb: _still(hull_mesh(rgb), sampled)):
        for palette in rungs(first, start):
            count, value = len(palette.rgb), loss(palette.rgb)
            if count not in best or value < best[count][0]:
                best[count] = value, palette
    return [Priced(_lasting(best[n][1], frames), best[n][0]) for n in sorted(best, reverse=True)]


def _still(palette: FramePalette, frames: Sequence[FrameStatistics]) -> SkewPolytope:
    """Return a palette as tracks of one vertex: constant colours."""
    first, count = float(frames[0].frame), len(palette.rgb)
    tracks = tuple((i,) for i in range(count))
    section = Section(first, float(frames[-1].frame), tracks, palette.faces)
    return SkewPolytope(np.column_stack([palette.rgb, np.full(count, first)]), (section,), ())


def _lasting(palette: FramePalette, frames: Sequence[FrameStatistics]) -> SkewPolytope:
    """Return a palette as tracks with a vertex in the first and one in the last frame."""
    still, last, count = _still(palette, frames), float(frames[-1].frame), len(palette.rgb)
    if last == still.blocks[0].first:
        return still
    ends = still.vertices.copy()
    ends[:, 3] = last
    tracks = tuple((i, count + i) for i in range(count))
    section = dataclasses.replace(still.blocks[0], tracks=tracks)
    return SkewPolytope(np.vstack([still.vertices, ends]), (section,), ())
