"""The inspector: what it says about a colour, and what its wheel, bars and numbers change."""

from __future__ import annotations

import os
import shutil
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"
pytest.importorskip("PySide6", reason="the extra palette4d[studio] is not installed")

from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from palette4d.cli.main import main
from palette4d.colour.oklch import Lch
from palette4d.studio import theme
from palette4d.studio.inspector import Inspector
from palette4d.studio.session import Session
from palette4d.studio.states import Place

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
LATER = 1e9
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def sidecar(tmp_path: Path) -> Path:
    return Path(shutil.copy(GOLDEN / "v1_split.p4d.json", tmp_path / "a.p4d.json"))


@pytest.fixture
def panel(qapp: QApplication, sidecar: Path) -> Generator[Inspector]:
    theme.dress(qapp)
    session = Session()
    made = Inspector(session)
    made.resize(360, 420)
    made.show()
    session.open_sidecar(sidecar)
    session.select("v2")
    qapp.processEvents()
    yield made
    session.close()
    made.deleteLater()
    qapp.processEvents()


def colour(panel: Inspector, id_: str = "v2") -> tuple[float, ...]:
    assert panel.session.document is not None
    return panel.session.document.grade.colour(id_)


def test_it_says_the_colour_in_all_units(panel: Inspector) -> None:
    assert panel.title.text() == "v2"
    assert panel.place.text() == "red · vertex · frame 0"
    assert [panel.boxes[name].value() for name in "RGB"] == [0.9, 0.1, 0.1]
    assert panel.hex.text() == "#e61a1a"
    lightness, chroma, hue = Lch("sRGB").of([0.9, 0.1, 0.1])
    assert panel.boxes["L"].value() == pytest.approx(lightness, abs=6e-4)
    assert panel.boxes["C"].value() == pytest.approx(chroma, abs=6e-4)
    assert panel.boxes["h"].value() == pytest.approx(hue, abs=0.06)
    for box in panel.boxes.values():  # the numbers can be seen, not only read by a program
        width = box.fontMetrics().horizontalAdvance(box.text())
        assert box.lineEdit().width() >= width


