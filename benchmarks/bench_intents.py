"""How well can each method of section 6.2 follow the intents of figure 11?

Figure 11 wants four changes of SEASONS: darker earth in spring, greener leaves in summer, redder
leaves in autumn, whiter fallen leaves in winter. An intent is a colour of one frame, and the colour
that it should become. Least squares take the place of a user: of all edits of a palette they find
the one nearest to the four intents, with a small cost for moved handles. The sky should stay.

    python benchmarks/bench_intents.py SEASONS [--out FIGURE.png]

Methods for images take one edit for the whole clip, or one at each end and linear ones between, as
in section 6.2. Prints Markdown: CIEDE2000 from the wanted colour for each intent, and how far the
sky changes. `--out` takes the four frames, recoloured by each method. Figure 12's clip is not
public.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import chang
import numpy as np
from evaluator import PAPER_RULES, Runs, distinct_colours, table
from numpy.typing import NDArray
from scipy.optimize import least_squares
from skimage.color import lab2rgb, rgb2lab
from skimage.io import imsave

from palette4d import _core
from palette4d.colour.difference import delta_e_2000
from palette4d.media.clip import open_clip

F64 = NDArray[np.float64]
# Recolours (n, 3) code values of a frame.
Recolour = Callable[[float, F64], F64]

# Frame; rows, columns of a region whose median is the colour; its change in CIELAB: what L* gains,
# what a* gains, a factor of a* and b*.
INTENTS: Mapping[str, tuple[int, slice, slice, float, float, float]] = {
    "spring: darker earth": (0, slice(300, 370), slice(60, 640), -15, 0, 1),
    "summer: greener leaves": (22, slice(60, 300), slice(30, 380), 0, -12, 1),
    "autumn: redder leaves": (36, slice(20, 160), slice(200, 640), 0, 30, 1),
    "winter: whiter fallen leaves": (49, slice(320, 370), slice(60, 640), 15, 0, 0.4),
}
# The cost of a moved handle: its squared RGB distance, against that of a missed intent.
COST = 0.01
# Cap on the iterations of the fit to k-means palettes; more change no figure by 0.1.
FITTING = 40
# The sky is measured in every n-th frame: bluish pixels lighter than this.
STEP, SKY_LIGHTNESS = 7, 60.0


def edit_of_polytope(path: Path, frames: F64, colours: F64, wanted: F64, ends: bool) -> Recolour:
    """Fit the edits of a sidecar's handles; recolouring is linear in them.

    Without `ends` handles of a static palette at both ends of the clip get the same edit.
    """
    polytope = _core.read_sidecar(str(path)).polytope

    def weights(frame: float, rgb: F64) -> F64:
        return _core.polytope_weights(rgb, polytope, frame)

    rows = np.vstack([weights(t, c[None]) for t, c in zip(frames, colours, strict=True)])
    tied = np.eye(rows.shape[1])
    if not ends:  # `--method static`: the handles of the first frame, then those of the last
        tied = np.vstack([np.eye(len(tied) // 2)] * 2)
    matrix = rows @ tied
    normal = matrix.T @ matrix + COST * np.eye(matrix.shape[1])
    moves = tied @ np.linalg.solve(normal, matrix.T @ (wanted - colours))
    return lambda frame, rgb: np.clip(rgb + weights(frame, rgb) @ moves, 0, 1)


def edit_of_clusters(palette: F64, frames: F64, colours: F64, wanted: F64, ends: bool) -> Recolour:
    """Fit the edit of a k-means palette, or with `ends` those of the first and the last frame."""
    last = max(frames)

    def transfer(edits: F64, frame: float) -> chang.Transfer:
        first, *others = (
            chang.edited(palette, list(enumerate(palette + edit)))
            for edit in edits.reshape(-1, *palette.shape)
        )
        return chang.Transfer.at(palette, first, others[0] if others else first, frame / last)

    def misses(edits: F64) -> F64:
        results = [
            transfer(edits, t)(colour[None])[0] for t, colour in zip(frames, colours, strict=True)
        ]
        edited = (palette + edits.reshape(-1, *palette.shape)).reshape(-1, 3)
        moved = chang.srgb(edited) - np.resize(chang.srgb(palette), edited.shape)
        return np.concatenate([np.ravel(results - wanted), np.sqrt(COST) * moved.ravel()])

    def slopes(edits: F64) -> F64:  # the transfer has kinks: one unit of CIELAB sees past them
        return (
            np.stack([misses(edits + step) for step in np.eye(len(edits))], 1)
            - misses(edits)[:, None]
        )

    start = np.zeros(palette.size * (2 if ends else 1))
    edits = least_squares(misses, start, slopes, x_scale=10.0, max_nfev=FITTING).x
    return lambda frame, rgb: transfer(edits, frame).cached()(np.clip(rgb, 0, 1))


def main() -> None:
    """Fit and measure every method."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("clip", metavar="SEASONS", help="the paper's clip: 50 frames of 696x380")
    parser.add_argument("--out", metavar="FIGURE.png", type=Path, help="write the frames here")
    args = parser.parse_args()
    images = {n: image[..., :3].astype(float) for n, image in open_clip(args.clip).iter_colours()}
    frames = np.array([frame for frame, *_ in INTENTS.values()], float)
    colours = np.array(
        [np.median(images[n][rows, columns], (0, 1)) for n, rows, columns, *_ in INTENTS.values()]
    )
    lab = rgb2lab(colours)
    for colour, (*_, lightness, a, chroma) in zip(lab, INTENTS.values(), strict=True):
        colour += lightness, a, 0
        colour[1:] *= chroma
    wanted = np.asarray(lab2rgb(lab))
    problem = frames, colours, wanted
    palette = chang.extract(*chang.binned(distinct_colours(image) for image in images.values()))
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(args.clip, None, Path(folder))
        static = runs.path("--method", "static")
        methods = {
            "skew polytope, default": edit_of_polytope(runs.path(), *problem, ends=True),
            "skew polytope, the paper's rules": edit_of_polytope(
                runs.path(*PAPER_RULES), *problem, ends=True
            ),
            "RGB hull, one edit": edit_of_polytope(static, *problem, ends=False),
            "RGB hull, two key frames": edit_of_polytope(static, *problem, ends=True),
            "k-means, one edit": edit_of_clusters(palette, *problem, ends=False),
            "k-means, two key frames": edit_of_clusters(palette, *problem, ends=True),
            "hull in RGB and time": edit_of_polytope(
                runs.path("--method", "rgbt"), *problem, ends=True
            ),
        }
        rows = [[name, *measured(recolour, problem, images)] for name, recolour in methods.items()]
        if args.out:
            draw(methods, images, args.out)
    print(table(["method", *INTENTS, "sky"], rows))


