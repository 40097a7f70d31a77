"""Dialogs that run a verb: what they enter is the command line that they show."""

from __future__ import annotations

import argparse
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QCheckBox, QComboBox, QLineEdit, QMessageBox

from palette4d import Document
from palette4d.cli.main import build_parser
from palette4d.studio import grade_steps, texts
from palette4d.studio.choice import SearchChoice
from palette4d.studio.pixels import place_between
from palette4d.studio.verb_dialog import VerbDialog
from palette4d.studio.window import Window


def enter(dialog: VerbDialog, flag: str, value: str) -> None:
    """Enter an option as a person does."""
    entry = dialog.entry(flag)
    if isinstance(entry, QLineEdit):
        entry.setText(value)
    elif isinstance(entry, QComboBox):
        entry.setCurrentIndex(entry.findData(value))
    else:
        entry.setChecked(bool(value))


def test_the_options_of_an_analysis(opened: Window, sidecar: Path) -> None:
    dialog = opened.verbs.analyze_again()
    clip = str(opened.session.clip.source) if opened.session.clip is not None else ""
    assert dialog.words() == ["analyze", clip, "-o", str(sidecar), "--keep-edits"]
    enter(dialog, "--vertices", "9")
    enter(dialog, "--method", "paper")
    enter(dialog, "--set", "a=1  b=2")
    added = ["--vertices", "9", "--method", "paper", "--set", "a=1", "--set", "b=2"]
    assert dialog.words() == ["analyze", clip, "-o", str(sidecar), "--keep-edits", *added]
    assert dialog.command.toPlainText().endswith(
        "--keep-edits --vertices 9 --method paper --set a=1 --set b=2"
    )


def test_no_verb_reads_a_file_that_lacks_the_windows_edits(opened: Window, sidecar: Path) -> None:
    session = opened.session
    session.edit(lambda document: document.set("v1", rgb=(0.1, 0.2, 0.3)))
    theirs = Document.load(sidecar)
    theirs.set("v1", rgb=(0.3, 0.2, 0.1))
    theirs.save()
    dialog = opened.verbs.bake()
    dialog.start()
    assert dialog.job is None
    assert texts.NOT_SAVED in dialog.stage.text()
    session.revert()
    dialog.start()
    assert dialog.job is not None
    dialog.job.cancel()


def test_no_verb_reads_a_file_while_an_edit_is_followed(opened: Window, qtbot: Any) -> None:
    session = opened.session
    place = place_between(session, (5, 5), (5, 5))
    assert place is not None
    grade_steps.hold(session, place)
    assert session.following
    dialog = opened.verbs.bake()
    dialog.start()
    assert dialog.job is None
    assert dialog.stage.text() == texts.STILL_FOLLOWING
    qtbot.waitUntil(lambda: not session.following, timeout=30_000)
    dialog.start()
    assert dialog.job is not None
    dialog.job.cancel()


def test_shots_go_to_a_folder(opened: Window, sidecar: Path) -> None:
    dialog = opened.verbs.analyze_again()
    shots = dialog.entry("--detect-shots")
    assert isinstance(shots, QCheckBox)
    shots.setChecked(True)
    assert dialog.value("-o") == str(sidecar.with_name("clip_shots"))
    assert "--detect-shots" in dialog.words()
    shots.setChecked(False)
    assert dialog.value("-o") == str(sidecar)


def answer(dialog: VerbDialog, text: str) -> None:
    """Push a button of the question that is open."""
    box = dialog.findChild(QMessageBox)
    assert isinstance(box, QMessageBox)
    assert box.isVisible()
    assert box.text() == texts.STOP_ASKED
    next(button for button in box.buttons() if button.text() == text).click()


def analysis(opened: Window, tmp_path: Path) -> VerbDialog:
    """The dialog of an analysis into a new file."""
    dialog = opened.verbs.analyze_again()
    line = dialog.entry("-o")
    assert isinstance(line, QLineEdit)
    line.setText(str(tmp_path / "again.p4d.json"))
    return dialog


