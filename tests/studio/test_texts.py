"""All texts of the window are in `studio/texts.py`: with others there, the window shows others."""

from __future__ import annotations

import re
from typing import Any

import pytest
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLabel,
    QLineEdit,
    QTreeWidget,
    QWidget,
)

from palette4d.studio import texts
from palette4d.studio.window import Window

#: Numbers, ids, keys, letters of channels, names of files, programs, displays and colour spaces,
#: and what Qt itself writes on its docks.
DATA = re.compile(
    r"^([\W\d_]*|[A-Zh]|[vsep]\d+|#?[0-9a-f]{6}|\d+(\.\d+)?|/ \d+.*|.*(\.p4d\.json|####).*"
    r"|Kdenlive|Shotcut|cube|side|wipe|skew|static|paper|rgbt|[$]OCIO|Float|Close"
    r"|by-rates|frame-for-frame|auto|none|linear|log|palette|clf|resolve_cube|hold|black|error"
    r"|prores\d+(hq)?|dnxhr-\w+|h264|hevc|\d+-\d+x\d+.*"
    r"|Scroll (Left|Right)|Qt.*"
    r"|.*(sRGB|ocio|P3|Rec|ACES|XYZ|palette4d ).*|/.*)$"
)


def turned(value: Any) -> Any:
    """A text in another language; names in braces stay."""
    if isinstance(value, str):
        return f"«{value}»" if any(map(str.isalpha, value)) else value
    if isinstance(value, tuple):
        return tuple(map(turned, value))
    return {key: turned(each) for key, each in value.items()} if isinstance(value, dict) else value


@pytest.fixture
def foreign(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Window:
    """A window in another language, with the clip and its palette."""
    for name, value in list(vars(texts).items()):
        if name.isupper():
            monkeypatch.setattr(texts, name, turned(value))
    window: Window = request.getfixturevalue("opened")
    return window


def words_of(top: QWidget) -> list[str]:
    """Everything that is written in a window and its parts, as far as widgets know."""
    found = [top.windowTitle()]
    for widget in top.findChildren(QWidget):
        found += [widget.toolTip(), widget.accessibleName(), widget.windowTitle()]
        if isinstance(widget, QLabel | QAbstractButton):
            found.append(widget.text())
        if isinstance(widget, QLineEdit):
            found.append(widget.placeholderText())
        if isinstance(widget, QComboBox):
            found += [widget.itemText(k) for k in range(widget.count())]
        if isinstance(widget, QTreeWidget):
            head = widget.headerItem()
            found += [head.text(k) for k in range(widget.columnCount()) if head is not None]
    found += [action.text().partition("\t")[0] for action in top.findChildren(QAction)]
    return [text for text in found if text]


def test_a_translation_replaces_every_text(
    foreign: Window,
) -> None:
    session = foreign.session
    assert session.document is not None
    session.select(session.document.grade.core.polytope.vertex_ids[0])
    session.edit(lambda document: document.pick(6, colour=(0.5, 0.4, 0.3), to=(1, 0, 0)))
    for name in ("analyze", "analyze_again", "render", "bake", "export", "config", "install"):
        foreign.action(name)()
    foreign.help.manual()
    own = [
        text
        for top in (foreign, *foreign.verbs.dialogs)
        for text in words_of(top)
        if "«" not in text and not DATA.match(text)
    ]
    assert not own, sorted(set(own))
