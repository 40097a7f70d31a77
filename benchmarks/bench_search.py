"""Does the default find what other settings of the same command find?

Analyses clips with the defaults and with other settings, and prints two tables: the
objective (L', the terms for shape, 0.0025 a handle, 0.005 for a rare one) of the default and of the
best setting with handles, blocks and user CPU, and where more of what is allowed gave less: more
blocks or handles or a cheaper handle with a worse objective, a dearer handle with more handles.

    python benchmarks/bench_search.py [CLIP[:A-B] ...] [--drawn NAME ...] [--stills PICTURE ...]
                                      [--default-only] [--noise] [--json FILE]

Without names all drawn clips (`drawn_clips`) and the sample clip are analysed. A still becomes a
clip by a pan from corner to corner. CPU is that of the whole default analysis, reading included.
With --noise each clip is analysed with noise of 1/255 too: how far apart are the colours that
correspond?
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import drawn_clips
import numpy as np
from evaluator import say, table
from palette4d.analysis import colour_statistics, pipeline
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.handle_use import rare_handles
from palette4d.analysis.losses import shaped_weights
from palette4d.analysis.objective import frame_losses
from palette4d.analysis.options import LIKE, AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.structure_search import RARE_COST
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from palette4d import _core
from palette4d.demo import scene
from palette4d.grade import sidecar
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip import open_clip
from palette4d.media.clip_base import Clip

COST = AnalysisOptions().handle_cost
SETTINGS: dict[str, dict[str, Any]] = {
    "default": {},
    **{f"blocks={n}": {"blocks": n} for n in (1, 2, 5, 9)},
    **{f"vertices={n}": {"vertices": n} for n in (12, 16, 20, 24)},
    **{f"handle_cost={c:g}": {"handle_cost": c} for c in (0.001, 0.005, 0.01)},
    **{f"palette_size={n}": {"palette_size": n} for n in (10, 12)},
}
# From the least to the most that is allowed.
RICHER = (
    ("blocks=1", "blocks=2", "default", "blocks=5", "blocks=9"),
    ("vertices=12", "vertices=16", "vertices=20", "vertices=24", "default"),
)
CHEAPER = ("handle_cost=0.01", "handle_cost=0.005", "default", "handle_cost=0.001")
# Figures closer than this share count as equal.
EQUAL = 0.001


@dataclasses.dataclass(frozen=True)
class Result:
    """One analysis."""

    L_prime: float
    terms: float
    handles: int
    rare: int
    blocks: int
    cpu: float

    def objective(self, cost: float = COST) -> float:
        """L', the terms for shape, and the cost of the handles and of rare ones."""
        return self.L_prime + self.terms + cost * self.handles + RARE_COST * self.rare


def clips(args: argparse.Namespace) -> Iterator[tuple[str, Clip]]:
    """Yield the clips with their names."""
    for text in args.clips:
        path, colon, frames = text.rpartition(":")
        named = (path, frames) if colon and Path(path).exists() else (text, None)
        yield (
            f"{Path(named[0]).stem} {named[1] or ''}".strip(),
            open_clip(named[0], frames=named[1]),
        )
    nothing = not (args.clips or args.drawn or args.stills)
    for name in args.drawn or (drawn_clips.SCENES if nothing else ()):
        yield name, ArrayClip(drawn_clips.drawn(name), name=name)
    if nothing:
        lake = scene.Scene(240, 136)
        yield "sample", ArrayClip(np.stack([lake.picture(u) for u in np.linspace(0, 1, 48)]))
    for still in args.stills:
        _, picture = next(open_clip(still).iter_colours())
        yield f"{Path(still).stem}, pan", ArrayClip(drawn_clips.pan(picture))


def analysed(clip: Clip, settings: Sequence[str]) -> dict[str, Result]:
    """Analyse a clip with each setting; its frames are read once."""
    started = time.process_time()
    found = colour_statistics.gather_clip(clip, AnalysisOptions()).frames
    frames = [one for _, one in sorted(found.items()) if one is not None]
    read = time.process_time() - started
    results = {}
    for name in settings:
        started = time.process_time()
        analysis = pipeline.find_polytope(frames, AnalysisOptions(**SETTINGS[name]))
        cpu = read + time.process_time() - started
        polytope, losses = analysis.polytope, analysis.stages[-1].losses
        counts = len(polytope.vertices), rare_handles(polytope, frames), len(polytope.blocks)
        results[name] = Result(losses.L_prime, terms(polytope, frames), *counts, round(cpu, 2))
    return results


