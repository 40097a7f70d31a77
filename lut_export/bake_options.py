"""What to bake, what of that is refused before any frame is read, and the shaper it asks for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import lattice as lattices
from palette4d.lut_export import shaper as shapers
from palette4d.lut_export.formats import LutFormat, with_shaper
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.shaper import Choice, Kind, Shaper
from palette4d.lut_export.spaces import INPUT

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.files import refuse_existing

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class BakeOptions:
    """What to bake.

    Attributes
    ----------
    frame : float
        The time, a frame number.
    size : int
        Samples a side, 2..129.
    strength : float
        0..1, as in the node.
    format : str or None
        A name of `formats.FORMATS`; None: by the extension.
    shaper : {"auto", "none", "linear", "log"}
        See `shaper.choose`.
    domain : (low, high) or None
        What the shaper covers; None: the frame's colours and the palette's.
    max_error : float or None
        The lattice is made larger until the file's error (`BakeResult.error`) is at most this.
    threads : int
        0: one a processor; the files do not depend on it.
    space : str
        What the file takes and returns: "input" (the clip's numbers), "palette", or a colour space.
    ocio_config : str or None
        The config that knows `space`; None: see `spaces.space_of`.
    """

    frame: float
    size: int = 33
    strength: float = 1.0
    format: str | None = None
    shaper: Choice = "auto"
    domain: tuple[float, float] | None = None
    max_error: float | None = None
    threads: int = 0
    space: str = INPUT
    ocio_config: str | None = None


def check_target(path: Path, force: bool) -> None:
    """Refuse a file that may not be written; see `replacing.refuse_existing`.

    Raises
    ------
    Palette4dError
        Also when `path` is a device or a pipe, which a file would replace.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise Palette4dError(
            f"{path}: found a device or a pipe, expected a file name; use `-o - --format …` and "
            "let the shell lead the output there"
        )
    refuse_existing(path, force)


def check_options(options: BakeOptions, format_: LutFormat, sidecar: _core.Sidecar) -> None:
    """Refuse what cannot be baked, before any frame is read.

    Raises
    ------
    Palette4dError
        Time, size, strength, shaper or domain are out of range or do not go with the format.
    """
    frame_edit(sidecar, options.frame, options.strength)
    if format_.is_cdl:
        return
    lattices.check_size(options.size)
    format_.check_size(options.size)
    if options.domain is not None:
        shapers.Shaper("linear", *options.domain)
        if options.shaper == "none" or not format_.shaper:
            # Says why the two do not go together.
            _check_shaper(shapers.Shaper("none", *options.domain), format_)
    if options.shaper in ("linear", "log"):
        _check_shaper(shapers.Shaper("log", *(options.domain or (0, 1))), format_)


def _check_shaper(shaper: Shaper, format_: LutFormat) -> None:
    if shaper.kind != "none" and not format_.shaper:
        raise Palette4dError(
            f"{format_.title} cannot hold a shaper; choose one of {with_shaper()}, or --shaper none"
        )


def choose_shaper(
    options: BakeOptions, format_: LutFormat, palette: NDArray[Any], image: F32 | None
) -> Shaper:
    """Return the shaper that the options and the colours ask for.

    The frame's colours decide whether one is needed; where it is, it covers the palette's, too, so
    that the tables of one clip resemble each other. Without a frame the palette decides. `palette`
    holds the (n, 3) colours of the whole palette, in the same numbers as `image`.
    """
    if options.domain is not None:
        kind: Kind = "log" if options.shaper == "auto" else options.shaper
        return shapers.Shaper(kind, *options.domain)
    low, high = float(palette.min()), float(palette.max())
    if image is not None:
        finite = image[..., :3][np.isfinite(image[..., :3])]
        if not finite.size or (finite.min() >= 0 and finite.max() <= 1):
            low, high = 0.0, 1.0
        else:
            low, high = min(low, float(finite.min())), max(high, float(finite.max()))
    if options.shaper == "auto" and not format_.shaper:
        return shapers.UNSHAPED
    most = shapers.LARGEST
    return shapers.choose(options.shaper, max(low, -most), min(high, most))
