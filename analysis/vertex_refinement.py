"""Stage 5, section 5.5: refining the vertices in RGB and time.

Input and output: a `SkewPolytope`; its structure stays. Each vertex in turn moves in the 4D box of
section 5.5 to lower the refinement loss (eq. 12), by NLopt with the core's exact gradient, only
the frames that it touches being evaluated again; after each cycle over the vertices all move
together once. Vertices of the first and last frame and splitting and merging vertices keep their
time; the others stay inside their block, between their neighbours in time. The loss never grows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import colour_scale
from palette4d.analysis.objective import Objective, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

LOCAL_EVALUATIONS = 40
JOINT_EVALUATIONS = 150


def refine(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
) -> SkewPolytope:
    """Return the polytope with its vertices refined."""
    scale = colour_scale(low, high)
    fine = Objective(polytope, statistics, options, scale, coarse=False)
    coarse = Objective(polytope, statistics, options, scale, coarse=True)
    start = polytope.vertices.copy()
    start[:, :3] = np.clip(start[:, :3], low, high)
    vertices = start
    everything = list(range(len(statistics)))
    steps = options.refinement_cycles * (len(vertices) + 1)
    done = 0
    for cycle in range(options.refinement_cycles):
        # The way is found on coarse colours, three times as fast; the last cycle uses all.
        evaluate = fine if cycle == options.refinement_cycles - 1 else coarse
        for v in range(len(vertices)):
            which = evaluate.touched(vertices, [v])
            box = evaluate.box(vertices, [v], low, high, share=1.0)
            vertices = move(evaluate, vertices, np.array([v]), which, box, LOCAL_EVALUATIONS)
            done += 1
            if progress:
                progress(done, steps)
        # Neighbours in time share the gap between them, so that both may move at once.
        box = evaluate.box(vertices, range(len(vertices)), low, high, share=0.5)
        moving = np.arange(len(vertices))
        vertices = move(evaluate, vertices, moving, everything, box, JOINT_EVALUATIONS)
        done += 1
        if progress:
            progress(done, steps)
    if fine(vertices, everything)[0] > fine(start, everything)[0]:
        vertices = start
    return polytope.with_vertices(vertices)