def test_numbers_and_hex_do_what_the_verb_does(
    panel: Inspector, sidecar: Path, tmp_path: Path
) -> None:
    twin = Path(shutil.copy(sidecar, tmp_path / "twin.p4d.json"))
    panel.boxes["G"].setValue(0.625)
    assert colour(panel) == (0.9, 0.625, 0.1)
    panel.hex.setText("#3366ff")
    panel.hex.setModified(True)
    panel.hex.editingFinished.emit()
    panel.session.tick(LATER)
    assert main(["edit", str(twin), "set", "v2", "--rgb", "0.9", "0.625", "0.1"]) == 0
    assert main(["edit", str(twin), "set", "v2", "--rgb", "#3366ff"]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_a_wrong_hex_is_said_and_changes_nothing(panel: Inspector) -> None:
    panel.hex.setText("red")
    panel.hex.setModified(True)
    panel.hex.editingFinished.emit()
    assert panel.session.status.level == "error"
    assert colour(panel) == (0.9, 0.1, 0.1)
    assert panel.hex.text() == "#e61a1a"


def test_what_is_typed_stays_while_other_things_change(panel: Inspector) -> None:
    """As when another program edits, or a pick was followed."""
    panel.activateWindow()
    panel.hex.setFocus()
    panel.hex.selectAll()
    QTest.keyClicks(panel.hex, "#33")
    panel.session.edit(lambda document: document.set("v3", rgb=(0.1, 0.2, 0.3)))
    assert panel.hex.text() == "#33"
    panel.session.select("v3")
    assert panel.hex.text() == "#1a334c"


def test_a_drag_on_the_wheel_turns_the_hue_as_one_step(qtbot: Any, panel: Inspector) -> None:
    wheel, lch = panel.wheel, Lch("sRGB")
    before = lch.of(colour(panel))
    centre = wheel.rect().center()
    qtbot.mousePress(wheel, LEFT, pos=centre + QPoint(30, 0))
    for y in (-10, -20, -30):
        wheel.moved.emit((0.1, 90.0 - y))
        assert panel.session.dragging
        assert panel.swatch.after.tolist() != panel.swatch.before.tolist()
    qtbot.mouseRelease(wheel, LEFT, pos=centre - QPoint(0, 30))
    assert not panel.session.dragging
    after = lch.of(colour(panel))
    assert after[0] == pytest.approx(before[0], abs=1e-6)
    assert after[1] == pytest.approx(0.1, abs=1e-6)
    assert after[2] == pytest.approx(120, abs=1e-3)
    assert panel.session.document is not None
    assert len(panel.session.document.history.done) == 1
    panel.session.undo()
    assert colour(panel) == (0.9, 0.1, 0.1)


def test_a_click_on_the_wheel_chooses_that_hue(qtbot: Any, panel: Inspector) -> None:
    wheel = panel.wheel
    qtbot.mouseClick(wheel, LEFT, pos=wheel.rect().center() - QPoint(0, 25))
    assert Lch("sRGB").of(colour(panel))[2] == pytest.approx(90, abs=3)


def test_a_bar_is_moved_by_keys(qtbot: Any, panel: Inspector) -> None:
    qtbot.keyClick(panel.bars["R"], Qt.Key.Key_Left)
    assert colour(panel)[0] == pytest.approx(0.895)
    qtbot.keyClick(panel.bars["L"], Qt.Key.Key_Right)
    assert not panel.session.dragging


def test_several_handles_move_by_the_same_as_one_step(panel: Inspector) -> None:
    panel.session.select("v2", "v3")
    panel.boxes["B"].setValue(0.3)
    assert colour(panel) == (0.9, 0.1, 0.3)
    assert colour(panel, "v3")[2] == pytest.approx(0.3)
    panel.session.undo()
    assert colour(panel, "v3") == (0.1, 0.9, 0.1)


def test_the_scope_track_is_the_verbs(panel: Inspector, sidecar: Path, tmp_path: Path) -> None:
    twin = Path(shutil.copy(sidecar, tmp_path / "twin.p4d.json"))
    panel.set_scope("track")
    panel.boxes["B"].setValue(0.35)
    panel.session.tick(LATER)
    words = ["track", "v2", "--by", "0", "0", "0.25"]
    assert main(["edit", str(twin), *words]) == 0
    document = panel.session.document
    assert document is not None
    assert set(document.grade.settings) == {"v2", "v6", "v10", "v15"}
    assert sidecar.read_bytes() == twin.read_bytes()


def test_the_scope_palette_turns_all_hues(panel: Inspector) -> None:
    panel.set_scope("palette")
    lch = Lch("sRGB")
    before = lch.of(colour(panel, "v3"))
    panel.boxes["h"].setValue(panel.boxes["h"].value() + 40)
    document = panel.session.document
    assert document is not None
    assert len(document.grade.settings) >= 12
    after = lch.of(colour(panel, "v3"))
    assert (after[2] - before[2]) % 360 == pytest.approx(40, abs=0.1)
    panel.session.undo()
    assert not document.grade.settings or not panel.session.document.grade.settings


def test_a_row_at_the_playhead_gets_a_stop(panel: Inspector) -> None:
    panel.session.go(5)
    panel.session.select("e1")
    assert "5" in panel.place.text()
    panel.boxes["R"].setValue(0.5)
    document = panel.session.document
    assert document is not None
    (setting,) = document.grade.settings.values()
    assert (setting.edge, setting.frame) == ("e1", 5)


def test_the_ramp_of_a_handle_and_of_the_clip(panel: Inspector) -> None:
    assert panel.ramp.isEnabled()  # also without another colour
    panel.boxes["R"].setValue(0.5)
    panel.ramp.setCurrentIndex(panel.ramp.findData("hold"))
    panel.ramp.activated.emit(panel.ramp.currentIndex())
    document = panel.session.document
    assert document is not None
    assert document.grade.settings["v2"].ramp == "hold"
    panel.session.select()
    panel.ramp.setCurrentIndex(panel.ramp.findData("smooth"))
    panel.ramp.activated.emit(panel.ramp.currentIndex())
    assert panel.session.document.grade.ramp == "smooth"


def test_reset(qtbot: Any, panel: Inspector) -> None:
    panel.boxes["R"].setValue(0.5)
    qtbot.mouseClick(panel.reset, LEFT)
    assert colour(panel) == (0.9, 0.1, 0.1)


def test_a_pixel_has_the_colour_that_windows_of_picks_give_it(panel: Inspector) -> None:
    session = panel.session
    assert session.document is not None
    seen = session.document.grade.palette(session.frame).rgb.mean(axis=0)
    session.edit(lambda d: d.pick(session.frame, colour=seen, by=(0.2, 0, 0), whole_hue=True))
    session.edit(lambda d: d.set_window("p1", session.frame, (2, 2, 9, 9), feather=1, follow=False))
    for at, moved in ((5, 0.2), (60, 0.0)):
        session.begin_pick(Place(int(session.frame), at, 5, 1, tuple(seen.tolist())))
        panel.refresh()
        assert panel.target is not None
        assert panel.target.after - seen == pytest.approx([moved, 0, 0], abs=0.02)
        session.take("")


def test_nothing_selected_says_what_to_do(panel: Inspector) -> None:
    panel.session.select()
    assert panel.place.text()
    assert not panel.wheel.isEnabled()
    panel.grab()


@pytest.mark.parametrize("encoding", ["sRGB", "unknown", "ACEScct", "lin_rec709"])
def test_lightness_chroma_hue_and_back(encoding: str) -> None:
    lch = Lch(encoding)
    colours = np.random.default_rng(3).random((50, 3))
    np.testing.assert_allclose(lch.back(lch.of(colours)), colours, atol=3e-5)


def test_colours_beyond_the_display_lose_chroma_only() -> None:
    lch = Lch("sRGB")
    fitted = lch.fitted([0.6, 0.5, 30.0])
    light, chroma, hue = lch.of(fitted)
    assert (fitted >= 0).all()
    assert (fitted <= 1).all()
    assert light == pytest.approx(0.6, abs=2e-3)
    assert 0.15 < chroma < 0.5
    assert hue == pytest.approx(30, abs=0.5)
