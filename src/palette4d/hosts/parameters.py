"""The node's parameters as the hosts' files show them: names, labels, ranges and defaults.

The node describes its parameters (`ofx_plugin/node`), and the files must agree with it:
`tests/host/test_host_ui.py` compares them. The files leave out parameters that they cannot set in
these hosts: buttons and their clip, the version, the embedded copy, the status, the handles' ids.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """The members that parameters of all kinds have."""

    name: str  #: the name in the node, which projects store
    label: str


@dataclass(frozen=True)
class File(Parameter):
    """A path; empty by default."""


@dataclass(frozen=True)
class Choice(Parameter):
    """One of several options; MLT stores the option's label."""

    options: tuple[str, ...]
    initial: str


@dataclass(frozen=True)
class Number(Parameter):
    """A number from `low` to `high`: the node's range, or the useful part of it for a slider."""

    initial: float
    low: float
    high: float
    decimals: int = 0  #: decimal places; 0: whole numbers
    animates: bool = False


@dataclass(frozen=True)
class Switch(Parameter):
    """On or off; off by default."""


@dataclass(frozen=True)
class Colour(Parameter):
    """A colour with keyframes, 8 bits a channel in MLT; grey by default."""


HANDLES = 32

#: Largest offset in frames in either direction: a longer slider is of no use.
_FAR = 100_000

SIDECAR = File("sidecar", "Sidecar")
OUTPUT = Choice(
    "output",
    "Output",
    ("Recoloured", "Weight of a handle", "Palette", "Outside", "Matte of a pick"),
    "Recoloured",
)
WEIGHT_OF = Number("weightOf", "Handle", 1, 1, HANDLES)
PICK = Number("pick", "Pick", 1, 1, 32)
STRENGTH = Number("strength", "Strength", 1, 0, 1, decimals=3, animates=True)
KEEP_LIGHTNESS = Number("keepLightness", "Keep lightness", 0, 0, 1, decimals=3, animates=True)
CLEAN_UP = Number("cleanUp", "Clean up", 1, 0, 1, decimals=3, animates=True)
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


#: All parameters, for hosts with room for them; the most important first.
ALL: tuple[Parameter, ...] = (
    SIDECAR,
    OUTPUT,
    WEIGHT_OF,
    PICK,
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
    CLEAN_UP,
    MIX,
    Choice(
        "pictureIn",
        "Input colour space",
        ("Input space", "Palette space", "Scene-linear"),
        "Input space",
    ),
    EDITS_FROM,
    *TIME,
    *_handles(),
)

#: The main parameters, for hosts that also show their own list of all parameters.
MAIN: tuple[Parameter, ...] = (
    SIDECAR,
    OUTPUT,
    WEIGHT_OF,
    PICK,
    EDITS_FROM,
    STRENGTH,
    KEEP_LIGHTNESS,
    CLEAN_UP,
    MIX,
    IN_POINT,
)