def terms(polytope: SkewPolytope, frames: Sequence[FrameStatistics]) -> float:
    """Return what the search adds to L' for convexity, separation and reach."""
    weights = shaped_weights(AnalysisOptions(), Gamut.of(frames).scale)
    rows = frame_losses(
        polytope, frames, range(len(frames)), weights, AnalysisOptions(), coarse=False
    )
    return float(rows[:, 2].mean())


def broken(results: dict[str, Result]) -> list[str]:
    """Return where more of what is allowed gave less."""
    found = []
    for less, more in itertools.chain.from_iterable(map(itertools.pairwise, RICHER)):
        a, b = results[less].objective(), results[more].objective()
        if b > a * (1 + EQUAL):
            found.append(f"{more} has {b:.4f}, {less} {a:.4f}")
    for dear, cheap in itertools.pairwise(CHEAPER):
        cost = SETTINGS[cheap].get("handle_cost", COST)
        a, b = results[dear].objective(cost), results[cheap].objective(cost)
        if b > a * (1 + EQUAL):
            found.append(f"{cheap} has {b:.4f} at its cost, {dear} {a:.4f}")
        if results[dear].handles > results[cheap].handles:
            found.append(
                f"{dear} has {results[dear].handles} handles, {cheap} {results[cheap].handles}"
            )
    return found


def apart(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances of corresponding colours in the palettes of a clip and of the clip with
    noise of 1/255, at 13 times: found anew, and like the clip's."""
    plain = np.stack([image[..., :3] for _, image in clip])
    noise = np.random.default_rng(0).uniform(-1 / 255, 1 / 255, plain.shape)
    noisy = (plain + noise).clip(0).astype(np.float32)
    old = pipeline.analyze(plain, allow_cuts=True).document
    anew = pipeline.analyze(noisy, allow_cuts=True).document
    like = pipeline.analyze(noisy, AnalysisOptions(method=LIKE), allow_cuts=True, like=old).document
    palettes = [_core.parse_sidecar(sidecar.dumps(one)).polytope for one in (old, anew, like)]
    far: tuple[list[float], list[float]] = ([], [])
    for time_ in np.linspace(0, len(plain) - 1, 13):
        first, *others = (_core.slice_at(palette, time_).rgb for palette in palettes)
        for found, other in zip(far, others, strict=True):
            gaps = cdist(first, other)
            found += gaps[linear_sum_assignment(gaps)].tolist()
    return np.array(far[0]), np.array(far[1])


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("clips", metavar="CLIP[:A-B]", nargs="*")
    parser.add_argument("--drawn", nargs="*", choices=drawn_clips.SCENES, default=[])
    parser.add_argument("--stills", nargs="*", default=[], metavar="PICTURE")
    parser.add_argument("--default-only", action="store_true", help="no other settings")
    parser.add_argument("--noise", action="store_true", help="with noise of 1/255 too")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    args = parser.parse_args()
    settings = list(SETTINGS)[: 1 if args.default_only else None]
    rows, wrong, everything = [], [], {}
    noises = []
    for name, clip in clips(args):
        if args.noise:
            figures = [f(far) for far in apart(clip) for f in (np.mean, np.max)]
            noises.append([name, *(f"{x:.3f}" for x in figures)])
        results = analysed(clip, settings)
        everything[name] = {of: dataclasses.asdict(one) for of, one in results.items()}
        default = results["default"]
        best = min(results, key=lambda of: results[of].objective())
        away = default.objective() / results[best].objective() - 1
        cells = [f"{default.objective():.4f}", f"{default.L_prime:.4f}"]
        cells += [f"{default.handles} ({default.rare})", str(default.blocks), f"{default.cpu:.1f}"]
        rows.append([name, *cells, f"{results[best].objective():.4f}", best, f"{away:.1%}"])
        say(" | ".join(rows[-1]))
        if not args.default_only:
            wrong += [f"- {name}: {text}" for text in broken(results)]
        if args.json:
            args.json.write_text(json.dumps(everything, indent=1))
    heads = ["clip", "default", "L'", "handles (rare)", "blocks", "user CPU s"]
    heads += ["the best", "with", "away"]
    print(table(heads, rows))
    if noises:
        heads = ["clip, with noise", "anew: mean", "largest", "like: mean", "largest"]
        print(table(heads, noises))
    print("\n".join(wrong or ["More of what is allowed never gave less."]))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
