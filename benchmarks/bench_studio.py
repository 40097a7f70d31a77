"""Is the window quick enough to grade in? Latencies, playback and memory, without a screen.

    python benchmarks/bench_studio.py SIDECAR CLIP [--times 200] [--size 1400x1000] [--hd HD.mov]
        [--long LONG.mp4] [--parts cold small large play memory]

SIDECAR and CLIP are a small clip (SEASONS). `--hd` and `--long` name movies of 1920x1080 with 120
and 800 frames; where they do not exist they are made from CLIP (some minutes). Each figure is the
95th percentile, with the median in brackets and the processor time of all threads a step, beside
the bar and the goal of the design. The peer is OpenImageIO's `ociodisplay` of the picture at the
size of the viewer, one thread: what any viewer does for a frame. A drag counts from the gesture
until the window has painted the picture of that colour. Others who use the machine make all
figures worse, the peer's too.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

os.environ["QT_QPA_PLATFORM"] = "offscreen"

import numpy as np
import OpenImageIO as oiio
from PySide6.QtCore import QEventLoop, QPoint, QSettings, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from palette4d.colour.ocio_config import BUILT_IN
from palette4d.grade.document import Document
from palette4d.grade.picks import Pick
from palette4d.media.clip import open_clip
from palette4d.media.movie_writer import movie_writer
from palette4d.studio import theme
from palette4d.studio.pixels import probe_at
from palette4d.studio.player import resampled
from palette4d.studio.preview import Picture
from palette4d.studio.session import Session
from palette4d.studio.window import Window

HD = (1920, 1080)
#: Seconds between two moves of a mouse.
PACE = 1 / 30


def make_movie(clip: str, out: Path, count: int) -> None:
    """Write a movie of 1920x1080 with the clip's frames, there and back, slowly moving."""
    opened = open_clip(clip)
    frames = [*opened.frames, *opened.frames[-2:0:-1]]
    y = np.arange(HD[1])[:, None] * opened.height // HD[1]
    x = np.arange(HD[0])[None, :] * opened.width // HD[0]
    with movie_writer(out, HD, opened.rate) as append:
        for k in range(count):
            pixels = opened.read(frames[k * len(frames) // count % len(frames)])[..., :3]
            append(np.ascontiguousarray(np.roll(pixels[y, x], k, axis=1)), False)


def stretched(sidecar: Path, clip: str, out: Path) -> Path:
    """Write the sidecar, without edits, with its times stretched to another clip's frames."""
    document = Document.load(sidecar)
    document.reset()
    for name in document.grade.versions:
        document.remove_version(name)
    document.forget_history()
    fields = document.fields()
    opened = open_clip(clip)
    was = fields["clip"]["frames"]
    scale = (opened.frames[-1] - opened.frames[0]) / (was["last"] - was["first"])

    def moved(frame: float) -> float:
        return round(opened.frames[0] + (frame - was["first"]) * scale, 6)

    for vertex in fields["polytope"]["vertices"]:
        vertex["frame"] = moved(vertex["frame"])
    for block in fields["polytope"]["blocks"]:
        block["first"], block["last"] = moved(block["first"]), moved(block["last"])
    fields["clip"] |= {
        "source": str(Path(clip).absolute()),
        "name": Path(clip).stem,
        "size": [opened.width, opened.height],
        "frames": {
            "first": opened.frames[0],
            "last": opened.frames[-1],
            "step": 1,
            "skipped": [],
        },
    }
    fields.pop("colours", None)
    Document(fields).save(out, on_edits="drop")
    return out


class Bench:
    """One window."""

    def __init__(self, app: QApplication, path: Path, clip: str | None, size: tuple[int, int]):
        self.app = app
        settings = QSettings(str(path.with_suffix(".ini")), QSettings.Format.IniFormat)
        self.window = Window(Session(), settings)
        self.window.resize(*size)
        self.window.show()
        self.window.arrange()
        self.window.open_path(str(path), clip)
        self.session = self.window.session
        self.drawn: Picture | None = None  #: the picture that was painted last
        painter = self.window.viewer.painter
        self._paints, painter.paint = painter.paint, self._paint
        self.wait(self.settled)

    def wait(self, ready: Callable[[], bool], seconds: float = 20) -> None:
        """Handle events until something is so."""
        end = time.perf_counter() + seconds
        flags = QEventLoop.ProcessEventsFlag
        while not ready():
            # As the window's own loop: it sleeps until something happens.
            self.app.processEvents(flags.AllEvents | flags.WaitForMoreEvents)
            if time.perf_counter() > end:
                raise TimeoutError(self.session.status.text)

    def _paint(self) -> None:
        self._paints()
        self.drawn = self.window.viewer.picture

    def current(self) -> bool:
        """Whether the picture of now is painted."""
        viewer = self.window.viewer
        return viewer.current and self.drawn is viewer.picture

    def settled(self) -> bool:
        """Whether that is the exact one."""
        return self.current() and self.drawn is not None and self.drawn.exact

    def peer(self, times: int) -> Iterator[float]:
        """Have OpenImageIO show the frame's picture; yield the seconds of each time."""
        viewer, session = self.window.viewer, self.session
        assert session.player is not None
        region = viewer.region()
        assert region is not None
        source = oiio.ImageBuf(resampled(session.player.read(session.frame), region))
        for _ in range(times):
            start = time.perf_counter()
            shown = oiio.ImageBufAlgo.ociodisplay(
                source,
                "sRGB - Display",
                "Un-tone-mapped",
                "sRGB - Texture",
                nthreads=1,
                colorconfig=BUILT_IN,
            )
            assert not shown.has_error, shown.geterror()
            shown.get_pixels(oiio.UINT8)
            yield time.perf_counter() - start

    def handle(self) -> None:
        """Select the brightest colour's handle."""
        document = self.session.document
        assert document is not None
        palette = document.grade.palette(self.session.frame)
        bright = int(np.argmax(np.asarray(palette.rgb).sum(axis=1)))
        self.session.select(palette.ends[bright][0])
        self.rest()

    def place(self) -> None:
        """Click the middle of the picture, and wait until what a pick there takes is learned."""
        clip = self.session.clip
        assert clip is not None
        viewer = self.window.viewer
        QTest.mouseClick(
            viewer,
            Qt.MouseButton.LeftButton,
            pos=viewer.point_of(clip.width / 2, clip.height / 2).toPoint(),
        )
        self.rest()

    def drags(self, times: int, begin: Callable[[], None]) -> Iterator[float]:
        """Drag in the inspector's wheel; yield the seconds of each step.

        Moves come as a mouse sends them, `PACE` seconds apart, so that panels get their turns.
        """
        begin()
        wheel = self.window.inspector.wheel
        rng = np.random.default_rng(3)
        middle, radius = wheel.rect().center(), wheel.width() / 2 - 6
        before = len(self.picks())
        QTest.mousePress(wheel, Qt.MouseButton.LeftButton, pos=middle)
        self.wait(self.current)
        for turn, reach in zip(
            2 * np.pi * np.cumsum(0.02 + 0.03 * rng.random(times)),
            radius * (0.3 + 0.5 * rng.random(times)),
            strict=True,
        ):
            to = middle + QPoint(round(reach * np.cos(turn)), round(reach * np.sin(turn)))
            start, revision = time.perf_counter(), self.session.revision
            QTest.mouseMove(wheel, to)
            self.wait(lambda old=revision: self.session.revision > old and self.current())
            took = time.perf_counter() - start
            self.pause(PACE - took)
            yield took
        QTest.mouseRelease(wheel, Qt.MouseButton.LeftButton, pos=middle)
        self.rest()
        assert len(self.picks()) > before or begin != self.place

    def picks(self) -> tuple[Pick, ...]:
        """Return the picks of the document."""
        return () if self.session.document is None else self.session.document.grade.picks

    def pause(self, seconds: float) -> None:
        """Handle events for a time."""
        QTest.qWait(max(0, round(seconds * 1e3)))

    def rest(self) -> None:
        """Wait until nothing is done any more."""
        self.wait(lambda: self.window.settled and not self.session.following, 120)
        self.wait(self.settled)

    def jumps(self, times: int, *, cached: bool, shown: bool = False) -> Iterator[float]:
        """Go to frames, decoded before or not, shown before or not; yield the seconds of each."""
        first, last, _ = self.session.frames
        player = self.session.player
        assert player is not None
        rng = np.random.default_rng(4)
        near = [first + k for k in range(min(5, last - first))]
        for frame in near if cached else ():
            player.read(frame)
        for frame in near if shown else ():
            self.session.go(frame)
            self.wait(self.settled)
        for _ in range(times):
            frame = self.session.frame
            while frame == self.session.frame:
                frame = int(rng.choice(near)) if cached else int(rng.integers(first, last + 1))
            if not cached:
                player._frames.clear()
            if not shown:
                self.window.viewer.preview.forget()
            start = time.perf_counter()
            self.session.go(frame)
            self.wait(self.current)
            yield time.perf_counter() - start
            self.wait(self.settled)

    def probes(self, times: int) -> Iterator[float]:
        """Move the pointer; yield the seconds of each step."""
        clip = self.session.clip
        assert clip is not None
        rng = np.random.default_rng(6)
        for _ in range(times):
            x, y = int(rng.integers(clip.width)), int(rng.integers(clip.height))
            start = time.perf_counter()
            self.session.show_probe(probe_at(self.session, x, y))
            self.app.processEvents()
            self.window.viewer.repaint()
            yield time.perf_counter() - start

    def playback(self) -> list[tuple[int, int, float, float]]:
        """Play twice; return shown and dropped frames, the rate and the CPU seconds of a frame."""
        first, last, _ = self.session.frames
        count = last - first + 1
        self.session.go(first)
        self.wait(self.settled)
        passes = []
        playback = self.window.playback
        self.session.play(1)
        for _ in range(2):
            shown, dropped, start = playback.shown, playback.dropped, time.perf_counter()
            used = time.process_time()
            target = shown + dropped + count
            self.wait(lambda target=target: playback.shown + playback.dropped >= target, 300)
            passes.append(
                (
                    playback.shown - shown,
                    playback.dropped - dropped,
                    (playback.shown - shown) / (time.perf_counter() - start),
                    (time.process_time() - used) / max(playback.shown - shown, 1),
                )
            )
        self.session.play(0)
        return passes

    def close(self) -> None:
        """Close the window."""
        self.window.shut()
        self.window.close()


def show(name: str, steps: Iterable[float], bar: float, goal: float) -> None:
    """Print a row: the 95th percentile, the median, the bar and the goal in milliseconds."""
    seconds, used = [], []
    for took in steps:  # not what comes before the first step, and after the last one
        seconds.append(took)
        used.append(time.process_time())
    cpu = (used[-1] - used[0]) / max(len(used) - 1, 1) * 1e3
    worst = float(np.percentile(seconds, 95)) * 1e3
    middle = statistics.median(seconds) * 1e3
    verdict = "goal" if worst <= goal else "bar" if worst <= bar else "MISSED"
    print(
        f"{name:<42} {worst:7.1f} ({middle:6.1f}) ms  cpu {cpu:6.1f} ms   "
        f"{bar:g} / {goal:g} ms   {verdict}",
        flush=True,
    )


def cold(path: Path, clip: str) -> float:
    """Return the seconds from the command until the window has its first picture."""
    program = (
        "import sys, time\n"
        "from palette4d.studio import app\n"
        "app.run(sys.argv[1], clip=sys.argv[2], until_shown=True)\n"
    )
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", program, str(path), clip], check=True)
    return time.perf_counter() - start


def show_memory(app: QApplication, sidecar: Path, size: tuple[int, int]) -> None:
    """Play a clip twice, and print the most memory that was used."""
    bench = Bench(app, sidecar, None, size)
    passes = bench.playback()
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    verdict = "goal" if used <= 1.5 else "bar" if used <= 2 else "MISSED"
    first, last, _ = bench.session.frames
    print(f"{last - first + 1} frames, shown and dropped: {[each[:2] for each in passes]}")
    print(f"{'memory':<42} {used:7.2f} GB   2 / 1.5 GB   {verdict}", flush=True)
    bench.close()


def small_clip(
    app: QApplication, sidecar: Path, clip: str, times: int, size: tuple[int, int]
) -> None:
    """Print the latencies with the small clip, about 960x540 on screen."""
    bench = Bench(app, sidecar, clip, (1290, size[1]))
    viewer = bench.window.viewer
    print(f"  viewer {viewer.width()}x{viewer.height()}")
    show("peer, small clip", bench.peer(times), 33, 16)
    show("drag a handle, small clip", bench.drags(times, bench.handle), 33, 16)
    show("drag a new pick, small clip", bench.drags(times, bench.place), 33, 16)
    show("drag that pick, small clip", bench.drags(times, lambda: None), 33, 16)
    show("jump, shown before, small clip", bench.jumps(times, cached=True, shown=True), 50, 33)
    show("jump, decoded, small clip", bench.jumps(times, cached=True), 50, 33)
    show("weights under the pointer, small clip", bench.probes(times), 50, 33)
    bench.close()


def large_clip(app: QApplication, sidecar: Path, times: int) -> None:
    """Print the latencies with 1920x1080, fitted."""
    bench = Bench(app, sidecar, None, (2400, 1350))
    viewer = bench.window.viewer
    print(f"  viewer {viewer.width()}x{viewer.height()}")
    show("peer, 1080p fitted", bench.peer(times), 50, 33)
    show("drag a handle, 1080p fitted", bench.drags(times, bench.handle), 50, 33)
    show("drag a new pick, 1080p fitted", bench.drags(times, bench.place), 50, 33)
    show("drag that pick, 1080p fitted", bench.drags(times, lambda: None), 50, 33)
    show("jump, shown before, 1080p", bench.jumps(times, cached=True, shown=True), 50, 33)
    show("jump, decoded, 1080p", bench.jumps(times, cached=True), 50, 33)
    show("jump, not decoded, 1080p", bench.jumps(times, cached=False), 200, 150)
    show("weights under the pointer, 1080p", bench.probes(times), 50, 33)
    bench.close()


def play(app: QApplication, sidecar: Path, size: tuple[int, int]) -> None:
    """Print what playing 1920x1080 twice drops."""
    bench = Bench(app, sidecar, None, size)
    for number, (shown, dropped, rate, cpu) in enumerate(bench.playback(), 1):
        verdict = ("goal" if not dropped else "") if number == 1 else "MISSED" if dropped else "bar"
        print(
            f"playback 1080p, pass {number}: {shown} shown, {dropped} dropped, {rate:.1f} fps, "
            f"cpu {cpu * 1e3:.1f} ms a frame   {verdict}",
            flush=True,
        )
    bench.close()


def main() -> None:
    """Run the parts, and print the table."""
    parts = ("cold", "small", "large", "play", "memory")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sidecar", type=Path)
    parser.add_argument("clip")
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--size", default="1400x1000")
    parser.add_argument("--hd", type=Path, default=Path("build/bench_hd.mov"))
    parser.add_argument("--long", type=Path, default=Path("build/bench_long.mp4"))
    parser.add_argument("--parts", nargs="+", choices=parts, default=parts, help="default: all")
    args = parser.parse_args()
    size = tuple(map(int, args.size.split("x")))
    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    theme.dress(app)
    sys.setswitchinterval(0.001)  # as `studio.app` does
    movies = {"large": (args.hd, 120), "play": (args.hd, 120), "memory": (args.long, 800)}
    for path, count in dict.fromkeys(movies[part] for part in args.parts if part in movies):
        if not path.exists():
            print(f"making {path}", flush=True)
            path.parent.mkdir(parents=True, exist_ok=True)
            make_movie(args.clip, path, count)
    folder = Path(tempfile.mkdtemp(prefix="palette4d-bench-"))
    small = folder / "small.p4d.json"
    small.write_bytes(args.sidecar.read_bytes())
    if {"large", "play"} & {*args.parts}:
        hd = stretched(args.sidecar, str(args.hd), folder / "hd.p4d.json")
    print(f"{'action':<42} {'95 % (median)':>20}   bar / goal")
    for part in args.parts:
        if part == "cold":
            show("first window, cold", [cold(small, args.clip) for _ in range(3)], 3000, 2000)
        elif part == "small":
            small_clip(app, small, args.clip, args.times, size)
        elif part == "large":
            large_clip(app, hd, args.times)
        elif part == "play":
            play(app, hd, size)
        elif len(args.parts) == 1:
            long = stretched(args.sidecar, str(args.long), folder / "long.p4d.json")
            show_memory(app, long, size)
        else:  # in a process of its own: memory that was used once is not always given back
            words = [sys.executable, __file__, str(args.sidecar), args.clip, "--parts", "memory"]
            subprocess.run([*words, "--long", str(args.long), "--size", args.size], check=True)


if __name__ == "__main__":
    main()
