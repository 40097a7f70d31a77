"""Palette colours and small pictures as the screen shows them: through the clip's display and view.

Toolkit-free. Input: code values of the palette, or pixels of the clip. Output: 8 bits, as the
viewer's pictures.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d import _core
from palette4d.studio.display import Display, Look

if TYPE_CHECKING:
    from palette4d.grade.document import Document
    from palette4d.studio.session import Session

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]


def on_screen(session: "Session", rgb: ArrayLike) -> U8:
    """Return (…, 3) uint8 display values of (…, 3) code values of the palette; NaN is black."""
    colours = np.nan_to_num(np.asarray(rgb, np.float64))
    conversion = None if session.document is None else session.document.grade.core.conversion
    if conversion is not None:
        colours = conversion.steps.to_clip(colours)
    return _painted(session.display, session.looked, colours.astype(np.float32))


def thumbnail(
    session: "Session", frame: float, premultiplied: bool, version: "Document | None" = None
) -> Callable[[F32], U8]:
    """Return a function that may run in a thread: a frame's pixels to 8 bits, with the edits.

    It takes (h, w, 3 or 4) code values and returns (h, w, 3), over black. The edits are those of
    `version`, if there is one.
    """
    document, display, look = version or session.document, session.display, session.looked

    def picture(pixels: F32) -> U8:
        if document is not None:
            pixels = document.recolour(
                np.ascontiguousarray(pixels), frame, premultiplied=premultiplied, threads=1
            )
        alpha = pixels[..., 3:]
        colours = _core.straight_colours(pixels, premultiplied=premultiplied)
        shown = _painted(display, look, np.nan_to_num(colours))
        return np.rint(shown * np.clip(alpha, 0, 1)).astype(np.uint8) if alpha.size else shown

    return picture


def _painted(display: Display | None, look: Look, colours: F32) -> U8:
    if display is None:
        return np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)
    flat = np.ascontiguousarray(colours).reshape(1, -1, 3)
    # The LUT of pictures that move covers less than some palettes reach.
    shown = display.painter(look).paint(flat, threads=False)
    return np.ascontiguousarray(shown[0, :, :3]).reshape(colours.shape)
