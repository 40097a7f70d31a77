"""Pixels of the frame: the one under the pointer, and those that a click or a box picks.

It knows no toolkit.
"""

import math
from typing import Any

import numpy as np

from palette4d import _core
from palette4d.grade.clip_of_picks import main_colour
from palette4d.grade.edits import as_colour
from palette4d.studio import texts
from palette4d.studio.preview import Grade, Part, Preview
from palette4d.studio.session import Session
from palette4d.studio.states import Place, Probe

#: The side of a cell of the clean-up, and how far from a pixel it sees
#: (core/output/clean_up.cpp).
CELL, REACH = 4, 32


def place_between(session: Session, first: tuple[int, int], last: tuple[int, int]) -> Place | None:
    """Return the box between two pixels of the playhead's frame; None where there is no colour."""
    if session.player is None or session.document is None:
        return None
    pixels = session.player.frame(session.frame)
    if pixels is None:
        return None
    side = max(abs(last[0] - first[0]), abs(last[1] - first[1])) + 1
    side += 1 - side % 2
    x, y = (first[0] + last[0]) // 2, (first[1] + last[1]) // 2
    half = side // 2
    box = pixels[max(0, y - half) : y + half + 1, max(0, x - half) : x + half + 1]
    assert session.clip is not None
    straight = _core.straight_colours(box, premultiplied=session.clip.premultiplied)
    colours = straight.reshape(-1, 3).astype(np.float64)
    own = session.document.grade.core.conversion
    if own is not None:
        colours = own.steps.to_palette(colours)
    colours = colours[np.isfinite(colours).all(axis=1)]
    if not len(colours):
        session.say(texts.NO_COLOUR, "warning")
        return None
    main = colours[main_colour(colours, session.document.grade.display())].mean(axis=0)
    x, y = of_palette(session, x, y)
    side = math.ceil(side / proxy_of(session)[0])
    return Place(session.frame, x, y, side + 1 - side % 2, as_colour(main.tolist()))


def probe_at(session: Session, x: int, y: int) -> Probe | None:
    """Return a pixel's code values before and after, and its weights."""
    if session.player is None or session.clip is None:
        return None
    pixels = session.player.frame(session.frame)
    if pixels is None or not (0 <= y < pixels.shape[0] and 0 <= x < pixels.shape[1]):
        return None
    pixel = np.ascontiguousarray(pixels[y : y + 1, x : x + 1])
    source = tuple(float(v) for v in pixel[0, 0])
    if session.document is None:
        return Probe(x, y, source, source)
    grade = Grade.shown(session.document, session.view.after, session.frame)
    part = _around(pixels.shape, x, y)
    left, top, right, bottom = part
    around, row, column = pixels[top:bottom, left:right], y - top, x - left
    grade = grade.of_part(part, proxy_of(session))
    result = Preview.exact(around, grade, session.clip.premultiplied)[row, column]
    colour: Any = _core.straight_colours(pixel, premultiplied=session.clip.premultiplied)[0]
    if grade.conversion is not None:
        colour = grade.conversion.to_palette(colour)
    weights, _ = _core.palette_weights(colour, grade.palette.rgb, grade.palette.faces)
    shares: dict[str, float] = {}
    for id_, share in zip(grade.palette.ids, weights[0], strict=True):
        shares[id_] = shares.get(id_, 0.0) + float(share)
    return Probe(x, y, source, tuple(float(v) for v in result), shares)


def proxy_of(session: Session) -> tuple[float, float]:
    """Return the pixels of the shown clip, across and down, for one of the palette's clip."""
    document, clip = session.document, session.clip
    if document is None or clip is None:
        return 1.0, 1.0
    own = document.grade.core.clip
    return clip.width / own["width"], clip.height / own["height"]


def of_palette(session: Session, x: float, y: float) -> tuple[int, int]:
    """Return the pixel of the palette's clip that is in the middle of one of the shown clip."""
    across, down = proxy_of(session)
    return int((x + 0.5) / across), int((y + 0.5) / down)


def _around(shape: tuple[int, ...], x: int, y: int) -> Part:
    """Return the part of a frame that decides a pixel's result: left, top, right and bottom.

    The cells of the clean-up are counted from the lower left corner.
    """
    height, width = shape[:2]
    left, below = max(0, x - REACH) // CELL * CELL, max(0, height - 1 - y - REACH) // CELL * CELL
    return left, max(0, y - REACH), min(width, x + REACH + 1), height - below
