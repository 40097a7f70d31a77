"""Palette colours as the screen shows them: through the clip's display and view.

Toolkit-free. Input: code values of the palette. Output: 8 bits, as the viewer's pictures.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from palette4d.studio.session import Session

U8 = NDArray[np.uint8]


def on_screen(session: "Session", rgb: ArrayLike) -> U8:
    """Return (…, 3) uint8 display values of (…, 3) code values of the palette; NaN is black."""
    colours = np.nan_to_num(np.asarray(rgb, np.float64))
    document, display = session.document, session.display
    conversion = None if document is None else document.core.conversion
    if conversion is not None:
        colours = conversion.steps.to_clip(colours)
    flat = np.ascontiguousarray(colours, np.float32).reshape(1, -1, 3)
    if display is None:
        return np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)
    shown = display.painter(session.looked).paint(flat, exact=flat.size < 1000, threads=False)
    return np.ascontiguousarray(shown[0, :, :3]).reshape(colours.shape)
