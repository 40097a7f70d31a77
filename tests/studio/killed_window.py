"""A window that is used until it is killed: python killed_window.py SIDECAR SEED

It prints ``released N EDITS`` when the mouse is released for the N-th time, and ``saved N`` when
the window says that everything is saved. EDITS are the picks' new colours in the window then.
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
    session, wheel = window.session, window.inspector.wheel
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
        QTest.mousePress(wheel, LEFT, pos=QPoint(68, 68))
        for _ in range(3):
            QTest.mouseMove(wheel, QPoint(chance.randrange(20, 116), chance.randrange(20, 116)))
            QTest.qWait(10)
        QTest.mouseRelease(wheel, LEFT, pos=wheel.rect().center())
        released = number
        say("released", number, json.dumps({p.id: p.to for p in session.document.grade.picks}))
        QTest.qWait(chance.randrange(1500))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
