"""Vertex refinement, section 5.5: the last joint move of all vertices in RGB and time.

Input and output: a `SkewPolytope`; its structure stays. All vertices move together in the 4D boxes
of section 5.5 to lower the refinement loss (eq. 12), measured on all colours of all frames.
Vertices of the first and last frame and splitting and merging vertices keep their time; the others
stay inside their block, between their neighbours in time. The paper moves one vertex at a time:
`baselines.paper_thresholds`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from palette4d.analysis.convex_hulls import CONCAVE, deepest_concavity
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope

# Gradient steps on all colours of all frames.
STEPS = 25
# The longest step, as `STEP` in `losses`; short, because the start is nearly optimal.
GENTLE = 0.005
# Factor of `convexity` in the second refinement of slices that are not convex.
STIFFER = 3.0


def refine(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    brief: tuple[int, ...] = (),
) -> SkewPolytope:
    """Return the refined polytope. If it is not convex, refine it again with more `convexity`.

    The second result is kept if its deepest concavity is less. `brief` as in `Objective`.
    """
    refined, _ = refine_jointly(polytope, frames, gamut, options, STEPS, False, brief, GENTLE)
    deepest = deepest_concavity(refined, frames)
    if not options.convexity or deepest <= CONCAVE:
        return refined
    stiffer = dataclasses.replace(options, convexity=STIFFER * options.convexity)
    stiffened, _ = refine_jointly(refined, frames, gamut, stiffer, STEPS, False, brief, GENTLE)
    return stiffened if deepest_concavity(stiffened, frames) < deepest else refined
