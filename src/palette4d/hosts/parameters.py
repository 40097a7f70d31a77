"""The node's parameters as the hosts' files show them: names, labels, ranges and defaults.

The node describes them (`ofx_plugin/plugin`), and the files must not say anything else:
`tests/host/test_host_ui.py` compares them with what the node tells a host. What a file cannot
set in these hosts (buttons, the embedded copy, the status) is left out, and so are the handles'
ids.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """What parameters of all kinds have."""

    name: str  #: the node's, which projects store
    label: str


@dataclass(frozen=True)
class File(Parameter):
    """A path; none is chosen by default."""


@dataclass(frozen=True)
class Choice(Parameter):
    """One of several options, which MLT takes and stores by their labels."""

    options: tuple[str, ...]
    initial: str


@dataclass(frozen=True)
class Number(Parameter):
    """A number from `low` to `high`: the node's own range, or a part of it that a slider serves."""

    initial: float
    low: float
    high: float
    decimals: int = 0  #: 0: whole numbers
    animates: bool = False


@dataclass(frozen=True)
class Switch(Parameter):
    """On or off; off by default."""


@dataclass(frozen=True)
class Colour(Parameter):
    """A colour with keyframes, 8 bits a channel in MLT; grey by default."""


HANDLES = 32

#: Frames in either direction: as far as a slider is of any use.
_FAR = 100_000

SIDECAR = File("sidecar", "Sidecar")
OUTPUT = Choice(
    "output", "Output", ("Recoloured", "Weight of a handle", "Palette", "Outside"), "Recoloured"
)
WEIGHT_OF = Number("weightOf", "Handle", 1, 1, HANDLES)
STRENGTH = Number("strength", "Strength", 1, 0, 1, decimals=3, animates=True)
KEEP_LIGHTNESS = Number("keepLightness", "Keep lightness", 0, 0, 1, decimals=3, animates=True)
MIX = Number("mix", "Mix", 1, 0, 1, decimals=3, animates=True)
EDITS_FROM = Choice("editsFrom", "Edits from", ("Sidecar", "Host", "Both"), "Both")
IN_POINT = Number("inPoint", "In-point", 0, -_FAR, _FAR, decimals=2)

TIME: tuple[Parameter, ...] = (
    Choice("timing", "Timing", ("Auto", "Manual"), "Auto"),
    Number("firstFrame", "First frame at", 0, -_FAR, _FAR, decimals=2),
    Choice("conform", "Conform", ("Frame for frame", "By rates"), "Frame for frame"),
    Number("hostRate", "Host's rate", 0, 0, 1000, decimals=3),
    IN_POINT,
    Number("frameOffset", "Frame offset", 0, -_FAR, _FAR, decimals=2),
    Number("speed", "Speed", 1, 0.01, 100, decimals=4),
    Switch("reverse", "Reverse"),
    Choice("before", "Before the clip", ("Hold", "Pass through"), "Hold"),
    Choice("after", "After the clip", ("Hold", "Pass through"), "Hold"),
)


def _handles() -> tuple[Parameter, ...]:
    slots: list[Parameter] = []
    for number in range(1, HANDLES + 1):
        slots.append(Switch(f"handle{number:02}On", f"Use {number}"))
        slots.append(Colour(f"handle{number:02}", f"Handle {number}"))
    return tuple(slots)


#: All that a host with room for it shows, from what is needed first to what is seldom needed.
ALL: tuple[Parameter, ...] = (
    SIDECAR,
    OUTPUT,
    WEIGHT_OF,
    Choice("matteIn", "Matte in", ("Picture", "Alpha"), "Picture"),
    Number("outsideReach", "Outside at", 0.05, 0.001, 1, decimals=4),
    STRENGTH,
    KEEP_LIGHTNESS,
    Choice(
        "lightnessOf",
        "Lightness of",
        ("Auto", "Rec.709", "Rec.2020", "P3", "ACES AP1", "Rec.601"),
        "Auto",
    ),
    MIX,
    Choice(
        "pictureIn",
        "Picture is in",
        ("Input space", "Palette space", "Scene-linear"),
        "Input space",
    ),
    Choice("mode", "Mode", ("Auto", "Exact", "Lattice"), "Auto"),
    EDITS_FROM,
    *TIME,
    *_handles(),
)

#: What suffices where the host's own list of parameters is to be had as well.
MAIN: tuple[Parameter, ...] = (
    SIDECAR,
    OUTPUT,
    WEIGHT_OF,
    EDITS_FROM,
    STRENGTH,
    KEEP_LIGHTNESS,
    MIX,
    IN_POINT,
)
