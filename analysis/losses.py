"""The paper's losses (eqs. 2 to 4, 8, 11, 12), and their minimisation inside a box."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import os
import weakref
from collections.abc import Callable

import nlopt
import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette

from palette4d import _core
from palette4d.grade.palette import FAR

F64 = NDArray[np.float64]
ValueAndGradient = Callable[[F64], tuple[float, F64]]
I32 = NDArray[np.int32]
# NLopt stops early when rounding prevents progress or `force_stop` was called.
STOPPED = (
    nlopt.RoundoffLimited,
    nlopt.ForcedStop,
    nlopt.runtime_error,
    nlopt.invalid_argument,
)
# RGB distance outside the palette beyond which a pixel is lost: edits of the palette do not reach
# it. Lost pixels below LOST_SHARE of a frame are ignored, as hot pixels or glints.
LOST, LOST_SHARE = FAR, 1e-4
# `descend`: the longest step, in RGB or in clip lengths; the number of steps that grow up to it;
# Adam's beta 1 and 2, the decay of the gradient's mean and mean square; the square that avoids a
# division by zero.
STEP, WARM_UP, MEAN, SQUARE, TINY = 0.012, 3, 0.65, 0.9, 1e-18
# Most evaluations of a loss when colours move from a good start (NLopt's `maxeval`); twice as many
# from a simplified hull. More take longer and hardly lower the loss.
EVALUATIONS = 30
NO_FACES: I32 = np.zeros((0, 3), np.int32)


@dataclasses.dataclass(frozen=True)
class Losses:
    """Means over the frames: R (eq. 2), C (eq. 3), L (eqs. 4, 8), the share of pixels outside;
    K (eq. 11); L' (eq. 12); the distance of the farthest pixel."""

    R: float
    C: float
    L: float
    K: float
    L_prime: float
    outside: float
    max_distance: float


def thread_count(options: AnalysisOptions) -> int:
    """Return how many threads the loss evaluation uses."""
    return options.threads or os.cpu_count() or 1


def loss_weights(options: AnalysisOptions) -> _core.LossWeights:
    """Return the weights of the paper's losses alone, as in all reported figures."""
    return _core.LossWeights(options.lambda_, options.k)


def reach_weights(options: AnalysisOptions, scale: float) -> _core.LossWeights:
    """Return the weights of the paper's losses and of distant pixels (`reach`)."""
    return _core.LossWeights(options.lambda_, options.k, reach=options.reach * scale)


def shaped_weights(options: AnalysisOptions, scale: float, faces: bool = True) -> _core.LossWeights:
    """Return the weights of the objective: the paper's losses, convexity, separation and reach.

    Losses are distances and convexity is a volume: `scale` (of `Gamut`) relates the two.
    """
    return _core.LossWeights(
        options.lambda_,
        options.k,
        options.convexity / scale**2 if faces else 0.0,
        options.separation * scale,
        options.reach * scale,
    )


def palette_loss(colours: _core.ColourTree, rgb: F64, options: AnalysisOptions) -> float:
    """Eq. 4 of one (n, 3) palette."""
    r, c, *_ = _core.palette_loss(colours, rgb, NO_FACES, loss_weights(options), False)
    return options.lambda_ * r + c


def smoothness(
    vertices: F64, edges: I32, length: float, weights: F64 | None = None
) -> tuple[float, F64]:
    """Eq. 11 and its (n, 4) gradient with respect to the vertices; `length` is the clip's, in
    frames, `weights` of the edges are 1 in the paper.

    Edges without extent in time count as zero; a valid polytope has no such edges.
    """
    return _core.smoothness(
        vertices, edges, length, np.ones(len(edges)) if weights is None else weights
    )


def summarise(rows: F64, k: float, options: AnalysisOptions) -> Losses:
    """Means of (n, 5) rows R, C, shape, outside, max distance, with smoothness `k`."""
    r, c = float(rows[:, 0].mean()), float(rows[:, 1].mean())
    loss = options.lambda_ * r + c
    return Losses(
        R=r,
        C=c,
        L=loss,
        K=k,
        L_prime=loss + options.gamma * k,
        outside=float(rows[:, 3].mean()),
        max_distance=float(rows[:, 4].max()),
    )


