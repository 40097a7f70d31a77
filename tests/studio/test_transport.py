"""The bar below the picture."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from palette4d.studio.window import Window


def test_the_window_fits_a_screen_of_1920_pixels_at_200_percent(window: Window) -> None:
    bar = window.transport
    window.docks["shots"].show()
    window.line.file_facts.setText(
        "a_long_name_of_a_shot_of_a_show_v017.p4d.json  ·  not saved yet"
    )
    window.line.view_facts.setText("unknown encoding: code values as they are")
    window.resize(940, 490)
    window.arrange()
    assert (window.width(), window.height()) == (940, 490)
    always = [bar.buttons["play"], *bar.compare.values(), bar.look, bar.exposure, bar.gamma]
    for widget in always:
        assert widget.isVisible()
        assert widget.geometry().right() < bar.width()
    window.docks["shots"].hide()
    window.resize(1800, 900)
    assert all(widget.isVisible() for widget in [*bar.buttons.values(), *always])
    assert bar.look.y() == bar.compare["after"].y()


def test_the_bar_never_lies_over_the_picture(opened: Window, qtbot: Any) -> None:
    window, viewer, bar = opened, opened.viewer, opened.transport
    window.resize(1600, 1000)
    window.arrange()
    qtbot.wait(50)
    for size in ((1000, 600), (1600, 1000), (900, 560)):
        window.resize(*size)
        qtbot.wait(50)
        qtbot.waitUntil(lambda: bar.y() > viewer.geometry().bottom())
        seen = [*bar.compare.values(), bar.look, bar.exposure]
        assert all(bar.rect().contains(widget.geometry()) for widget in seen)


#: Tells where the rows of tabs are seen in a window that is drawn by the command.
TABS = """
import sys
from pathlib import Path
import pytest
from PySide6.QtWidgets import QTabBar
from palette4d.studio import app

def tell(window):
    for bar in window.findChildren(QTabBar):
        if bar.isVisible() and window.rect().intersects(bar.geometry()):
            print(bar.geometry().x(), bar.count())

app.run(None, screenshot=Path(sys.argv[1]), size=(1000, int(sys.argv[2])), prepare=tell)
"""


@pytest.mark.parametrize(("height", "count"), [(600, 1), (900, 2)])
def test_each_row_of_tabs_is_drawn_once(tmp_path: Path, height: int, count: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", TABS, str(tmp_path / "window.png"), str(height)],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    rows = sorted(done.stdout.split("\n")[:-1])
    assert len(rows) == count, rows
    assert len({row.split()[0] for row in rows}) == 1, rows
