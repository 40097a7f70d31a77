"""A window that is used until it is killed: python killed_window.py SIDECAR SEED

It prints ``released N EDITS`` when the mouse is released for the N-th time, and ``saved N`` when
the window says that everything is saved. EDITS are then the picks' new colours in the window, and
where their windows were put.
"""

from __future__ import annotations

import json
import os
import random
import sys
import time

os.environ["QT_QPA_PLATFORM"] = "offscreen"

from PySide6.QtCore import QPoint, QSettings, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from windows import edits_of

from palette4d.studio import texts, theme
from palette4d.studio.session import Session
from palette4d.studio.window import Window

LEFT = Qt.MouseButton.LeftButton


def say(*words: object) -> None:
    print(*words, flush=True)


def main(sidecar: str, seed: int) -> None:
    chance = random.Random(seed)
    app = QApplication([])
    theme.dress(app)
    window = Window(Session(), QSettings(f"{sidecar}.ini", QSettings.Format.IniFormat))
    window.resize(1200, 900)
    window.show()
    window.open_path(sidecar)
    session = window.session
    released = 0

    def look() -> None:
        if released and texts.SAVED in window.line.file_facts.text().split("  ·  "):
            say("saved", released)

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(5)
    for number in range(1, 1000):
        picks = session.document.grade.picks
        if not picks or (len(picks) < 6 and chance.random() < 0.5):
            clip = session.clip
            x, y = chance.randrange(clip.width), chance.randrange(clip.height)
            at = window.viewer.point_of(x + 0.5, y + 0.5).toPoint()
            QTest.mouseClick(window.viewer, LEFT, pos=at)
            end = time.monotonic() + 20  # the first click comes before the frame is read
            while session.place is None and time.monotonic() < end:
                QTest.qWait(5)
        else:
            session.select(chance.choice(picks).id)
        QTest.qWait(chance.randrange(400))
        if session.place is None and chance.random() < 0.5:
            session.go(chance.choice(session.clip.frames))
            drag_window(window, QPoint(chance.randrange(10, 60), chance.randrange(10, 60)))
        else:
            drag_colour(window, chance)
        released = number
        say("released", number, json.dumps(edits_of(session.document.grade)))
        QTest.qWait(chance.randrange(1500))


def drag_window(window: Window, by: QPoint) -> None:
    """Move the window of the selected pick; without one, give it one."""
    handles, viewer = window.viewer.handles, window.viewer
    found = handles.rects()
    if found is None:
        window.inspector.panel.window_rows.on.click()
        return
    start = found[0].center().toPoint()
    QTest.mousePress(viewer, LEFT, pos=start)
    for share in (1, 2, 3):
        QTest.mouseMove(viewer, start + by * share / 3)
        QTest.qWait(10)
    QTest.mouseRelease(viewer, LEFT, pos=start + by)


def drag_colour(window: Window, chance: random.Random) -> None:
    """Drag in the wheel."""
    wheel = window.inspector.wheel
    QTest.mousePress(wheel, LEFT, pos=QPoint(68, 68))
    for _ in range(3):
        QTest.mouseMove(wheel, QPoint(chance.randrange(20, 116), chance.randrange(20, 116)))
        QTest.qWait(10)
    QTest.mouseRelease(wheel, LEFT, pos=wheel.rect().center())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