def measured(
    recolour: Recolour, problem: tuple[F64, F64, F64], images: Mapping[int, F64]
) -> list[str]:
    """Return the cells of a method: how far each intent is missed, and how far the sky changes."""
    missed = [
        float(delta_e_2000(rgb2lab(recolour(frame, colour[None])), rgb2lab(wish[None]))[0])
        for frame, colour, wish in zip(*problem, strict=True)
    ]
    changes = []
    for frame in list(images)[::STEP]:
        rgb, counts = distinct_colours(images[frame])
        lab = rgb2lab(rgb)
        sky = (lab[:, 0] > SKY_LIGHTNESS) & (lab[:, 2] < 0)
        after = rgb2lab(recolour(frame, rgb[sky]))
        changes.append(np.average(delta_e_2000(lab[sky], after), weights=counts[sky]))
    return [f"{x:.1f}" for x in (*missed, float(np.mean(changes)))]


def draw(methods: Mapping[str, Recolour], images: Mapping[int, F64], output: Path) -> None:
    """Draw the frames of the intents, original and recoloured, a row a method."""
    frames = [frame for frame, *_ in INTENTS.values()]
    rows: list[Recolour] = [lambda frame, rgb: rgb, *methods.values()]
    picture = np.vstack(
        [
            np.hstack(
                [
                    recolour(n, images[n][::2, ::2].reshape(-1, 3)).reshape(
                        images[n][::2, ::2].shape
                    )
                    for n in frames
                ]
            )
            for recolour in rows
        ]
    )
    imsave(output, (picture * 255).round().astype(np.uint8))


if __name__ == "__main__":
    main()
