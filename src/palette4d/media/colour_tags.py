"""The colour tags of files, and the names of encodings that mean the same.

Tags are the code points of ITU-T H.273, which movies (colr, VUI) and PNG (cICP) hold. `_ENCODINGS`
is the one table between them and names: palette4d's, OpenImageIO's (colorInteropID) and DPX's.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

UNKNOWN = 2
"""The code point for primaries, a transfer or a matrix that a file does not state."""

#: Weights of red and blue in luma, by matrix coefficients.
LUMA_WEIGHTS = {
    1: (0.2126, 0.0722),
    4: (0.30, 0.11),
    5: (0.299, 0.114),
    6: (0.299, 0.114),
    7: (0.212, 0.087),
    9: (0.2627, 0.0593),
    10: (0.2627, 0.0593),
}
#: The matrices that a user may name.
MATRICES = {"601": 6, "709": 1, "2020": 9}
#: Matrices that cannot be read, by their names.
UNREADABLE = {8: "YCgCo", 11: "YDzDx", 12: "chromaticity-derived", 13: "chromaticity-derived"}
UNREADABLE |= {14: "ICtCp", 15: "IPT-C2", 16: "YCgCo-Re", 17: "YCgCo-Ro"}
PQ, HLG = 16, 18
#: Rec.709, Rec.601 and Rec.2020 have one transfer.
_CAMERA = {1: "Rec.709", 6: "Rec.601", 14: "Rec.2020", 15: "Rec.2020"}


@dataclass(frozen=True)
class ColourTags:
    """A file's colour tags; a tag that is missing is `UNKNOWN`.

    Attributes
    ----------
    primaries, transfer, matrix : code points of H.273; matrix 0 is R'G'B'.
    full_range : code values use all of the bits, not 16 to 235 of 8 bits.
    """

    primaries: int = UNKNOWN
    transfer: int = UNKNOWN
    matrix: int = UNKNOWN
    full_range: bool = False

    @property
    def pair(self) -> tuple[int, int]:
        """Primaries and transfer."""
        return self.primaries, self.transfer

    @property
    def known(self) -> bool:
        """Whether primaries and transfer are known."""
        return UNKNOWN not in self.pair

    def for_luma_chroma(self) -> ColourTags:
        """Return the tags of Y'CbCr made from these colours, with a matrix that can be written."""
        if self.matrix in LUMA_WEIGHTS and self.matrix != 10:
            return self
        matrix = 9 if self.primaries == 9 else 6 if self.primaries in (5, 6, 7) else 1
        return dataclasses.replace(self, matrix=matrix)


# Our name; the name of the ASWF's interop forum, "" if it has none; primaries and transfer; other
# names. Of several rows with one pair of code points, the first names it.
_ENCODINGS: tuple[tuple[str, str, int, int, str], ...] = (
    ("sRGB", "srgb_rec709_scene", 1, 13, "srgb_rec709_display srgb_tx srgb_texture"),
    ("Rec.709", "g24_rec709_display", 1, 1, "rec709 g24_rec709 rec709_display camera_rec709"),
    ("Rec.709", "", 1, 1, "g24_rec709_scene ocio:g24_rec709_scene ocio:itu709_rec709_scene"),
    ("Rec.709", "", 1, 1, "itu-r_709-4 smpte_274m"),
    ("Rec.601", "", 6, 6, "itu-r_601-5_system_m itu-r_601-5_m"),
    ("Rec.601", "", 5, 6, "itu-r_601-5_system_b_or_g itu-r_601-5_b_or_g"),
    ("gamma 2.2", "g22_rec709_scene", 1, 4, "g22_rec709 g22_rec709_display"),
    ("gamma 2.8", "", UNKNOWN, 5, ""),
    ("SMPTE 240M", "", 7, 7, ""),
    ("linear", "lin_rec709_scene", 1, 8, "linear_rec.709 lin_rec709 lin_srgb scene_linear"),
    ("linear", "", 1, 8, "ocio:lin_rec709_scene"),
    ("Display P3", "srgb_p3d65_display", 12, 13, "srgb_p3d65_scene srgb_p3d65 displayp3_display"),
    ("P3-D65", "g26_p3d65_display", 12, 17, "p3d65_display"),
    ("P3-DCI", "", 11, 17, "p3_dci_display"),
    ("linear P3-D65", "lin_p3d65_scene", 12, 8, "lin_p3d65 lin_displayp3"),
    ("Rec.2020", "", 9, 14, "rec2020 rec1886_rec2020_display"),
    ("Rec.2100 PQ", "pq_rec2020_display", 9, PQ, "rec2100_pq_display"),
    ("Rec.2100 HLG", "hlg_rec2020_display", 9, HLG, "rec2100_hlg_display"),
    ("ST2084 P3-D65", "pq_p3d65_display", 12, PQ, "st2084_p3d65_display"),
    ("linear Rec.2020", "lin_rec2020_scene", 9, 8, "lin_rec2020"),
    ("linear XYZ", "lin_ciexyzd65_scene", 10, 8, ""),
    ("P3 XYZ", "g26_xyzd65_display", 10, 17, ""),
    ("PQ XYZ", "pq_xyzd65_display", 10, PQ, ""),
)
# The usual names for OpenImageIO's; other names stay the same.
_USUAL = {
    **dict.fromkeys(("srgb", "srgb_rec709_scene", "srgb_rec709_display"), "sRGB"),
    **dict.fromkeys(("lin_rec709", "lin_rec709_scene", "ocio:lin_rec709_scene"), "linear Rec.709"),
    **dict.fromkeys(("linear", "scene_linear"), "linear"),
    "rec709": "Rec.709",
}
_PRIMARIES = {4: "NTSC", 5: "Rec.601", 6: "Rec.601", 7: "SMPTE 240M", 8: "film", 10: "XYZ"}
_PRIMARIES |= {1: "Rec.709", 9: "Rec.2020", 11: "P3-DCI", 12: "P3-D65", 22: "EBU"}


