"""`make demo`: the whole road on the built-in sample clip, by the commands that anyone would type.

Every step runs the installed command `palette4d` and is shown as typed; the first one that fails
ends the demo with its exit status. Only before_after.png is made here, from the frames on disk.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

FRAMES = (1, 11, 22, 30, 38, 48)
"""Shown in before_after.png: a summer day, its end, autumn, late autumn, dusk and night."""
GOLD = 28
"""The frame at which the gold of leaves and meadow is picked."""
AUTUMN = 30
"""The frame whose edit is baked: late autumn."""

COMMAND = Path(sys.executable).with_name("palette4d")


def say(text: str) -> None:
    """Print at once, so that the order with the commands' own output holds in a pipe, too."""
    print(text, flush=True)


def run(title: str, *arguments: str) -> None:
    """Show and run one `palette4d` command; a failure ends the demo with the same status."""
    words = [shown(COMMAND), *arguments]
    say(f"\n== {title}\n$ {shlex.join(words)}")
    status = subprocess.run([COMMAND, *arguments], check=False).returncode
    if status != 0:
        sys.exit(f"demo: stopped, the command above ended with status {status}")


def shown(path: Path) -> str:
    """Return the path as one would type it here: relative where that is shorter."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def read(path: Path) -> NDArray[np.float32]:
    """Return one frame, (h, w, 3) float32."""
    buffer = oiio.ImageBuf(str(path))
    pixels = buffer.get_pixels(oiio.FLOAT)
    if buffer.has_error or pixels is None:
        sys.exit(f"demo: cannot read {path}: {buffer.geterror()}")
    return np.asarray(pixels, dtype=np.float32)[..., :3]


def before_after(clip: Path, graded: Path, out: Path) -> None:
    """Draw frames of the clip above the same frames graded, and print how far they moved."""
    from matplotlib.figure import Figure

    from palette4d.plotting import style

    pairs = [
        (read(clip / f"sample.{frame:04d}.png"), read(graded / f"sample.{frame:04d}.exr"))
        for frame in FRAMES
    ]
    say(f"\n== Before and after, {shown(out)}")
    for frame, (before, after) in zip(FRAMES, pairs, strict=True):
        moved = np.abs(after - before).max(axis=2)
        share = float((moved > 0.02).mean())
        say(f"   frame {frame:2d}: {share:4.0%} of the pixels changed, by up to {moved.max():.2f}")

    # In pixels of the clip, so that a picture's pixel is a clip's pixel.
    tall, wide = pairs[0][0].shape[:2]
    gap, left, head = 8, 30, 30
    width = left + len(pairs) * (wide + gap)
    height = head + 2 * (tall + gap)
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor=style.PAGE)
    words: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 10, "color": style.TEXT}
    for column, (frame, pair) in enumerate(zip(FRAMES, pairs, strict=True)):
        x = left + column * (wide + gap)
        for row, picture in enumerate(pair):
            y = height - head - (row + 1) * tall - row * gap
            axes = figure.add_axes((x / width, y / height, wide / width, tall / height))
            axes.imshow(np.clip(picture, 0, 1), interpolation="nearest", aspect="auto")
            axes.set_axis_off()
        figure.text((x + wide / 2) / width, 1 - head / 2 / height, f"frame {frame}", **words)
    for row, name in enumerate(("before", "after")):
        y = height - head - (row + 0.5) * tall - row * gap
        figure.text(left / 2 / width, y / height, name, rotation=90, **words)
    figure.savefig(out, dpi=100, facecolor=style.PAGE)


def fade(sidecar: Path) -> str:
    """Say over which frames the edit of the palette acts: between its edge's two vertices."""
    document = json.loads(sidecar.read_text(encoding="utf-8"))
    if not document["edits"]["stops"]:
        return "it is a vertex: its colour comes and goes with the vertices around it"
    stop = document["edits"]["stops"][-1]
    (edge,) = (e for e in document["polytope"]["edges"] if e["id"] == stop["edge"])
    when = {v["id"]: v["frame"] for v in document["polytope"]["vertices"]}
    return (
        f"{stop['id']} is full at frame {stop['frame']:g}; it comes in from frame "
        f"{when[edge['from']]:.3g} and is gone by frame {when[edge['to']]:.3g}, "
        "the vertices around it"
    )