def refine_palette(
    colours: _core.ColourTree,
    palette: FramePalette,
    gamut: Gamut,
    options: AnalysisOptions,
    most_evaluations: int = 2 * EVALUATIONS,
) -> F64:
    """Move the colours of a palette to lower eq. 4 (Wang et al. 2019); return them, (n, 3).

    All colours move together, inside boxes of half width `hull_box` and inside the gamut. The
    options `convexity` and `separation` count too. The result is never worse than the input.
    """
    faces, n = palette.faces, len(palette.rgb)
    weights = shaped_weights(options, gamut.scale, len(faces) > 0)

    def objective(x: F64) -> tuple[float, F64]:
        r, c, shape, _, _, gradient = _core.palette_loss(colours, x.reshape(n, 3), faces, weights)
        return options.lambda_ * r + c + shape, gradient.ravel()

    start = gamut.clip(palette.rgb)
    lower, upper = gamut.around(start, options.hull_box * gamut.scale)
    best = minimise(objective, start.ravel(), lower.ravel(), upper.ravel(), most_evaluations)
    return best.reshape(n, 3)


def minimise(
    objective: ValueAndGradient,
    x: F64,
    low: F64,
    high: F64,
    most_evaluations: int,
    tolerance: float = 1e-4,
) -> F64:
    """Minimise a function inside a box (NLopt, L-BFGS); return the best point of all evaluations.

    The losses have kinks: a pixel enters the palette, or the nearest pixels change. A line search
    may fail there. The search then ends, and the function returns the best point so far.
    """
    best_value, best = objective(x)[0], x.copy()
    failures: list[BaseException] = []
    solver = nlopt.opt(nlopt.LD_LBFGS, len(x))
    # The solver holds `call`. A strong reference back would make a cycle through C++ that is never
    # freed.
    running = weakref.proxy(solver)

    def call(point: F64, gradient: F64) -> float:
        nonlocal best_value, best
        if failures:  # a line search makes a few more calls before it stops
            return float("inf")
        try:
            value, slope = objective(point)
            if gradient.size:
                gradient[:] = slope
            if value < best_value:
                best_value, best = value, point.copy()
            return value
        except BaseException as error:  # NLopt drops the exceptions of callbacks, Ctrl-C included
            failures.append(error)
            running.force_stop()
            return float("inf")

    solver.set_min_objective(call)
    solver.set_lower_bounds(low)
    solver.set_upper_bounds(high)
    solver.set_maxeval(most_evaluations)
    solver.set_ftol_rel(tolerance)
    with contextlib.suppress(*STOPPED):
        solver.optimize(np.clip(x, low, high))
    if failures:
        raise failures[0]
    return best


def descend(
    slope: Callable[[F64, int], F64],
    x: F64,
    low: F64,
    high: F64,
    steps: int,
    longest: float = STEP,
) -> F64:
    """Minimise a function inside a box by a number of gradient steps; return the last point.

    `slope(x, k)` is the gradient at step k, possibly of another part of the function each time.
    Steps follow Adam (Kingma and Ba 2015); they grow at first, then shrink to nothing. No line
    search can fail at a kink, where `minimise` ends early: with many colours there are kinks
    everywhere.
    """
    mean, square = np.zeros_like(x), np.zeros_like(x)
    for k in range(1, steps + 1):
        gradient = slope(x, k)
        mean += (1 - MEAN) * (gradient - mean)
        square += (1 - SQUARE) * (gradient**2 - square)
        length = longest * min(1, k / WARM_UP) * math.sqrt(1 - k / (steps + 1)) / (1 - MEAN**k)
        x = np.clip(x - length * mean / np.sqrt(square / (1 - SQUARE**k) + TINY), low, high)
    return x
