"""The file formats of bakes: names, extensions and abilities.

Two extensions have two formats each; the first in `FORMATS` is the default:

- .cube: Resolve's dialect is the default, and only it can hold a shaper. Without a shaper both
  dialects have the same lines, which every program reads.
- .3dl: Flame's dialect is the plain file that most programs read. Lustre's has a header.
"""

import difflib
from dataclasses import dataclass
from pathlib import Path

from palette4d.lut_export.lut3d import LARGEST, SMALLEST
from palette4d.lut_export.writers import Writer, by_baker, by_transforms

from palette4d.common.errors import Palette4dError

_TEXT = "six decimals, 5e-7"
_INTEGERS = "12-bit integers from 0 to 1, 1.3e-4"
_FLOAT = "32-bit float"


@dataclass(frozen=True)
class LutFormat:
    """A file format.

    Attributes
    ----------
    name : for ``--format`` and ``--json``; for 3D LUTs OpenColorIO's name, if it is short.
    title : the name for people.
    extension : with the dot, lower case.
    readings : the ways in which hosts read it (`bake_error.READINGS`); the error is stated for
        each.
    rounding : the precision of the file's code values.
    write : (3D LUT, description) -> the file's text; None for a CDL.
    shaper : whether it can hold a shaper.
    described : whether it can describe itself in comments or metadata.
    discrete : whether it holds a list of transforms, so also conversions before and after the 3D
        LUT.
    smallest : the least number of samples per side.
    powers : it allows only 2^k + 1 samples per side.
    """

    name: str
    title: str
    extension: str
    readings: tuple[str, ...]
    rounding: str
    write: Writer | None
    shaper: bool = False
    described: bool = False
    discrete: bool = False
    smallest: int = SMALLEST
    powers: bool = False

    @property
    def is_cdl(self) -> bool:
        """Whether it holds a colour decision list instead of a 3D LUT."""
        return self.write is None

    def check_size(self, size: int) -> None:
        """Refuse a 3D LUT that the format cannot hold."""
        if size < self.smallest or (self.powers and size not in self.sizes()):
            raise Palette4dError(
                f"{self.title} cannot hold {size} samples a side; expected "
                + (", ".join(map(str, self.sizes())) if self.powers else f"{self.smallest} or more")
            )

    def sizes(self) -> list[int]:
        """Return the sizes 2^k + 1 that it can hold, in rising order."""
        powers = [2**k + 1 for k in range(8)]
        return [size for size in powers if self.smallest <= size <= LARGEST]

    def larger(self, size: int) -> int | None:
        """Return the next size (half the spacing, at most the largest); None after the largest."""
        return None if size >= LARGEST else min(2 * (size - 1) + 1, LARGEST)


# Only transform formats name the interpolation; for the others hosts offer both kinds.
_EITHER = ("linear", "tetrahedral")
_CDL = ("clamped", "not clamped")

FORMATS = (
    LutFormat(
        "resolve_cube", "Resolve .cube", ".cube", _EITHER, _TEXT, by_baker("resolve_cube"),
        shaper=True, described=True,
    ),
    LutFormat(
        "iridas_cube", "Iridas/Adobe .cube", ".cube", _EITHER, _TEXT, by_baker("iridas_cube"),
        described=True,
    ),
    LutFormat(
        "clf", "Academy/ASC Common LUT Format", ".clf", ("tetrahedral",), _FLOAT,
        by_transforms("Academy/ASC Common LUT Format"),
        shaper=True, described=True, discrete=True,
    ),
    LutFormat(
        "ctf", "Color Transform Format", ".ctf", ("tetrahedral",), _FLOAT,
        by_transforms("Color Transform Format"), shaper=True, described=True, discrete=True,
    ),
    LutFormat("spi3d", "Sony Imageworks .spi3d", ".spi3d", _EITHER, _TEXT, by_baker("spi3d")),
    LutFormat(
        "cinespace", "Cinespace .csp", ".csp", _EITHER, _TEXT, by_baker("cinespace"),
        shaper=True, described=True,
    ),
    LutFormat(
        "flame", "Flame .3dl", ".3dl", _EITHER, _INTEGERS, by_baker("flame"),
        smallest=5, powers=True,
    ),
    LutFormat(
        "lustre", "Lustre .3dl", ".3dl", _EITHER, _INTEGERS, by_baker("lustre"),
        smallest=5, powers=True,
    ),
    LutFormat("houdini", "Houdini .lut", ".lut", _EITHER, _TEXT, by_baker("houdini"), shaper=True),
    LutFormat("iridas_itx", "Iridas .itx", ".itx", _EITHER, _TEXT, by_baker("iridas_itx")),
    LutFormat("truelight", "Truelight .cub", ".cub", _EITHER, _TEXT, by_baker("truelight")),
    LutFormat("cc", "ASC CDL, ColorCorrection", ".cc", _CDL, "double", None, described=True),
    LutFormat(
        "ccc", "ASC CDL, ColorCorrectionCollection", ".ccc", _CDL, "double", None, described=True
    ),
    LutFormat("cdl", "ASC CDL, ColorDecisionList", ".cdl", _CDL, "double", None, described=True),
)  # fmt: skip


def format_names() -> list[str]:
    """Return the names that ``--format`` takes."""
    return [known.name for known in FORMATS]


def format_named(name: str) -> LutFormat:
    """Return the format of a name, or of an extension with or without its dot."""
    wanted = name.lower()
    for known in FORMATS:
        if wanted in (known.name, known.extension, known.extension[1:]):
            return known
    if wanted == "spi1d":
        raise Palette4dError(
            "found the format spi1d, which holds 1D LUTs; an edit mixes the channels: expected a "
            "format with a 3D LUT, such as spi3d"
        )
    near = difflib.get_close_matches(wanted, format_names(), n=3, cutoff=0.5)
    expected = " or ".join(near) if near else ", ".join(format_names())
    raise Palette4dError(f"found the format {name!r}, expected {expected}")


def format_of(path: Path, name: str | None = None) -> LutFormat:
    """Return the format of a file: the named format, else the format of its extension."""
    extension = path.suffix.lower()
    if name is not None:
        named = format_named(name)
        if extension != named.extension:
            raise Palette4dError(
                f"{path}: found the extension {path.suffix!r} for the format {named.name}, "
                f"expected {named.extension}, by which programs know it"
            )
        return named
    for known in FORMATS:
        if known.extension == extension:
            return known
    listed = ", ".join(dict.fromkeys(known.extension for known in FORMATS))
    found = f"the extension {path.suffix!r}" if path.suffix else "no extension"
    raise Palette4dError(f"{path}: found {found}; expected one of {listed}")


def shaper_warning(name: str) -> str | None:
    """Return a note for the user about a shaper in a format, or None."""
    if name != "resolve_cube":
        return None
    return (
        "only Resolve and OpenColorIO know the shaper of a .cube; ffmpeg, melt and what is built "
        "on them read it as a part of the 3D LUT: give those a .csp"
    )


def with_shaper() -> str:
    """Return the names of the formats that can hold a shaper."""
    return ", ".join(known.name for known in FORMATS if known.shaper)