def demo(out: Path) -> None:
    """Do everything into the folder `out`; what an earlier demo left there is replaced."""
    clip, graded = out / "clip", out / "graded"
    sidecar, sheet = out / "sample.p4d.json", out / "before_after.png"
    palette, edited = out / "palette.png", out / "palette_edited.png"
    cube, clf, studio = out / "autumn.cube", out / "autumn.clf", out / "studio.png"
    for folder in (clip, graded):
        shutil.rmtree(folder, ignore_errors=True)
    for file in (sidecar, sheet, palette, edited, cube, clf, studio):
        file.unlink(missing_ok=True)
    for folder in (clip, graded):
        folder.mkdir(parents=True)
    frames = str(clip / "sample.####.png")

    run("A clip: a lake from a summer day to an autumn night", "sample-clip", "-o", frames)
    run("Its palette over time", "analyze", frames, "-o", str(sidecar))
    run("What was found", "info", str(sidecar))
    run("The palette as a picture", "plot", str(sidecar), "--clip", frames, "-o", str(palette))
    # fmt: off
    run("Edit: the gold of late autumn, in leaves and meadow, becomes rose",
        "edit", str(sidecar), "pick", "--frame", str(GOLD), "--pixel", "275,68", "--box", "5",
        "--to", "#e66b9e", "--from", "27", "--fade", "6", "--clip", frames)
    run("Edit: a colour stop turns the day's blue, in the sky and the haze, to lavender",
        "edit", str(sidecar), "set", "--near", "0.2,0.47,0.85", "--frame", "11",
        "--rgb", "0.52", "0.45", "0.85")
    say(f"   {fade(sidecar)}")
    # fmt: on
    run("The palette with its edits", "plot", str(sidecar), "--clip", frames, "-o", str(edited))
    run("Render", "render", str(sidecar), frames, "-o", str(graded / "sample.####.exr"))
    for file in (cube, clf):
        run(
            f"Bake frame {AUTUMN} as a LUT, {file.suffix}",
            *("bake", str(sidecar), "--frame", str(AUTUMN), "--clip", frames, "-o", str(file)),
        )
    before_after(clip, graded, sheet)
    window = ""
    if importlib.util.find_spec("PySide6") is not None:
        words = ["studio", str(sidecar), "--frame", str(GOLD), "--screenshot", str(studio)]
        say(f"\n== The window, drawn without a screen\n$ {shlex.join([shown(COMMAND), *words])}")
        if subprocess.run([COMMAND, *words], check=False).returncode == 0:
            window = f"\n  {studio}\n        the window with the sidecar"

    command = shown(COMMAND)
    say(f"""
== Done. What lies where

  {sheet}
        frames {", ".join(map(str, FRAMES))}: the clip above, the result below
  {palette}, {edited}
        the palette over time before and after the edits, and its polyhedra in RGB
  {graded}/sample.####.exr
        the recoloured frames, 32-bit float; they hold the clip's own encoding, sRGB, and look
        too bright in viewers that expect linear light in EXR files (read them as sRGB)
  {cube}, {clf}
        the edit of frame {AUTUMN}, late autumn, as a LUT, for Resolve and for OpenColorIO
  {sidecar}
        the sidecar: the palette and its edits, a text file
  {clip}/sample.####.png
        the sample clip, 16 bit{window}

== What to try next

  the same in a window: click a colour, choose what it becomes
      make studio
  another colour
      {command} edit {sidecar} set --near 0.9,0.11,0.05 --frame 30 --rgb 0.1 0.4 0.9
      {command} render {sidecar} '{frames}' -o '{graded}/sample.####.exr' --force
  undo every edit
      {command} edit {sidecar} reset
  your own clip
      {command} analyze '/path/to/your.####.exr' -o yours.p4d.json
  in an OpenFX host
      {command} install-plugin --dest ~/OFX
      start the host with OFX_PLUGIN_PATH=~/OFX, add the effect Palette4D, choose the sidecar
  every verb
      {command} --help""")


def main() -> None:
    """Run the demo into the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("folder", type=Path, help="where the results go")
    started = time.monotonic()
    demo(parser.parse_args().folder)
    say(f"\n{time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()
