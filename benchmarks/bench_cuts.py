"""Which detector finds sudden cuts more reliably: palette4d's or PySceneDetect's?

Every finder sees the same decoded frames and is judged by cuts that are known: those given with the
clips (looked up by eye), and those of splices made here. A splice puts pieces of 2 to 12 frames
from different shots one after the other; doctored copies of each shot (flashes of one and two
frames, flicker, a fade from black, half its frames repeated, half its size in grain) have no cut.
PySceneDetect's detectors run with their defaults, and with a shortest scene of one frame, since a
palette must not span even a short shot.

    python benchmarks/bench_cuts.py bikes.mp4:30,80,138 still.mp4: [--seed 1]

A clip is given with the frame numbers that begin a new shot. Needs `pip install scenedetect
opencv-python-headless`, which palette4d does not.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import scenedetect
from numpy.typing import NDArray
from palette4d.analysis import colour_statistics
from palette4d.analysis.options import AnalysisOptions

from palette4d.media import cuts
from palette4d.media.clip import open_clip
from palette4d.shows.shots import BINS

Frames = list[NDArray[np.uint8]]
Case = tuple[str, Frames, list[int]]
RATE = 24.0
LARGEST = 320  # pixels across: what the detectors reduce to themselves


def ours(frames: Frames) -> list[int]:
    """Return palette4d's cuts, as --detect-shots finds them."""
    options = AnalysisOptions(colours=BINS, coarse_colours=BINS)
    gathered = [
        colour_statistics.gather(i, frame.astype(np.float32) / 255, options)
        for i, frame in enumerate(frames)
    ]
    return cuts.find_cuts((s.frame, s.histogram) for s in gathered if s is not None)


def theirs(make: Callable[[], scenedetect.SceneDetector]) -> Callable[[Frames], list[int]]:
    """Return a finder that asks a detector of PySceneDetect."""

    def find(frames: Frames) -> list[int]:
        detector = make()
        found = []
        for i, frame in enumerate(frames):
            stamp = scenedetect.FrameTimecode(i, RATE)
            found += detector.process_frame(stamp, np.ascontiguousarray(frame[..., ::-1]))
        found += detector.post_process(scenedetect.FrameTimecode(len(frames), RATE))
        return sorted({int(stamp.frame_num) for stamp in found})

    return find


FINDERS: dict[str, Callable[[Frames], list[int]]] = {"palette4d": ours}
for _name in ("ContentDetector", "AdaptiveDetector", "HistogramDetector", "HashDetector"):
    _kind = getattr(scenedetect, _name)
    FINDERS[_name] = theirs(_kind)
    FINDERS[f"{_name}, 1 frame"] = theirs(lambda kind=_kind: kind(min_scene_len=1))


def read(spec: str) -> Frames:
    """Return a clip's frames, 8 bit, at most `LARGEST` pixels across."""
    clip = open_clip(spec)
    by = max(1, clip.width // LARGEST)
    return [
        np.rint(np.clip(image[::by, ::by, :3], 0, 1) * 255).astype(np.uint8) for _, image in clip
    ]


def shots_of(frames: Frames, starts: list[int]) -> list[Frames]:
    """Return the shots between known cuts."""
    bounds = [0, *starts, len(frames)]
    return [frames[a:b] for a, b in itertools.pairwise(bounds) if b - a >= 4]


def splices(shots: list[Frames], random: np.random.Generator, count: int) -> Iterator[Case]:
    """Yield pieces of shots put together, at lengths from 2 to 12 frames."""
    shape = min((shot[0].shape for shot in shots), key=lambda s: s[0] * s[1])
    for number in range(count):
        pieces: list[Frames] = []
        last = -1
        for _ in range(4):
            which = int(random.choice([i for i in range(len(shots)) if i != last]))
            length = min(int(random.integers(2, 13)), len(shots[which]))
            start = int(random.integers(0, len(shots[which]) - length + 1))
            pieces.append([fitted(f, shape) for f in shots[which][start : start + length]])
            last = which
        starts = np.cumsum([len(piece) for piece in pieces])[:-1].tolist()
        yield f"splice {number}", [f for piece in pieces for f in piece], starts


def fitted(frame: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return a frame sampled to another size."""
    rows = np.arange(shape[0]) * frame.shape[0] // shape[0]
    columns = np.arange(shape[1]) * frame.shape[1] // shape[1]
    return np.ascontiguousarray(frame[rows][:, columns])


def doctored(name: str, shot: Frames, random: np.random.Generator) -> Iterator[Case]:
    """Yield what is no cut: flashes, flicker, a fade, repeated frames, grain."""
    light = [frame.astype(float) for frame in shot]

    def case(kind: str, pictures: Iterable[NDArray[np.float64]]) -> Case:
        rounded = [np.rint(np.clip(p, 0, 255)).astype(np.uint8) for p in pictures]
        return f"{name}, {kind}", rounded, []

    middle = len(light) // 2
    for length in (1, 2):
        lit = [p if not 0 <= i - middle < length else p * 0.15 + 215 for i, p in enumerate(light)]
        yield case(f"flash of {length}", lit)
    yield case("flicker", [p * (1 + 0.1 * random.standard_normal()) for p in light])
    yield case("fade", [p * min(1, i / 10) for i, p in enumerate(light)])
    yield case("on twos", [light[i - i % 2] for i in range(len(light))])
    yield case("grain", [p + 12 * random.standard_normal(p.shape) for p in light])


def main() -> None:
    """Print how many cuts each finder finds, misses and invents."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("clips", nargs="+", metavar="CLIP:CUT,CUT", help="a clip and its cuts")
    parser.add_argument("--splices", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    random = np.random.default_rng(args.seed)
    groups: dict[str, list[Case]] = {"footage": [], "splices": [], "no cut": []}
    shots: list[Frames] = []
    for text in args.clips:
        spec, _, known = text.rpartition(":")
        starts = [int(number) for number in known.split(",") if number]
        frames = read(spec)
        groups["footage"].append((Path(spec).name, frames, starts))
        own = shots_of(frames, starts)
        shots += own
        for i, shot in enumerate(own):
            groups["no cut"] += [
                (f"{Path(spec).name} shot {i}", shot, []),
                *doctored(f"{Path(spec).name} shot {i}", shot, random),
            ]
    if len(shots) > 1:
        groups["splices"] = list(splices(shots, random, args.splices))
    for group, cases in groups.items():
        known_cuts = sum(len(starts) for _, _, starts in cases)
        count = sum(len(frames) for _, frames, _ in cases)
        print(f"{group}: {len(cases)} clips, {count} frames, {known_cuts} cuts")
        for name, find in FINDERS.items():
            hit = missed = false = 0
            wrong = []
            started = time.process_time()
            for title, frames, starts in cases:
                found = find(frames)
                hit += len(set(found) & set(starts))
                missed += len(set(starts) - set(found))
                false += len(set(found) - set(starts))
                if set(found) != set(starts):
                    wrong.append(f"{title}: {found} for {starts}")
            took = (time.process_time() - started) / max(1, count) * 1000
            print(
                f"  {name:<28} {hit:>4} found {missed:>4} missed {false:>4} invented   "
                f"{took:.1f} ms of CPU a frame"
            )
            if name == "palette4d":
                print("\n".join(f"      {line}" for line in wrong[:20]))


if __name__ == "__main__":
    main()
