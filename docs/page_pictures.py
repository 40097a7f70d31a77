"""Draw the pictures of the user pages from the sample clip, with palette4d itself.

    .venv/bin/python docs/page_pictures.py [NAME ...]

It writes docs/images/NAME.jpg: lut (exports), fit (palettes), shots, clips, linear (colour spaces),
node_place (hosts), calls (Python) and files.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

import palette4d as p4d

IMAGES = Path(__file__).resolve().parent / "images"
PAGE, TEXT, DIM = "#202020", "#eeeeee", "#9a9a9a"
CLIP = "clip/sample.####.png"

Picture = NDArray[np.float32]


def page(width: float, height: float) -> tuple[Figure, Any]:
    """Return a figure of 100 pixels a unit, and axes in these units from the top left."""
    figure = Figure(figsize=(width, height), dpi=100, facecolor=PAGE)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(height, 0))
    axes.set_axis_off()
    return figure, axes


def show(axes: Any, picture: Picture, left: float, top: float, width: float) -> float:
    """Draw a picture; return its lower edge."""
    lower = top + width * picture.shape[0] / picture.shape[1]
    axes.imshow(np.clip(picture[..., :3], 0, 1), extent=(left, left + width, lower, top), zorder=2)
    return lower


def write(axes: Any, x: float, y: float, text: str, **how: Any) -> None:
    """Write a line of text; the middle by default."""
    axes.text(x, y, text, **{"color": TEXT, "fontsize": 11, "ha": "center", "va": "center", **how})


def swatches(axes: Any, colours: Any, left: float, top: float, width: float, tall: float) -> None:
    """Draw colours side by side, the dark ones first."""
    chosen = sorted(np.clip(colours, 0, 1).tolist(), key=sum)
    axes.imshow(np.array([chosen]), extent=(left, left + width, top + tall, top), zorder=2,
                interpolation="nearest", aspect="auto")  # fmt: skip


def save(figure: Figure, name: str) -> None:
    """Write the figure as a JPEG."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    image.save(IMAGES / f"{name}.jpg", quality=86, subsampling=0, optimize=True)


def autumn(vertices: int = 0) -> p4d.Document:
    """Return the sample clip's palette, its gold edited to rose."""
    doc = p4d.analyze(CLIP, **({"vertices": vertices} if vertices else {}))
    doc.set_near((0.86, 0.58, 0.07), frame=30, rgb=(0.9, 0.42, 0.62))
    return doc


def lut() -> None:
    """The edit of frame 30 as a LUT, on frame 30 and on frame 20, beside the node."""
    doc = autumn()
    p4d.bake(doc, 30, "autumn.cube", size=65)
    transform = ocio.FileTransform("autumn.cube", interpolation=ocio.INTERP_TETRAHEDRAL)
    processor = ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor()
    figure, axes = page(12, 5.0)
    for top, frame in ((0.55, 30), (2.75, 20)):
        image = p4d.open_clip(CLIP).read(frame)[..., :3]
        baked = image.copy()
        processor.applyRGB(baked)
        write(axes, 0.28, top + 1.05, f"frame {frame}", rotation=90)
        for k, picture in enumerate((image, doc.recolour(image, frame), baked)):
            show(axes, picture, 0.55 + 3.8 * k, top, 3.7)
    for k, text in enumerate(("clip", "node, render", "the LUT of frame 30")):
        write(axes, 0.55 + 3.8 * k + 1.85, 0.28, text)
    save(figure, "lut")


