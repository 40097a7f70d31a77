"""What the views share: the status, how the picture is shown, and pixels of a frame."""

from dataclasses import dataclass, field
from typing import Literal

Level = Literal["info", "warning", "error"]
#: Errors that have a remedy in the banner.
Code = Literal["", "not saved"]


@dataclass(frozen=True)
class Status:
    """What the last action did, or what is wrong."""

    text: str = ""
    level: Level = "info"
    code: Code = ""


@dataclass(frozen=True)
class View:
    """How the picture is shown; nothing of it changes the grade.

    Attributes
    ----------
    compare : str
        "after", "before", "wipe" or "side".
    wipe : float
        Where the wipe stands, 0..1 of the picture's width.
    display, view : str
        The OpenColorIO display and view; "" is the config's default.
    exposure, gamma : float
        Stops, and the power of the display, for looking only.
    outside : bool
        Mark the pixels outside of the palette.
    matte : bool
        Show the matte of the selected pick.
    version : str
        The version that "before" shows instead of the source; "" is the source.
    after : str
        The version that "after" shows instead of the grade; "" is the grade.
    """

    compare: Literal["after", "before", "wipe", "side"] = "after"
    wipe: float = 0.5
    display: str = ""
    view: str = ""
    exposure: float = 0.0
    gamma: float = 1.0
    outside: bool = False
    matte: bool = False
    version: str = ""
    after: str = ""


@dataclass(frozen=True)
class Probe:
    """A pixel under the pointer.

    Attributes
    ----------
    x, y : int
        Its place in the clip's frame.
    source, result : tuple of float
        Its code values before and after the edits; three or four.
    weights : dict of str to float
        Its weight on each palette colour of the frame, by id.
    """

    x: int
    y: int
    source: tuple[float, ...]
    result: tuple[float, ...]
    weights: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Place:
    """A pixel of a frame, or a box around it.

    Attributes
    ----------
    frame : int
    x, y : int
        The pixel, of the palette's clip; the box's middle.
    box : int
        The box's side in these pixels, odd; 1 is the pixel.
    colour : tuple of float
        The main colour there, in the palette's code values.
    """

    frame: int
    x: int
    y: int
    box: int
    colour: tuple[float, float, float]