def _plain(name: str) -> str:
    return name.strip().lower().replace(" ", "_")


_BY_NAME = {
    _plain(name): (primaries, transfer)
    for ours, interop, primaries, transfer, others in reversed(_ENCODINGS)
    for name in (ours, interop, *others.split())
    if name
}


def tags_of(encoding: str) -> ColourTags:
    """Return the primaries and transfer of an encoding's name; unknown ones if it has none.

    >>> tags_of("pq_rec2020_display").transfer, tags_of("ACEScg").known
    (16, False)
    """
    return ColourTags(*_BY_NAME.get(_plain(encoding), (UNKNOWN, UNKNOWN)))


def name_of(space: str) -> str:
    """Return the usual name for OpenImageIO's name of a colour space.

    >>> name_of("lin_rec709_scene"), name_of("pq_rec2020_display")
    ('linear Rec.709', 'pq_rec2020_display')
    """
    return _USUAL.get(_plain(space), space)


def encoding_of(tags: ColourTags) -> str:
    """Return the name of tags; "unknown" if they do not tell.

    >>> encoding_of(ColourTags(9, 1)), encoding_of(ColourTags(12, 1)), encoding_of(ColourTags(12))
    ('Rec.2020', 'Rec.709 P3-D65', 'unknown')
    """
    primaries, transfer = tags.primaries, tags.transfer
    if transfer == UNKNOWN:
        stated = tags.matrix if primaries == UNKNOWN else primaries
        return "Rec.709" if stated == 1 else "unknown"
    if transfer in _CAMERA:
        if primaries == UNKNOWN:
            return _CAMERA[transfer]
        if primaries in (1, 5, 6, 9):
            return _PRIMARIES[primaries]
        return f"Rec.709 {_PRIMARIES.get(primaries, f'primaries {primaries}')}"
    rows = [row for row in _ENCODINGS if row[3] == transfer]
    if not rows:
        return "unknown"
    exact = [row for row in rows if row[2] == primaries]
    if exact or primaries == UNKNOWN:
        return (exact or rows)[0][0]
    curve = {PQ: "PQ", HLG: "HLG", 17: "gamma 2.6"}.get(transfer, rows[0][0])
    return f"{curve} {_PRIMARIES.get(primaries, f'primaries {primaries}')}"


def interop_name(tags: ColourTags) -> str:
    """Return the interop forum's name of tags, which EXR holds; "" if it has none."""
    camera = 1 if tags.transfer in _CAMERA and tags.primaries == 1 else tags.transfer
    names = (row[1] for row in _ENCODINGS if row[1] and row[2:4] == (tags.primaries, camera))
    return next(names, "")


def chromaticities(primaries: int) -> tuple[float, ...] | None:
    """Return x and y of red, green, blue and white; None if H.273 has no such primaries."""
    return _CHROMATICITIES.get(primaries)


def primaries_of(xy: Sequence[float]) -> int:
    """Return the code point of chromaticities as `chromaticities` gives them, or `UNKNOWN`."""
    for primaries, known in _CHROMATICITIES.items():
        if max(abs(a - b) for a, b in zip(known, xy, strict=True)) < 0.002:
            return primaries
    return UNKNOWN


_D65 = (0.3127, 0.3290)
_CHROMATICITIES: dict[int, tuple[float, ...]] = {
    1: (0.640, 0.330, 0.300, 0.600, 0.150, 0.060, *_D65),
    5: (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, *_D65),
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),
    7: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *_D65),
    11: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *_D65),
}