def test_a_window_that_is_closed_asks_before_it_ends_a_job(
    opened: Window, tmp_path: Path, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    dialog = analysis(opened, tmp_path)
    dialog.start()
    job = dialog.job
    assert job is not None
    monkeypatch.setattr(QMessageBox, "exec", lambda box: None)
    chosen = [texts.GO_ON, texts.STOP_JOB]
    monkeypatch.setattr(
        QMessageBox,
        "clickedButton",
        lambda box: next(b for b in box.buttons() if b.text() == chosen[0]),
    )
    opened.close()
    assert opened.isVisible()
    assert not job.cancelled
    chosen.pop(0)
    opened.close()
    assert not opened.isVisible()
    assert job.wait(20) != 0
    assert not (tmp_path / "again.p4d.json").exists()


def test_escape_asks_and_stops_what_runs_and_the_dialog_says_so(
    opened: Window, tmp_path: Path, qtbot: Any
) -> None:
    dialog = analysis(opened, tmp_path)
    dialog.activateWindow()
    qtbot.waitUntil(dialog.isActiveWindow)
    dialog.start()
    QTest.keyClick(dialog, Qt.Key.Key_Escape)
    answer(dialog, texts.GO_ON)
    qtbot.waitUntil(lambda: dialog.findChild(QMessageBox) is None)
    assert dialog.stage.text() != texts.STOPPING
    QTest.keyClick(dialog, Qt.Key.Key_Escape)
    answer(dialog, texts.STOP_JOB)
    assert dialog.stage.text() == texts.STOPPING
    qtbot.waitUntil(lambda: dialog.stage.text() == texts.CANCELLED, timeout=30_000)
    assert dialog.isVisible()
    dialog.reject()
    assert not dialog.isVisible()


def test_a_failed_analysis_offers_the_fields_that_help(opened: Window, qtbot: Any) -> None:
    dialog = opened.verbs.analyze_again()
    edits = dialog.inputs[[field.label for field in dialog.fields].index(texts.EDITS)]
    assert isinstance(edits, QComboBox)
    kept = opened.session.document
    assert kept is not None
    kept.adjust(kept.fields()["polytope"]["vertices"][0]["id"], by=(0.1, 0.0, 0.0))
    opened.session.save()
    edits.setCurrentIndex(0)  # refuse
    dialog.start()
    qtbot.waitUntil(lambda: dialog.stage.text() == texts.FAILED, timeout=30_000)
    assert f"'{texts.EDITS}: {texts.EDITS_NAMES[1]}'" in dialog.log.toPlainText()
    dialog.offers[0].click()
    assert "--keep-edits" in dialog.words()
    assert edits.hasFocus()
    dialog.start()
    assert not dialog.offers
    qtbot.waitUntil(lambda: dialog.stage.text() != texts.RUNNING, timeout=60_000)
    dialog.reject()


#: Arguments that a window does not ask: work on a farm, files of a whole show, and of a DCTL.
NOT_ASKED = {"cluster", "jobs", "edl", "otio", "clip", "max_error"}
SOURCES = Path(__file__).resolve().parent.parent.parent


def named_arguments() -> set[str]:
    """The arguments that any message names."""
    files = [
        path
        for room in ("src", "analysis", "lut_export")
        for path in (SOURCES / room).rglob("*.py")
    ]
    pattern = re.compile(r"\bArg\(\s*[\"'](\w+)")
    return {name for path in files for name in pattern.findall(path.read_text(encoding="utf-8"))}


@pytest.mark.parametrize("action", ["analyze", "render", "bake", "export", "config", "install"])
def test_every_argument_that_a_message_names_is_a_field(opened: Window, action: str) -> None:
    dialog = opened.action(action)()
    assert isinstance(dialog, VerbDialog)
    shows = opened.verbs.analyze_show("edit.edl") if action == "analyze" else dialog
    parser = build_parser(dialog.verb)
    verbs = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    fields = (*dialog.fields, *shows.fields)
    offered = {word for field in fields for word in (field.flag, *field.choices)}
    named = named_arguments()
    assert "process_space" in named
    for option in verbs.choices[dialog.verb]._actions:
        if option.dest in named - NOT_ASKED:
            assert offered & set(option.option_strings), option.dest


def test_an_analysis_asks_four_things_and_more_shows_the_rest(opened: Window) -> None:
    dialog = opened.verbs.analyze()
    dialog.show()
    seen = [
        field.flag
        for field, entry in zip(dialog.fields, dialog.inputs, strict=True)
        if entry.isVisible()
    ]
    assert seen == ["", "-o", "--frames", "--input-space"]
    dialog.more.click()
    assert all(entry.isVisible() for entry in dialog.inputs)


def test_colour_spaces_and_formats_are_searched(opened: Window, qtbot: Any) -> None:
    dialog = opened.verbs.analyze()
    spaces = dialog.entry("--input-space")
    assert isinstance(spaces, SearchChoice)
    dialog.activateWindow()
    qtbot.waitUntil(dialog.isActiveWindow)
    spaces.setFocus()
    QTest.keyClicks(spaces, "logc4")
    found = spaces.completer().completionModel()
    names = [found.data(found.index(row, 0)) for row in range(found.rowCount())]
    assert "ARRI LogC4" in names
    assert all("logc4" in name.lower() for name in names)
    spaces.setEditText("ARRI LogC4")
    assert dialog.words()[-2:] == ["--input-space", "ARRI LogC4"]
    formats = opened.verbs.export().entry("--format")
    assert isinstance(formats, SearchChoice)
    formats.showPopup()
    assert "resolve_cube" in [formats.itemText(k) for k in range(formats.count())]


def test_a_sudden_cut_has_a_button_that_allows_it(
    window: Window, tmp_path: Path, qtbot: Any
) -> None:
    folder = tmp_path / "two"
    folder.mkdir()
    rng = np.random.default_rng(0)
    for number in range(1, 13):
        pixels = np.zeros((36, 64, 3), np.uint8)
        pixels[:, :, 0 if number < 7 else 2] = rng.integers(150, 250, (36, 64))
        image = oiio.ImageBuf(oiio.ImageSpec(64, 36, 3, oiio.UINT8))
        image.set_pixels(oiio.ROI(0, 64, 0, 36, 0, 1, 0, 3), pixels)
        image.write(str(folder / f"two.{number:04d}.png"))
    window.open_path(str(folder))
    (dialog,) = window.verbs.dialogs
    dialog.start()
    qtbot.waitUntil(lambda: dialog.stage.text() == texts.FAILED, timeout=60_000)
    assert "sudden cut" in dialog.log.toPlainText()
    width = dialog.sizeHint().width()
    dialog.offer([f"--frames {number}-{number + 10}" for number in range(1000, 1060, 10)])
    qtbot.waitUntil(lambda: dialog.offers[-1].isVisible())
    assert dialog.sizeHint().width() < 1.5 * width  # many stand below each other, and are read
    allow = next(
        button for button in dialog.offers if button.text() == texts.OFFERS["--allow-cuts"]
    )
    allow.click()
    qtbot.waitUntil(lambda: window.session.document is not None, timeout=60_000)
    # What was noted stays in sight when the dialog has closed.
    qtbot.waitUntil(lambda: bool(window.banner.entries))
    (note,) = (each for each in window.banner.entries.values() if "sudden cut" in each.text)
    assert note.level == "warning"
    assert not note.text.startswith(("note:", "warning:"))  # the banner says it


def test_what_the_notes_of_an_analysis_advise_is_a_button_away(opened: Window, qtbot: Any) -> None:
    dialog = opened.verbs.analyze_again()
    dialog.notes, dialog.advised = "not convex", ["--set convexity=10"]
    opened.verbs._open_result(dialog)
    button = opened.banner.button(f"{texts.ANALYZE_AGAIN}…")
    assert button is not None
    button.click()
    again = opened.verbs.dialogs[-1]
    again.offers[0].click()
    assert again.value("--set") == "convexity=10"


def test_undo_brings_back_the_palette_before_an_analysis(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    session = opened.session
    before = sidecar.read_bytes()
    dialog = opened.verbs.analyze_again()
    enter(dialog, "--vertices", "9")
    dialog.start()
    qtbot.waitUntil(lambda: not opened.verbs.dialogs, timeout=120_000)
    after = sidecar.read_bytes()
    assert after != before
    opened.banner.tell("notes", "the palette is coarse", "warning", {})
    opened._do("undo")
    assert sidecar.read_bytes() == before
    assert "notes" not in opened.banner.entries
    assert session.document is not None
    ids = session.document.grade.core.polytope.vertex_ids
    opened._do("redo")
    assert sidecar.read_bytes() == after
    # An edit after it is undone first.
    first = session.document.grade.core.polytope.vertex_ids[0]
    session.edit(lambda document: document.adjust(first, by=(0.1, 0, 0)))
    opened._do("undo")
    assert len(session.document.grade.core.polytope.vertex_ids) == 9
    opened._do("undo")
    assert session.document.grade.core.polytope.vertex_ids == ids
    assert sidecar.read_bytes() == before


def test_where_media_are_read_only_another_place_is_proposed(
    window: Window,
    analysed: Path,
    tmp_path: Path,
    qtbot: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shutil.copytree(analysed / "clip", tmp_path / "media")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    real = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode: real(path, mode) and Path(path) != tmp_path / "media"
    )
    window.open_path(str(tmp_path / "media"))
    (dialog,) = window.verbs.dialogs
    out = tmp_path / "home" / "palette4d" / "frame.p4d.json"
    assert dialog.value("-o") == str(out)
    assert str(out.parent) in window.session.status.text
    dialog.start()
    qtbot.waitUntil(lambda: dialog not in window.verbs.dialogs, timeout=120_000)
    assert window.session.path == out


def test_a_sequence_is_rendered_to_a_sequence_and_the_version_is_named(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    dialog = opened.verbs.render()
    assert dialog.windowTitle() == "Render the grade"
    out = sidecar.with_name("clip_graded") / "frame.####.png"
    assert dialog.value("-o") == str(out)
    frames = dialog.entry("--frames")
    assert isinstance(frames, QLineEdit)
    assert "1-12x2" in frames.placeholderText()
    dialog.close()
    opened.action("save_version")()
    dialog = opened.verbs.render()
    assert dialog.go.text() == "Render version A"
    enter(dialog, "--frames", "1-12x4")
    dialog.start()
    qtbot.waitUntil(lambda: len([*out.parent.glob("frame.*.png")]) == 3, timeout=60_000)
    qtbot.waitUntil(lambda: dialog.job is None, timeout=60_000)
