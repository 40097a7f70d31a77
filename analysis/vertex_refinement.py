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

STEPS = 25
# The longest step of a palette that is nearly right.
GENTLE = 0.005
# The factor of `convexity` for slices that are not convex.
STIFFER = 3.0


def refine(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    brief: tuple[int, ...] = (),
) -> SkewPolytope:
    """Return the refined polytope; if it is not convex, refined again with more `convexity`.

    The second result is taken if its deepest concavity is less. `brief` as in `Objective`.
    """
    found, _ = refine_jointly(polytope, frames, gamut, options, STEPS, False, brief, GENTLE)
    deepest = deepest_concavity(found, frames)
    if not options.convexity or deepest <= CONCAVE:
        return found
    stiffer = dataclasses.replace(options, convexity=STIFFER * options.convexity)
    again, _ = refine_jointly(found, frames, gamut, stiffer, STEPS, False, brief, GENTLE)
    return again if deepest_concavity(again, frames) < deepest else found
