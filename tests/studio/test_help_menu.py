"""docs/studio.md lists every gesture, action and key of the window."""

from __future__ import annotations

import importlib.util
import os
import re
from pathlib import Path
from types import ModuleType

import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"
pytest.importorskip("PySide6", reason="the extra palette4d[studio] is not installed")

from PySide6.QtGui import QAction, QKeySequence

from palette4d.studio.window import Window


@pytest.fixture
def keys(repo_root: Path) -> ModuleType:
    """`docs/studio_keys.py`, which writes the tables into the page."""
    spec = importlib.util.spec_from_file_location("studio_keys", repo_root / "docs/studio_keys.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(keys: ModuleType) -> None:
    page = keys.PAGE.read_text(encoding="utf-8")
    assert keys.written(page) == page, (
        "docs/studio.md is not up to date; run: python docs/studio_keys.py"
    )


def test_every_entry_of_the_menus_is_in_the_table(window: Window, repo_root: Path) -> None:
    page = (repo_root / "docs/studio.md").read_text(encoding="utf-8")
    table = {}
    menu = ""
    for line in re.findall(r"^\| .*\|$", page[page.index("| menu |") :], re.MULTILINE)[1:]:
        first, text, listed = (cell.strip() for cell in line.strip("|").split("|"))
        menu = first or menu
        table[menu, text] = re.findall(r"`([^`]+)`", listed)
    docks = {dock.windowTitle() for dock in window.docks.values()}
    shown = 0
    for entries in window.menus.values():
        title = entries.title().replace("&", "")
        for action in entries.actions():
            if action.isSeparator() or action.menu() is not None or action.text() in docks:
                continue
            text, _, seen = action.text().partition("\t")
            assert (title, text) in table, f"{title} > {text} is not in docs/studio.md"
            assert keys_of(action, seen) == [
                QKeySequence(key).toString() for key in table[title, text]
            ]
            shown += 1
    assert shown > 60


def test_the_table_of_the_help_is_searched(window: Window) -> None:
    manual = window.help.manual()
    assert len(list(manual.table.items())) > 90
    manual.table.search.setText("wipe")
    seen = [item for item in manual.table.items() if not item.isHidden()]
    assert 0 < len(seen) < 6
    assert all(item.text(0) or k for k, item in enumerate(seen))
    manual.close()


def keys_of(action: QAction, seen: str) -> list[str]:
    """The keys that an entry shows or takes."""
    found = [key.toString() for key in action.shortcuts()]
    return found or ([QKeySequence(seen).toString()] if seen else [])
