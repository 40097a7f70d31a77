"""The scopes: they measure what the viewer shows, and follow it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from palette4d import _core
from palette4d.studio import grade_steps
from palette4d.studio.scopes import TARGETS, measure, vector_of
from palette4d.studio.scopes_view import Scopes
from palette4d.studio.window import Window

Settle = Callable[[Window], None]


def shown(window: Window, settle: Settle) -> Scopes:
    """Show the scopes, and wait for them."""
    window.show_or_hide("scopes")
    settle(window)
    return window.scopes


def recolour(window: Window, rgb: tuple[float, float, float] = (0.9, 0.2, 0.1)) -> None:
    """Give the first vertex another colour."""
    document = window.session.document
    assert document is not None
    vertex = document.grade.core.polytope.vertex_ids[0]
    window.session.edit(lambda document: document.set(vertex, rgb=rgb))


def levels(pixels: np.ndarray[Any, Any], channel: int) -> np.ndarray[Any, Any]:
    """Return the share of the pixels at each level."""
    at = np.clip(np.floor(pixels[..., channel] * 255 + 0.5), -16, 271).astype(int) + 16
    return np.bincount(at.ravel(), minlength=288) / at.size


def test_nothing_is_measured_while_the_scopes_are_hidden(opened: Window) -> None:
    assert opened.scopes.sides == {}


def test_they_measure_all_pixels_of_the_frame_as_it_is_rendered(
    opened: Window, settle: Settle
) -> None:
    recolour(opened)
    scopes = shown(opened, settle)
    session = opened.session
    assert session.player is not None
    assert session.document is not None
    pixels = session.player.frame(6)
    assert pixels is not None
    rendered = session.document.recolour(np.ascontiguousarray(pixels), 6)
    assert list(scopes.sides) == ["after"]
    for channel in range(3):
        wanted = levels(rendered, channel)
        np.testing.assert_allclose(scopes.sides["after"].histogram[channel + 1], wanted, atol=2e-3)


def test_a_wipe_shows_both_sides_and_the_one_before_is_the_source(
    opened: Window, settle: Settle
) -> None:
    scopes = shown(opened, settle)
    source = scopes.sides["after"]
    recolour(opened)
    opened.session.look(compare="wipe")
    settle(opened)
    assert list(scopes.sides) == ["before", "after"]
    np.testing.assert_array_equal(scopes.sides["before"].luma, source.luma)
    assert (scopes.sides["after"].luma != source.luma).any()
    opened.session.look(compare="before")
    settle(opened)
    assert list(scopes.sides) == ["before"]


def test_exposure_and_mattes_change_no_scope(opened: Window, settle: Settle) -> None:
    scopes = shown(opened, settle)
    before = scopes.sides["after"]
    opened.session.look(exposure=2.0, gamma=1.5)
    settle(opened)
    document = opened.session.document
    assert document is not None
    opened.session.hover_over(document.grade.core.polytope.vertex_ids[0])
    settle(opened)
    np.testing.assert_array_equal(scopes.sides["after"].luma, before.luma)
    np.testing.assert_array_equal(scopes.sides["after"].vectors, before.vectors)


def test_while_a_colour_is_dragged_the_scopes_follow(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    scopes = shown(opened, settle)
    document = opened.session.document
    assert document is not None
    before, vertex = scopes.sides["after"], document.grade.core.polytope.vertex_ids[0]
    opened.session.drag(lambda d: d.set(vertex, rgb=(0.9, 0.1, 0.1)))
    qtbot.waitUntil(lambda: (scopes.sides["after"].luma != before.luma).any(), timeout=20_000)
    assert opened.session.dragging
    opened.session.cancel()
    settle(opened)
    np.testing.assert_array_equal(scopes.sides["after"].luma, before.luma)


def test_picks_and_holds_are_marks_before_and_after(opened: Window, settle: Settle) -> None:
    session = opened.session
    session.edit(lambda d: d.pick(6, colour=(0.4, 0.5, 0.2), to=(0.6, 0.3, 0.2), any_value=True))
    session.edit(lambda d: d.hold(6, colour=(0.2, 0.3, 0.6), any_value=True))
    scopes = shown(opened, settle)
    marks = {mark.id: mark for mark in scopes.marks()}
    np.testing.assert_allclose(marks["p1"].before, (0.4, 0.5, 0.2), atol=1e-5)
    np.testing.assert_allclose(marks["p1"].after, (0.6, 0.3, 0.2), atol=1e-5)
    assert not marks["p1"].hold
    assert len(marks) == 2
    assert marks["p2"].hold
    grade_steps.enable(session, "p1", False)
    assert [mark.id for mark in scopes.marks()] == ["p2"]
    # Of the version that is shown.
    opened.session.edit(lambda document: document.save_version("A"))
    opened.session.edit(lambda document: document.unpick("p2"))
    assert scopes.marks() == []
    opened.session.look(after="A")
    assert [mark.id for mark in scopes.marks()] == ["p2"]


def test_the_chosen_scopes_are_remembered(opened: Window, settle: Settle) -> None:
    scopes = shown(opened, settle)
    assert scopes.shown == ["waveform", "vectorscope"]
    scopes.buttons["waveform"].click()
    scopes.buttons["parade"].click()
    scopes.closer.click()
    again = Scopes(opened.session, opened.viewer, opened.settings)
    assert again.shown == ["parade", "vectorscope"]
    assert again.zoom == 2
    again.deleteLater()


def test_every_choice_of_scopes_is_drawn(
    opened: Window, settle: Settle, qapp: QApplication
) -> None:
    scopes = shown(opened, settle)
    opened.session.look(compare="side")
    settle(opened)
    pictures = set()
    for name in scopes.buttons:
        for other, button in scopes.buttons.items():
            button.setChecked(other == name)
        image = scopes.canvas.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
        pictures.add(bytes(image.constBits()))
    assert len(pictures) == 4


def test_targets_stand_at_the_angles_of_a_vectorscope() -> None:
    angles = {
        name: math.degrees(math.atan2(-y, x)) % 360
        for name, (x, y) in ((n, vector_of(np.array(rgb))) for n, rgb in TARGETS.items())
    }
    wanted = {"R": 102.9, "Yl": 174.8, "G": 229.7, "Cy": 282.9, "B": 354.8, "Mg": 49.7}
    for name, angle in wanted.items():
        assert abs(angles[name] - angle) < 0.2


def test_a_column_of_one_colour_is_a_line_at_its_level() -> None:
    found = measure(np.full((50, 40, 3), 0.5, np.float32), 1.0)
    row = 287 - (128 + _core.SCOPE_BELOW)
    assert (found.luma[row] > 200).all()
    assert np.flatnonzero(found.luma.any(axis=1)).tolist() == [row - 1, row, row + 1]
    assert tuple(np.argwhere(found.vectors.max(axis=2) > 200).mean(axis=0)) == (128.0, 128.0)


def test_clipped_pixels_are_counted() -> None:
    image = np.full((10, 10, 3), 0.5, np.float32)
    image[:1], image[1:3] = -0.2, 1.5
    found = measure(image, 1.0)
    np.testing.assert_allclose(found.clipped, [[0.1, 0.2]] * 3)
