"""palette4d: time-varying palettes for colour grading.

A clip is analysed once (`palette4d.analysis`); the result, a 4D skew polytope, lives with its edits
in a sidecar file, which the OpenFX node, `palette4d render` and the bakes read through one core.
"""

from palette4d._core import (
    SIDECAR_VERSION,
    Edits,
    Polytope,
    Recolourer,
    Sidecar,
    Slice,
    __version__,
    edited_colours,
    mean_value_coordinates,
    palette_weights,
    parse_sidecar,
    polytope_weights,
    read_sidecar,
    slice_at,
)
from palette4d.common.errors import Palette4dError, SidecarError

__all__ = [
    "SIDECAR_VERSION",
    "Edits",
    "Palette4dError",
    "Polytope",
    "Recolourer",
    "Sidecar",
    "SidecarError",
    "Slice",
    "__version__",
    "edited_colours",
    "mean_value_coordinates",
    "palette_weights",
    "parse_sidecar",
    "polytope_weights",
    "read_sidecar",
    "slice_at",
]
