"""The paper's own rules for merging, removal and refinement: `--method paper`.

Merging stops above eta1 times the first block loss (section 5.3.3). Removal stops above eta2 times
the loss after merging (section 5.4.2). Refinement moves one vertex at a time, and all vertices
together after each cycle (section 5.5). It uses NLopt with the core's exact gradient.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from palette4d.analysis.block_merging import Block, merge_sequence
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.objective import Objective, move, move_all
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.vertex_removal import NEGLIGIBLE, RemovalTrials

# Most evaluations of the loss (NLopt) when one vertex moves, and when all vertices move together.
LOCAL_EVALUATIONS = 40
JOINT_EVALUATIONS = 150

Counter = Callable[[int, int], object]


def merge_blocks(
    blocks: Sequence[Block],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    progress: Counter | None = None,
) -> list[Block]:
    """Merge until the loss exceeds eta1 times its first value, or one block is left."""
    threshold, last = 0.0, list(blocks)
    for total, configuration in merge_sequence(blocks, frames, gamut, options):
        if len(configuration) == len(blocks):
            threshold = options.eta1 * total
        elif total > threshold:
            break
        last = configuration
        if progress and len(blocks) > 1:
            progress(len(blocks) - len(configuration), len(blocks) - 1)
    return last


def remove_vertices(
    dense: DensePolytope,
    frames: Sequence[FrameStatistics],
    options: AnalysisOptions,
    progress: Counter | None = None,
) -> None:
    """Remove vertices, in place: of the vertices nearest to their ghosts, the cheapest first."""
    trials = RemovalTrials(dense, frames, options)
    threshold = options.eta2 * float(trials.losses.sum()) + NEGLIGIBLE * len(frames)
    pool = [v for v in range(len(dense.place)) if dense.removable(v)]
    start, removed = len(pool), 0
    distance: dict[int, tuple[tuple[int, int], float]] = {}

    def ghost_distance(vertex: int) -> float:
        """Return the distance between the vertex and its ghost at the same time."""
        ends = dense.before[vertex][0], dense.after[vertex][0]
        cached = distance.get(vertex)
        if cached is None or cached[0] != ends:
            place = next(rgb for i, _, rgb in dense.ghosts(vertex) if i == dense.place[vertex][0])
            gap = float(np.linalg.norm(place - dense.colour(vertex)))
            distance[vertex] = cached = ends, gap
        return cached[1]

    while pool := [v for v in pool if dense.removable(v)]:
        nearest = sorted(pool, key=lambda v: (ghost_distance(v), v))[: options.removal_candidates]
        change, vertex = min((trials.change(v), v) for v in nearest)
        if float(trials.losses.sum()) + change > threshold:
            break
        trials.remove(vertex)
        removed += 1
        if progress:
            progress(removed, start)


def refine_vertices(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    progress: Counter | None = None,
) -> SkewPolytope:
    """Return the polytope with refined vertices; its loss never grows."""
    fine = Objective(polytope, frames, options, gamut, coarse=False)
    coarse = Objective(polytope, frames, options, gamut, coarse=True)
    start = polytope.vertices.copy()
    start[:, :3] = gamut.clip(start[:, :3])
    vertices = start
    for cycle in range(options.refinement_cycles):
        # Coarse colours are three times as fast; only the last cycle uses all colours.
        evaluate = fine if cycle == options.refinement_cycles - 1 else coarse
        for v in range(len(vertices)):
            which = evaluate.touched(vertices, [v])
            box = evaluate.box(vertices, [v], share=1.0)
            vertices = move(evaluate, vertices, np.array([v]), which, box, LOCAL_EVALUATIONS)
        vertices = move_all(evaluate, vertices, JOINT_EVALUATIONS)
        if progress:
            progress(cycle + 1, options.refinement_cycles)
    if fine(vertices, fine.all_frames)[0] > fine(start, fine.all_frames)[0]:
        vertices = start
    return polytope.with_vertices(vertices)
