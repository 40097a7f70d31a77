"""What the benchmarks share: running the command, and measuring palettes with every pixel.

A sidecar is turned into a polyhedron for every frame, and the vertices and edges in time. It is
measured by the core's exact distances on all colours of the clip, nothing binned. A test compares
these figures with those of an independent program.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import NO_FACES, smoothness
from scipy.spatial import ConvexHull, QhullError

from palette4d import _core
from palette4d.media.clip import open_clip

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

LAMBDA, K_PIXELS, GAMMA = 50.0, 50.0, 0.01  # the paper's
STEPS = 65535  # every 8- or 16-bit colour is a whole number of these
LARGEST = 2**20  # of colours that are counted as such numbers
# The paper's rules and nothing of this program's: no shape terms, the authors' merge distance.
PAPER_RULES = (
    *("--method", "paper", "--set", "convexity=0", "--set", "separation=0"),
    *("--set", "reach=0"),
    *("--set", "merge_distance=0.1"),
)


@dataclasses.dataclass(frozen=True)
class Cut:
    """One frame's polyhedron: (n, 3) colours, (f, 3) triangles (none where they are not known),
    and which pairs of colours, (n, n), are on their way out of one vertex or into one."""

    rgb: F64
    faces: I32
    related: NDArray[np.bool_]

    def closest(self) -> float:
        """Return the least distance of two colours, related ones aside; inf for one colour."""
        gaps = np.linalg.norm(self.rgb[:, None] - self.rgb[None], axis=2)
        gaps[self.related] = np.inf
        return float(gaps.min())

    def concavity(self) -> float:
        """Return the share of its convex hull that the polyhedron lacks; nan without faces."""
        if len(self.rgb) < 4:
            return 0.0
        if len(self.faces) == 0:
            return float("nan")
        try:
            hull = ConvexHull(self.rgb).volume
        except QhullError:  # flat: nothing to be concave
            return 0.0
        a, b, c = (self.rgb[self.faces[:, i]] - self.rgb[0] for i in range(3))
        volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
        # A mesh that is turned inside out has a negative volume: it lacks everything.
        return float(np.clip(1.0 - volume / hull, 0.0, 1.0))


@dataclasses.dataclass(frozen=True)
class TimedPalette:
    """A palette in time: a cut for each frame number; (n, 4) vertices r, g, b, frame and (m, 2)
    edges, none where frames are independent; (first, last) of each block."""

    cuts: Mapping[int, Cut]
    vertices: F64
    edges: I32
    blocks: Sequence[tuple[float, float]]

    @classmethod
    def of_sidecar(cls, path: Path) -> TimedPalette:
        """Slice a sidecar's polytope at the frames that were analysed."""
        document = json.loads(path.read_text(encoding="utf-8"))
        polytope = _core.read_sidecar(str(path)).polytope
        f = document["clip"]["frames"]
        numbers = set(range(f["first"], f["last"] + 1, f["step"])) - set(f["skipped"])
        cuts = {}
        for number in sorted(numbers):
            cut = _core.slice_at(polytope, float(number))
            related = (cut.ends[:, None] == cut.ends[None]).any(axis=2)
            cuts[number] = Cut(cut.rgb, cut.faces, related)
        blocks = [(s["first"], s["last"]) for s in polytope.sections if not s["transition"]]
        return cls(cuts, polytope.vertices, polytope.edges, blocks)

    @classmethod
    def of_hulls(cls, palettes: Mapping[int, tuple[F64, I32]]) -> TimedPalette:
        """Take colours and faces of frames that know nothing of each other."""
        cuts = {
            n: Cut(rgb, faces, np.eye(len(rgb), dtype=bool)) for n, (rgb, faces) in palettes.items()
        }
        return cls(cuts, np.zeros((0, 4)), np.zeros((0, 2), np.int32), [])

    @property
    def length(self) -> float:
        """Return the clip's length in frames, 1 for a single frame."""
        return max(float(max(self.cuts) - min(self.cuts)), 1.0)


@dataclasses.dataclass(frozen=True)
class Figures:
    """Means over the frames: R, C, L (eqs. 2 to 4), K (eq. 11), L' (eq. 12), share of pixels
    outside, colours a frame; the farthest pixel, the least distance of two colours at one time and
    the deepest concavity of all frames."""

    vertices: int
    blocks: int
    colours: float
    R: float
    C: float
    L: float
    K: float
    L_prime: float
    outside: float
    farthest: float
    closest: float
    concavity: float


def measure(
    clip: str, palettes: Mapping[str, TimedPalette], frames: str | None = None
) -> dict[str, Figures]:
    """Measure palettes on every pixel of the clip, in one pass over it."""
    rows: dict[str, list[list[float]]] = {name: [] for name in palettes}
    weights = _core.LossWeights(LAMBDA, K_PIXELS)
    for number, image in open_clip(clip, frames=frames).iter_colours():
        rgb, counts = distinct_colours(image)
        if len(rgb) == 0:
            continue
        tree = _core.ColourTree(rgb, counts)
        for name, palette in palettes.items():
            row = _core.palette_loss(tree, palette.cuts[number].rgb, NO_FACES, weights)
            rows[name].append([row[0], row[1], row[3], row[4]])
    return {name: _figures(palettes[name], np.array(rows[name])) for name in palettes}


