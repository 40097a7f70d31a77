"""The analysis' options, with the paper's defaults and names."""

from __future__ import annotations

import dataclasses
import math

from palette4d.common.errors import Palette4dError

METHODS = {
    "skew": "a 4D skew polytope; its structure by what each handle is worth (the default)",
    "paper": "the same by the paper's own rules, eta1 and eta2",
    "static": "one palette for the whole clip, the static RGB hull of section 6.2",
    "rgbt": "the simplified convex hull in RGB and time of section 6.2",
}

#: Options that only some methods look at; all others count with every method. What the losses
#: are made of (lambda, k, gamma) counts where figures are printed.
METHODS_OF: dict[str, tuple[str, ...]] = {
    "handle_cost": ("skew",),
    "vertices": ("skew", "rgbt"),
    "blocks": ("skew",),
    "alpha": ("skew", "paper"),
    "beta": ("skew", "paper"),
    "eta1": ("paper",),
    "eta2": ("paper",),
    "gamma": ("skew", "paper", "rgbt"),
    "removal_candidates": ("paper",),
    "refinement_cycles": ("paper",),
    "refinement_box": ("skew", "paper", "static"),
    "palette_size": ("skew", "paper", "static"),
    "merge_distance": ("skew", "paper", "static"),
    "hull_box": ("skew", "paper", "static"),
    "convexity": ("skew", "paper", "static"),
    "separation": ("skew", "paper", "static"),
    "reach": ("skew", "paper", "static"),
}

#: The least and the largest value of each option that is a number.
LIMITS: dict[str, tuple[float, float]] = {
    "handle_cost": (0.0, 1e6),
    "vertices": (0, 1e6),
    "blocks": (1, 1e6),
    "lambda_": (0.0, 1e6),
    "k": (1, 1e9),
    "alpha": (0.0, 1e6),
    "beta": (0.0, 1e6),
    "eta1": (1.0, 1e6),
    "eta2": (1.0, 1e6),
    "gamma": (0.0, 1e6),
    "removal_candidates": (1, 1e6),
    "refinement_box": (0.0, 10.0),
    "refinement_cycles": (0, 1000),
    "palette_size": (4, 24),
    "merge_distance": (0.0, 1.0),
    "hull_box": (0.0, 10.0),
    "convexity": (0.0, 1e6),
    "separation": (0.0, 1.0),
    "reach": (0.0, 10.0),
    "colours": (64, 1e8),
    "coarse_colours": (64, 1e8),
    "seed": (0, 2**63),
    "threads": (0, 1024),
}


@dataclasses.dataclass(frozen=True)
class AnalysisOptions:
    """Options of `palette4d analyze`; defaults as in Du et al. 2021 unless said otherwise.

    Some methods do not look at some of them: `METHODS_OF`.

    Attributes
    ----------
    method : one of `METHODS`.
    handle_cost : the rise of eq. 12 that a vertex must be worth to stay (ours).
    vertices : most vertices of the palette, 0 for as many as are worth it.
    blocks : most blocks of one topology.
    lambda_ : weight of the reconstruction loss in eq. 4 (50).
    k : pixels a palette colour is compared with in eq. 3 (50).
    alpha, beta : weights of block size and palette size in eq. 10 (10, 1).
    eta1 : block merging stops above eta1 times the first block loss (3.5, 5.3.3).
    eta2 : vertex removal stops above eta2 times the loss after merging (3, 5.4.2).
    gamma : weight of the smoothness term in eq. 12 (0.01).
    removal_candidates : vertices tried for each removal (10, section 5.4.2).
    refinement_box : half width of the colour box a vertex may move in (0.1, section 5.5).
    refinement_cycles : rounds over all vertices (3, section 5.5).
    palette_size : most colours of a frame's palette (8, as the authors' program).
    merge_distance : palette colours closer than this become one (the authors' program: 0.1).
    hull_box : half width of the box in the per-frame refinement (0.15, Wang et al. 2019).
    convexity : weight of a term that keeps slices convex (ours; 0 is the paper).
    separation : palette colours nearer than this repel each other (ours; 0 is the paper).
    reach : pixels this far outside count twice, farther ones still more (ours; 0 is the paper).
    colours : most colour bins kept of a frame; 8-bit frames with no more distinct colours are
        exact.
    coarse_colours : the same for hulls, merging and removal, where speed counts; of short clips
        more (`statistics.SHORT`).
    seed : seeds what is random (nothing at present: every step is deterministic).
    threads : threads of the loss evaluation; the result does not depend on it. 0: one a processor.
    """

    method: str = "skew"
    handle_cost: float = 0.0025
    vertices: int = 0
    blocks: int = 3
    lambda_: float = 50.0
    k: float = 50.0
    alpha: float = 10.0
    beta: float = 1.0
    eta1: float = 3.5
    eta2: float = 3.0
    gamma: float = 0.01
    removal_candidates: int = 10
    refinement_box: float = 0.1
    refinement_cycles: int = 3
    palette_size: int = 8
    merge_distance: float = 0.1
    hull_box: float = 0.15
    convexity: float = 3.0
    separation: float = 0.15
    reach: float = 0.1
    colours: int = 32768
    coarse_colours: int = 2048
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        """Refuse values outside their range, naming the option."""
        if self.method not in METHODS:
            raise Palette4dError(
                f"option method: found {self.method!r}, expected one of {', '.join(METHODS)}"
            )
        for name, (low, high) in LIMITS.items():
            value = getattr(self, name)
            if not math.isfinite(value) or not low <= value <= high:
                raise Palette4dError(
                    f"option {name.rstrip('_').replace('_', '-')}: found {value}, "
                    f"expected a number from {low:.10g} to {high:.10g}"
                )

    def recorded(self) -> dict[str, float | int | str]:
        """Return what goes into the sidecar: everything that can change the result."""
        fields = dataclasses.asdict(self)
        del fields["threads"]
        return {name.rstrip("_"): value for name, value in fields.items()}
