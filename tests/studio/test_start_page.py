"""The first page: open, try the sample, and recent files with pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QPushButton
from test_docs import commands

from palette4d.cli.main import main
from palette4d.studio import texts
from palette4d.studio.shot_list import THUMB, icon_of
from palette4d.studio.window import Window


def test_recent_files_have_pictures_and_open(
    window: Window, sidecar: Path, qtbot: Any, tmp_path: Path
) -> None:
    gone = tmp_path / "gone.p4d.json"
    window.settings.setValue("recent", [str(gone), str(sidecar)])
    page = window.start
    page.fill()
    assert page.isVisible()
    (item,) = (page.list.item(row) for row in range(page.list.count()))
    assert item.text() == f"{sidecar.parent.name}/{sidecar.name}"  # many files have one name

    def coloured() -> bool:
        image = item.icon().pixmap(QSize(112, 63)).toImage()
        return image.pixelColor(image.width() // 2, image.height() // 3).lightness() > 20

    qtbot.waitUntil(coloured, timeout=20_000)
    page.list.itemActivated.emit(item)
    assert window.session.path == sidecar
    assert not page.isVisible()


def test_a_clip_and_its_sidecar_are_one_work(window: Window, tmp_path: Path) -> None:
    names = ("b.p4d.json", "a.mov", "a.p4d.json", "b.mov", "c.mov")
    for name in names:
        (tmp_path / name).touch()
    window.settings.setValue("recent", [str(tmp_path / name) for name in names])
    window.start.fill()
    texts = [window.start.list.item(row).text() for row in range(window.start.list.count())]
    assert [Path(text).name for text in texts] == ["b.p4d.json", "a.mov", "c.mov"]


def test_pictures_of_all_shapes_have_one_size(qapp: Any) -> None:
    """What a smaller one does not cover of the blank one before it stayed on the screen."""
    for height, width in ((20, 60), (63, 30), (1, 1)):
        icon = icon_of(np.full((height, width, 4), 255, np.uint8))
        assert icon.availableSizes() == [THUMB]


@pytest.mark.parametrize(
    "kept", [True, 5, b"\xff", {"a": 1}, ["x" * 9999, "/dev/zero", 7, "", "x\0"]]
)
def test_settings_that_hold_anything_stop_no_window(
    window: Window, sidecar: Path, kept: Any
) -> None:
    for name in ("recent", "open"):
        window.settings.setValue(name, kept)
    window.start.fill()
    window.files.offer_crashed()
    window.open_path(str(sidecar))
    assert window.session.path == sidecar


def test_the_sample_is_made_analysed_and_opened(
    window: Window, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: Any, repo_root: Path
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    button = next(
        each for each in window.start.findChildren(QPushButton) if each.text() == texts.TRY_SAMPLE
    )
    button.click()
    session = window.session
    qtbot.waitUntil(lambda: session.document is not None, timeout=180_000)
    assert session.path == tmp_path / "palette4d" / "sample" / "sample.p4d.json"
    assert session.clip is not None
    assert len(session.clip.frames) == 48
    qtbot.waitUntil(lambda: not window.verbs.dialogs)
    # The commands of docs/grading.md name its handles, which change with the search for palettes.
    edits = [
        words
        for words in commands((repo_root / "docs/grading.md").read_text("utf-8"))
        if words[:2] == ["edit", "sample.p4d.json"]
    ]
    assert len(edits) >= 10
    monkeypatch.chdir(tmp_path / "palette4d" / "sample")
    for words in edits:
        assert main(words) == 0, words
