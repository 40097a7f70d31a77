"""Dialogs that run a verb: what they enter is the command line that they show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QCheckBox, QComboBox, QLineEdit

from palette4d.studio import texts
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
    assert dialog.words() == ["analyze", clip, "-o", str(sidecar), *added, "--keep-edits"]
    assert dialog.command.text().endswith("--set b=2 --keep-edits")


def test_shots_go_to_a_folder(opened: Window, sidecar: Path) -> None:
    dialog = opened.verbs.analyze_again()
    shots = dialog.entry("--detect-shots")
    assert isinstance(shots, QCheckBox)
    shots.setChecked(True)
    assert dialog.value("-o") == str(sidecar.with_name("clip_shots"))
    assert dialog.words()[-1] == "--detect-shots"
    shots.setChecked(False)
    assert dialog.value("-o") == str(sidecar)


def test_escape_stops_what_runs_and_the_dialog_says_so(
    opened: Window, tmp_path: Path, qtbot: Any
) -> None:
    dialog = opened.verbs.analyze_again()
    line = dialog.entry("-o")
    assert isinstance(line, QLineEdit)
    line.setText(str(tmp_path / "again.p4d.json"))
    dialog.start()
    dialog.reject()
    assert dialog.stage.text() == texts.STOPPING
    qtbot.waitUntil(lambda: dialog.stage.text() == texts.CANCELLED, timeout=30_000)
    assert dialog.isVisible()
    dialog.reject()
    assert not dialog.isVisible()


def test_a_failed_analysis_offers_the_fields_that_help(opened: Window, qtbot: Any) -> None:
    dialog = opened.verbs.analyze_again()
    edits = dialog.inputs[-2]
    assert isinstance(edits, QComboBox)
    kept = opened.session.document
    assert kept is not None
    kept.shift(kept.fields()["polytope"]["vertices"][0]["id"], by=(0.1, 0.0, 0.0))
    opened.session.save()
    edits.setCurrentIndex(0)  # refuse
    dialog.start()
    qtbot.waitUntil(lambda: dialog.stage.text() == texts.FAILED, timeout=30_000)
    assert f"'{texts.EDITS}: {texts.EDITS_NAMES[1]}'" in dialog.log.toPlainText()
    dialog.offers[0].click()
    assert dialog.words()[-1] == "--keep-edits"
    assert edits.hasFocus()
    dialog.start()
    assert not dialog.offers
    qtbot.waitUntil(lambda: dialog.stage.text() != texts.RUNNING, timeout=60_000)
    dialog.reject()