def fit() -> None:
    """Two palettes of one frame: few handles leave pixels outside."""
    figure, axes = page(12, 5.6)
    for k, (vertices, what) in enumerate(((10, "--vertices 10"), (0, "the default"))):
        doc = p4d.analyze(CLIP, **({"vertices": vertices} if vertices else {}))
        p4d.plot(doc, f"plot{k}.png", frames=[30], clip=CLIP, width=2400)
        image = np.asarray(Image.open(f"plot{k}.png").convert("RGB"), dtype=np.float32) / 255
        side = image.shape[1] * 308 // 1100
        middle, notes = image.shape[1] // 2, image.shape[1] * 44 // 1200
        cube = image[-notes - side : -notes, middle - side // 2 : middle + side // 2]
        show(axes, cube, 0.95 + 5.3 * k, 0.45, 4.8)
        figures = doc.fields()["quality"]["stages"][-1]
        write(axes, 3.35 + 5.3 * k, 0.25, f"{what}: {figures['vertices']} handles")
        line = f"R {figures['R']:.4f}   C {figures['C']:.3f}   L' {figures['L_prime']:.3f}   "
        line += f"outside {figures['outside_1_255']:.1%}"
        write(axes, 3.35 + 5.3 * k, 5.35, line, color=DIM)
    save(figure, "fit")


def shots() -> None:
    """A movie with two cuts, and what `analyze --detect-shots` makes of it."""
    clip = dict(p4d.open_clip(CLIP))
    order = [*range(24, 36), *range(1, 13), *range(38, 49)]
    from palette4d.media.frame_writer import write_frame

    Path("rushes").mkdir()
    for number, frame in enumerate(order):
        write_frame(Path(f"rushes/rushes.{number:04d}.png"), clip[frame], "uint8")
    done = p4d.analyze_shots("rushes/rushes.####.png", "shots", vertices=14, jobs=1)
    figure, axes = page(12, 2.8)
    entries = done.manifest.entries
    for at, entry in enumerate(entries):
        (first, last), left = entry.frames or (0, 0), 0.2 + 3.9 * at
        doc = p4d.load(done.path.parent / entry.sidecar)
        for k in range(3):
            frame = round(first + (last - first) * (k + 0.5) / 3)
            lower = show(axes, clip[order[frame]], left + 1.25 * k, 0.55, 1.22)
            swatches(axes, doc.grade.palette(frame).rgb, left + 1.25 * k, lower + 0.1, 1.22, 0.5)
        if at:
            axes.plot([left - 0.09] * 2, [0.2, 2.4], color=TEXT, lw=1, ls=(0, (2, 3)))
        write(axes, left + 1.85, 0.3, f"frames {first} to {last}", color=DIM)
        write(axes, left + 1.85, lower + 0.85, entry.sidecar)
    write(axes, 6, 2.6, f"{done.path.name}: the manifest of all shots", color=DIM)
    save(figure, "shots")


def clips() -> None:
    """Kinds of clips, each with three frames and the palettes found there."""
    source = [image[::2, ::2, :3] for _, image in p4d.open_clip(CLIP)]
    autumn_frames = np.stack(source[20:32])
    fade = autumn_frames * np.linspace(1, 0, 12, dtype=np.float32)[:, None, None, None]
    box = autumn_frames.copy()
    box[:, :12] = box[:, -12:] = 0
    noise = np.random.default_rng(1).normal(0, 0.04, autumn_frames.shape)
    grey = np.repeat(autumn_frames @ np.array([[0.2126], [0.7152], [0.0722]], np.float32), 3, 3)
    t = np.linspace(0, 1, 12, dtype=np.float32)[:, None, None, None]
    dissolve = (1 - t) * np.stack(source[:12]) + t * np.stack(source[30:42])
    kinds: Iterable[tuple[str, Any]] = (
        ("fade to black", fade),
        ("dissolve", dissolve),
        ("letterbox", box),
        ("grain", np.clip(autumn_frames + noise, 0, 1).astype(np.float32)),
        ("monochrome", grey),
    )
    figure, axes = page(12, 3.25)
    for k, (name, frames) in enumerate(kinds):
        doc = p4d.analyze(frames)
        left = 0.15 + 2.36 * k
        write(axes, left + 1.13, 0.25, name)
        for row, frame in enumerate((0, 6, 11)):
            top = 0.5 + 0.9 * row
            lower = show(axes, frames[frame], left, top, 1.45)
            swatches(axes, doc.grade.palette(frame).rgb, left + 1.5, top, 0.76, lower - top)
    save(figure, "clips")


def linear() -> None:
    """Where the handles of a bright ACEScg clip lie, found in linear light and in ACEScct."""
    config = ocio.Config.CreateFromBuiltinConfig("studio-config-latest")

    def converted(colours: Any, source: str, target: str) -> Picture:
        processor = config.getProcessor(source, target).getDefaultCPUProcessor()
        flat = np.array(colours, np.float32).reshape(-1, 1, 3)
        processor.applyRGB(flat)
        return flat.reshape(np.shape(colours))

    # The sample clip as light: its brightest parts are 40 times white.
    clip = p4d.open_clip(CLIP, frames="1-48x4")
    shown = np.stack([image[::3, ::3, :3] for _, image in clip])
    display, light = "sRGB Encoded Rec.709 (sRGB)", "ACEScg"
    seen = converted(shown, display, light)
    frames = seen / (1.025 - np.clip(seen.max(axis=-1, keepdims=True), 0, 1))

    figure, axes = page(12, 4.6)
    show(axes, p4d.open_clip(CLIP).read(9), 0.25, 0.75, 4.5)
    write(axes, 2.5, 0.42, "a frame of an ACEScg clip", fontsize=13)
    stops = np.arange(-8, 7)

    def place(colours: Picture) -> Any:
        """Return where colours lie from left to right: stops around middle grey."""
        grey = np.maximum(colours @ np.array([0.2722, 0.6741, 0.0537]), 1e-6)
        return 5.4 + 6.3 * (np.clip(np.log2(grey / 0.18), -8, 6) + 8) / 14

    pixels = place(frames[2].reshape(-1, 3))
    for top, space, text in (
        (0.75, light, "palette found in linear light: most handles are highlights"),
        (2.55, None, "palette found in ACEScct: handles from shadow to highlight"),
    ):
        write(axes, 8.55, top - 0.3, text, fontsize=12)
        counts, edges = np.histogram(pixels, bins=70, range=(5.4, 11.7))
        axes.bar(edges[:-1], -1.15 * counts / counts.max(), np.diff(edges), bottom=top + 1.25,
                 color="#3d3d3d", align="edge", zorder=1)  # fmt: skip
        doc = p4d.analyze(frames, input_space=light, palette_space=space, vertices=20)
        own = np.array([vertex["rgb"] for vertex in doc.fields()["polytope"]["vertices"]])
        found = converted(own, doc.grade.encoding, light)
        most = np.maximum(found.max(axis=-1, keepdims=True), 0)
        colours = np.clip(converted(1.025 * found / (1 + most), light, display), 0, 1)
        level = np.linspace(0.2, 1.05, len(found))[np.argsort(np.argsort(own.sum(axis=1)) * 7 % 20)]
        axes.scatter(place(found), top + level, s=150, c=colours, edgecolors=TEXT, zorder=3)
        axes.plot([5.4, 11.7], [top + 1.25] * 2, color=DIM, lw=1)
    for stop in stops[::2]:
        write(axes, 5.4 + 6.3 * (stop + 8) / 14, 4.02, f"{stop:+d}" if stop else "0", color=DIM)
    write(axes, 8.55, 4.32, "stops around middle grey; grey: the pixels of the frame", color=DIM)
    save(figure, "linear")


def node_place() -> None:
    """Where the node stands: clip, Palette4D with a sidecar, everything else."""
    doc = autumn()
    image = p4d.open_clip(CLIP).read(30)[..., :3]
    figure, axes = page(12, 2.75)
    show(axes, image, 0.15, 0.55, 3.3)
    show(axes, doc.recolour(image, 30), 6.65, 0.55, 3.3)
    box: dict[str, Any] = {"boxstyle": "round,pad=0.6", "facecolor": "#3a3a3a", "edgecolor": TEXT}
    write(axes, 5.05, 1.5, "Palette4D", fontsize=14, bbox=box)
    write(axes, 5.05, 2.35, "sample.p4d.json", color=DIM)
    write(axes, 10.95, 1.5, "other\ncorrections", fontsize=12, bbox=box)
    arrow: dict[str, Any] = {"arrowstyle": "->", "color": TEXT, "lw": 1.6}
    for start, end in (
        ((3.5, 1.5), (4.3, 1.5)),
        ((5.8, 1.5), (6.6, 1.5)),
        ((10.0, 1.5), (10.3, 1.5)),
    ):
        axes.annotate("", end, start, arrowprops=arrow)
    axes.annotate("", (5.05, 1.8), (5.05, 2.22), arrowprops=arrow)
    write(axes, 1.8, 0.28, "clip")
    write(axes, 8.3, 0.28, "recoloured, frame 30")
    save(figure, "node_place")


def calls() -> None:
    """A picture and what four methods of a document make of it."""
    doc = autumn()
    image = p4d.open_clip(CLIP).read(30)[..., :3]
    near = doc.grade.near((0.9, 0.42, 0.62), frame=30)
    matte = doc.matte(image, 30, f"weight:{near.handle or near.id}")
    graded, palette = doc.recolour(image, 30), doc.grade.palette(30)
    figure, axes = page(12, 3.45)
    for k, (text, picture) in enumerate(
        (
            ("image", image),
            ("doc.recolour(image, 30)", graded),
            (
                f'doc.matte(image, 30, "weight:{near.handle or near.id}")',
                matte[..., None].repeat(3, 2),
            ),
        )
    ):
        lower = show(axes, picture, 0.2 + 3.9 * k, 0.5, 3.8)
        write(axes, 2.1 + 3.9 * k, 0.27, text, family="monospace", fontsize=10)
    for k, colours in enumerate((palette.rgb, palette.edited)):
        order = np.argsort(palette.rgb.sum(axis=1))
        strip = np.clip(colours[order], 0, 1)[None]
        left = 0.2 + 3.9 * k
        axes.imshow(strip, extent=(left, left + 3.8, lower + 0.42, lower + 0.1), zorder=2,
                    interpolation="nearest", aspect="auto")  # fmt: skip
    write(axes, 2.1, lower + 0.6, "doc.grade.palette(30).rgb", family="monospace", fontsize=10)
    write(axes, 6.0, lower + 0.6, "doc.grade.palette(30).edited", family="monospace", fontsize=10)
    save(figure, "calls")


def files() -> None:
    """Which command writes which file, and who reads it."""
    figure, axes = page(12, 3.3)
    box: dict[str, Any] = {"boxstyle": "round,pad=0.5", "facecolor": "#3a3a3a", "edgecolor": TEXT}
    arrow: dict[str, Any] = {"arrowstyle": "->", "color": DIM, "lw": 1.4}
    places = {
        "edit.otio\nplates": (1.0, 1.65),
        "edit.shots.json\nmanifest": (4.0, 0.7),
        "SHOT.p4d.json\nsidecars": (4.0, 2.6),
        "SHOT.series.json\nindex, with its LUTs": (7.6, 0.7),
        "config.ocio\na look for each shot": (7.6, 1.65),
        "renders\nframes, movies": (7.6, 2.6),
        "graded.otio\nthe edit with references": (10.7, 0.7),
        "hosts\nthrough the node": (10.7, 2.6),
    }
    for text, (x, y) in places.items():
        write(axes, x, y, text, bbox=box, fontsize=10, zorder=3)
    for start, end, text in (
        ((1.7, 1.4), (3.1, 0.8), "analyze"),
        ((1.7, 1.9), (3.1, 2.5), ""),
        ((5.0, 0.7), (6.5, 0.7), "export"),
        ((5.0, 0.9), (6.5, 1.5), "config"),
        ((5.0, 2.6), (6.7, 2.6), "render"),
        ((8.7, 0.7), (9.5, 0.7), "--otio"),
    ):
        axes.annotate("", end, start, arrowprops=arrow)
        middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 - 0.2)
        write(axes, *middle, text, family="monospace", fontsize=10, color=DIM)
    axes.annotate(
        "", (9.9, 2.9), (4.8, 2.95), arrowprops={**arrow, "connectionstyle": "arc3,rad=0.12"}
    )
    save(figure, "files")


DRAWN: dict[str, Callable[[], None]] = {
    draw.__name__: draw for draw in (lut, fit, shots, clips, linear, node_place, calls, files)
}


def main() -> None:
    """Draw the pictures that are named, or all."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        p4d.sample_clip(CLIP)
        for name in sys.argv[1:] or DRAWN:
            DRAWN[name]()


if __name__ == "__main__":
    main()