def distinct_colours(image: NDArray[np.float32]) -> tuple[F64, F64]:
    """Return an image's distinct (n, 3) colours, and how many pixels have each."""
    pixels = image.reshape(-1, image.shape[-1])[:, :3]
    rgb = pixels[np.isfinite(pixels).all(axis=1)].astype(np.float64)
    return merged_colours(unrounded(rgb), np.ones(len(rgb)))


def merged_colours(rgb: F64, counts: F64) -> tuple[F64, F64]:
    """Add up the (n,) counts of equal (n, 3) colours; floats of 32 bits keep what they have."""
    codes = np.rint(rgb * STEPS).astype(np.int64) + LARGEST
    if len(rgb) and (codes.min() < 0 or codes.max() >= 2 * LARGEST or (rgb != _steps(rgb)).any()):
        unique, where = np.unique(rgb, axis=0, return_inverse=True)
    else:
        packed, where = np.unique(codes @ (1 << np.array([42, 21, 0])), return_inverse=True)
        channels = packed[:, None] >> np.array([42, 21, 0]) & (2 * LARGEST - 1)
        unique = (channels - LARGEST) / STEPS
    return unique, np.bincount(where.ravel(), counts, len(unique))


def _steps(rgb: F64) -> F64:
    """Return the nearest 16-bit colours; the same doubles as k / 255 where they are 8-bit ones."""
    return np.rint(rgb * STEPS) / STEPS


def unrounded(rgb: F64) -> F64:
    """Return colours that were read as float32 at the 8- or 16-bit steps that they stand for.

    Eq. 3 shares what pixels at the same distance weigh, and rounding would part them: by up to
    2e-5 of C in a frame, for a palette colour with hundreds of pixels at its 50th distance.
    """
    exact = _steps(rgb)
    out: F64 = np.where(np.abs(rgb - exact) < 1e-7, exact, rgb)
    return out


def _figures(palette: TimedPalette, rows: F64) -> Figures:
    r, c, outside, _ = rows.mean(axis=0)
    loss = LAMBDA * r + c
    k, _ = smoothness(palette.vertices, palette.edges, palette.length)
    cuts = palette.cuts.values()
    return Figures(
        vertices=len(palette.vertices),
        blocks=len(palette.blocks),
        colours=float(np.mean([len(cut.rgb) for cut in cuts])),
        R=float(r),
        C=float(c),
        L=float(loss),
        K=k,
        L_prime=float(loss + GAMMA * k),
        outside=float(outside),
        farthest=float(rows[:, 3].max()),
        closest=min(cut.closest() for cut in cuts),
        concavity=max(cut.concavity() for cut in cuts),
    )


# ---- the command


def analyze(clip: str, sidecar: Path, options: Iterable[str] = ()) -> dict[str, Any]:
    """Run `palette4d analyze` on the clip in a process of its own; return its `--json` report."""
    command = [sys.executable, "-m", "palette4d", "analyze", clip, "-o", str(sidecar), "--json"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{done.stderr}stopped: palette4d analyze ended with {done.returncode}")
    report: dict[str, Any] = json.loads(done.stdout)
    return report


class Runs:
    """Analyses of one clip, each done once, kept in a folder."""

    def __init__(self, clip: str, frames: str | None, folder: Path) -> None:
        self.clip, self.folder = clip, folder
        self.always = ("--frames", frames) if frames else ()
        self.reports: dict[tuple[str, ...], dict[str, Any]] = {}

    def __call__(self, *options: str) -> dict[str, Any]:
        """Return the report of an analysis with these options."""
        if options not in self.reports:
            started = time.perf_counter()
            path = self.folder / f"{len(self.reports)}.p4d.json"
            report = analyze(self.clip, path, (*self.always, *options))
            self.reports[options] = report
            took = time.perf_counter() - started
            say(f"analyze {' '.join(options)}: {took:.1f} s, {report['cpu_seconds']:.1f} s of CPU")
        return self.reports[options]

    def path(self, *options: str) -> Path:
        """Return the sidecar of an analysis."""
        return Path(self(*options)["sidecar"])

    def palette(self, *options: str) -> TimedPalette:
        """Return the palette of an analysis."""
        return TimedPalette.of_sidecar(self.path(*options))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what all benchmarks of palettes take."""
    parser.add_argument("clip", metavar="CLIP", help="image sequence, folder or movie")
    parser.add_argument("--frames", metavar="A-B[xN]", help="only these frames")


# ---- text


def say(text: str) -> None:
    """Print progress: on stderr, so that stdout is the tables alone."""
    print(text, file=sys.stderr, flush=True)


def table(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a Markdown table; None becomes -."""
    lines = [header, ["---"] * len(header)]
    lines += [["-" if cell is None else str(cell) for cell in row] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


FIT_HEADER = ("R", "C", "L", "K", "L'", "outside", "farthest")


def fit_cells(x: Figures) -> list[str | None]:
    """Return the cells below `FIT_HEADER`; frames that are independent have no K."""
    smooth = [f"{x.K:.3f}", f"{x.L_prime:.4f}"] if x.vertices else [None, None]
    return [
        *(f"{x.R:.5f}", f"{x.C:.4f}", f"{x.L:.4f}", *smooth),
        *(f"{x.outside:.1%}", f"{x.farthest:.3f}"),
    ]


def share(x: float, digits: int = 0) -> str | None:
    """Return a share as a percentage, None when it is not known."""
    return None if np.isnan(x) else f"{x:.{digits}%}"
