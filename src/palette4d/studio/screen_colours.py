"""Palette colours and small pictures as the screen shows them, through the clip's display and view.

Toolkit-free. Input: code values of the palette, or pixels of the clip. Output: 8 bits.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.common.errors import Palette4dError
from palette4d.studio.display import Look

if TYPE_CHECKING:
    from palette4d.studio.session import Session

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]


def on_screen(session: "Session", rgb: ArrayLike) -> U8:
    """Return (…, 3) uint8 display values of (…, 3) code values of the palette; NaN is black."""
    colours = np.nan_to_num(np.asarray(rgb, dtype=np.float64))
    document = session.document
    own = None if document is None else document.core.conversion
    if own is not None:
        colours = np.asarray(own.steps.to_clip(colours))
    return _displayed(session, colours.astype(np.float32))


def thumbnail(session: "Session", pixels: F32, frame: float, premultiplied: bool) -> U8:
    """Return the (h, w, 3) uint8 picture of a frame's pixels with the edits, over black."""
    if session.document is not None:
        pixels = session.document.recolour(
            np.ascontiguousarray(pixels), frame, premultiplied=premultiplied
        )
    colours, alpha = pixels[..., :3], pixels[..., 3:]
    if alpha.size and premultiplied:
        colours = np.divide(colours, alpha, out=np.zeros_like(colours), where=alpha > 0)
    shown = _displayed(session, np.nan_to_num(colours))
    return np.rint(shown * np.clip(alpha, 0, 1)).astype(np.uint8) if alpha.size else shown


def _displayed(session: "Session", colours: F32) -> U8:
    view, display = session.view, session.display
    flat = np.ascontiguousarray(colours).reshape(1, -1, 3)
    if display is not None and flat.size:
        try:
            painter = display.painter(Look(view.display, view.view, view.exposure, view.gamma))
        except Palette4dError:  # the viewer says why
            pass
        else:
            seen = painter.paint(flat, exact=not session.dragging, threads=False)
            return np.ascontiguousarray(seen[..., :3]).reshape(colours.shape)
    return np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)
